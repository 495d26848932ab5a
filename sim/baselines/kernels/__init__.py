"""The inner loops of the baselines, compiled; they share nothing with the simulator's kernels but how they are compiled."""

from pathlib import Path

from sim.kernels.options import kernels_in

kernel = kernels_in(Path(__file__).parent)
