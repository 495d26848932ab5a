"""Formulas that people type: checked here, node by node, and made into a short program; nothing is run as Python.

The grammar is a part of Python's: numbers, the names of `QUANTITIES` and `CONSTANTS`, `+ - * / **`, comparisons (1 where
they hold, else 0), `a if condition else b`, parentheses, and the functions of `FUNCTIONS`.
"""

import ast
import math
from collections.abc import Set
from dataclasses import dataclass
from functools import lru_cache

QUANTITIES: dict[str, str] = {
    "distance": "m from the robot's centre to the target",
    "previous_distance": "the same a step before, m",
    "bearing": "of the target against the heading, rad, left positive",
    "heading": "rad, in the arena's frame",
    "speed": "m/s in this step",
    "turning_rate": "rad/s in this step, left positive",
    "last_speed": "m/s in the step before",
    "last_turning_rate": "rad/s in the step before",
    "clearance": "m from the body to anything else, the least in this step",
    "ahead": "m to what is within 30 degrees of the heading, at most the LiDAR's range",
    "nearest": "m, the shortest ray",
    "mover": "m from the body to the nearest mover; 100 where there is none",
    "steps": "of this attempt so far",
    "arrived": "1 in the step that reaches the target, else 0",
    "collided": "1 in the step of a collision, else 0",
    "timed_out": "1 in the step at the limit, else 0",
}
"""What a formula may read of a robot after a step, with its unit; the order is that of the table's rows."""

CONSTANTS: dict[str, str] = {
    "period": "s, of a control step",
    "lidar_range": "m",
    "arrival_distance": "m",
    "collision_distance": "m",
    "step_limit": "steps of an attempt",
    "max_speed": "m/s, the robot's limit",
    "max_turning_rate": "rad/s, the robot's limit",
    "pi": "3.14159...",
}
"""What a formula may read of the task."""

FUNCTIONS: dict[str, int] = {
    "abs": 1,
    "sqrt": 1,
    "exp": 1,
    "log": 1,
    "sin": 1,
    "cos": 1,
    "tanh": 1,
    "min": 2,
    "max": 2,
    "clip": 3,
}
"""Functions and how many arguments each takes; `clip(x, low, high)`."""

MAX_CHARACTERS = 300
MAX_OPERATIONS = 64
"""Numbers, names and operators of a formula, at most."""
MAX_DEPTH = 16
"""Values that wait at the same time, at most."""
MAX_NUMBER = 1e9

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}

OPERATIONS = (
    "number", "quantity", "constant", "negative", "if", *_BINARY.values(), *_COMPARISONS.values(), *FUNCTIONS
)  # fmt: skip
"""What a step of a program does; its place here is its code."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a program for a stack machine.

    Attributes:
        operation: one of `OPERATIONS`.
        number: what `number` pushes.
        name: what `quantity` and `constant` push.
    """

    operation: str
    number: float = 0.0
    name: str = ""


@lru_cache(maxsize=256)
def parse(text: str, parameters: frozenset[str] = frozenset()) -> tuple[Step, ...]:
    """The program of a formula: operands before their operator.

    Args:
        text: the formula.
        parameters: names of more constants than `CONSTANTS` that it may read.

    Raises:
        ValueError: it is not a formula, says what of it is not allowed, and what is.
    """
    if len(text) > MAX_CHARACTERS:
        raise ValueError(f"at most {MAX_CHARACTERS} characters, this has {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        place = f" near character {error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
        raise ValueError(f"this is not a formula{place}: write for example min(0, clearance - 0.3) * speed") from None
    steps: list[Step] = []
    _translate(tree.body, steps, CONSTANTS.keys() | parameters)
    if len(steps) > MAX_OPERATIONS:
        raise ValueError(f"at most {MAX_OPERATIONS} numbers, names and operators, this has {len(steps)}")
    if (deepest := depth(steps)) > MAX_DEPTH:
        raise ValueError(f"at most {MAX_DEPTH} values may wait for one another, here it is {deepest}: nest less")
    return tuple(steps)


def depth(steps: list[Step] | tuple[Step, ...]) -> int:
    """Values that wait at the same time, at most, while a program runs."""
    waiting = deepest = 0
    for step in steps:
        waiting += 1 - operands(step.operation)
        deepest = max(deepest, waiting)
    return deepest


def operands(operation: str) -> int:
    """Values that an operation takes."""
    if operation in ("number", "quantity", "constant"):
        return 0
    if operation in FUNCTIONS:
        return FUNCTIONS[operation]
    return {"negative": 1, "if": 3}.get(operation, 2)


def _translate(node: ast.expr, steps: list[Step], constants: Set[str]) -> None:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not (math.isfinite(value) and abs(value) <= MAX_NUMBER):
                raise ValueError(f"numbers are at most {MAX_NUMBER:g}")
            steps.append(Step("number", float(value)))
        case ast.Name(id=name) if name in QUANTITIES:
            steps.append(Step("quantity", name=name))
        case ast.Name(id=name) if name in constants:
            steps.append(Step("constant", name=name))
        case ast.Name(id=name):
            known = (*QUANTITIES, *CONSTANTS, *sorted(constants - CONSTANTS.keys()))
            raise ValueError(f"there is no quantity {name!r}; there are {', '.join(known)}")
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            _translate(operand, steps, constants)
            steps.append(Step("negative"))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            _translate(operand, steps, constants)
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _BINARY:
            _translate(left, steps, constants)
            _translate(right, steps, constants)
            steps.append(Step(_BINARY[type(operator)]))
        case ast.Compare(left=left, ops=[comparison], comparators=[right]) if type(comparison) in _COMPARISONS:
            _translate(left, steps, constants)
            _translate(right, steps, constants)
            steps.append(Step(_COMPARISONS[type(comparison)]))
        case ast.IfExp(test=test, body=body, orelse=otherwise):
            for part in (test, body, otherwise):
                _translate(part, steps, constants)
            steps.append(Step("if"))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            if len(arguments) != FUNCTIONS[name]:
                raise ValueError(f"{name} takes {FUNCTIONS[name]} values, not {len(arguments)}")
            for argument in arguments:
                _translate(argument, steps, constants)
            steps.append(Step(name))
        case ast.Call(func=ast.Name(id=name)):
            raise ValueError(f"there is no function {name!r}; there are {', '.join(FUNCTIONS)}")
        case _:
            raise ValueError(
                f"{ast.unparse(node)!r} is not allowed in a formula: use + - * / **, comparisons, 'a if b else c', "
                f"and {', '.join(FUNCTIONS)}"
            )
