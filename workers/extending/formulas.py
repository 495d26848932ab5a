"""What a network is said with that is a formula, once for PyTorch, ONNX, NumPy and the robot (no torch).

>>> def elman(config: RecurrentNetwork, inputs: Inputs, outputs: int) -> Description:
...     return Description(
...         lines=("i = input(x)", "h = tanh(add(i, memory(h)))", "y = head(h)"),
...         layers={"input": (32, inputs.size), "memory": (32, 32), "head": (outputs, 32)},
...         activation="tanh",
...         memory=32,
...     )

A line is 'name = expression', an expression a name, a whole number or 'name(expression, ...)': a layer, weight @ x + bias,
or an operator. `x` is given and `y` comes out; a network that remembers is given its memory as `h`, and its new memory is
what `h` is at the end. What is said before the first line that reads `h`, and after the last that makes it, is computed for
all steps of a sequence at once; what comes after sees `h` and what was said before, and not what lies between.
"""

from workers.extending.parts import FormulaNetwork, RecurrentNetwork
from workers.networks.description import Description
from workers.networks.inputs import Inputs

__all__ = ["OPERATORS", "Description", "FormulaNetwork", "Inputs", "RecurrentNetwork"]

OPERATORS: dict[str, str] = {
    "relu": "max(a, 0)",
    "leaky_relu": "a where a > 0, else 0.01 a",
    "tanh": "of each number",
    "sigmoid": "1 / (1 + exp(-a))",
    "add": "a + b",
    "subtract": "a - b",
    "multiply": "a b, number by number",
    "concatenate": "any number of (n, k) to one",
    "columns": "(a, first, one past the last)",
    "channels": "(a, count): (n, k) to (n, count, k / count), for layers that convolve",
    "flatten": "(n, channels, length) to (n, k)",
}
"""Operators of formulas; a layer whose weight has three dimensions convolves, and is called with (a, stride, padding)."""
