"""The kinds of parts that the workers know besides those of `sim.extending.parts` (pydantic only)."""

from typing import ClassVar

from sim.extending.parts import Part


class Algorithm(Part):
    """A way to learn a policy.

    Its network and the number of robots are added to its fields, as every algorithm has them.

    Attributes:
        implementation: a class or function (config, setting) to what `workers.extending.learning.Learner` offers; `config`
            is this configuration, `setting` a `workers.extending.learning.Setting`.
    """

    kind: ClassVar[str] = "algorithm"


class Network(Part):
    """A network, of policies and of critics.

    Attributes:
        implementation: a function (config, inputs, outputs) to a `torch.nn.Module` from (n, inputs.size) to (n, outputs),
            freshly initialised from torch's global generator. Its last linear layer should make the outputs. `inputs.ranges`
            says where in an observation the LiDAR's ranges lie.
    """

    kind: ClassVar[str] = "network"


class FormulaNetwork(Network):
    """A network that is said as a formula, once: PyTorch, the ONNX graph, the NumPy runner and the robot's node all run it.

    Attributes:
        implementation: a function (config, inputs, outputs) to a `workers.extending.formulas.Description`, which needs no
            torch.
    """


class RecurrentNetwork(FormulaNetwork):
    """One that remembers, for PPO: its description says how many numbers, `memory`, and how they follow, `h`.

    `sequence_length`, how far gradients go back through time, is added to its fields.
    """
