"""What an extension declares algorithms and networks with; needs nothing but pydantic; versioned with `sim.extending`.

>>> from typing import Literal
>>> from sim.extending import Extension, Field
>>> class ReinforceConfig(Algorithm):
...     '''REINFORCE with a baseline (Williams 1992).'''
...     name: Literal["my_lab.reinforce"] = Field("my_lab.reinforce", title="REINFORCE")
...     learning_rate: float = Field(3e-3, gt=0.0, le=0.1, title="Learning rate")
...     implementation = "my_lab.learning:Reinforce"
>>> extension = Extension(name="my_lab", version="1.0", api=1, parts=(ReinforceConfig,))

What it may learn with stands in `workers.extending.learning`, what a network is said with that is a formula in
`workers.extending.formulas`.
"""

from workers.extending.parts import Algorithm, FormulaNetwork, Network, RecurrentNetwork

__all__ = ["Algorithm", "FormulaNetwork", "Network", "RecurrentNetwork"]
