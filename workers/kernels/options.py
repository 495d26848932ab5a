"""How the learners' kernels are compiled."""

from pathlib import Path

from sim.kernels.options import kernels_in

kernel = kernels_in(Path(__file__).parent)
