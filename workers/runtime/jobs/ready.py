"""Everything that jobs need, imported and compiled: loaded once by the nursery, which job processes are forked from."""

import numpy as np

import workers.bags.job
import workers.export.bundle
import workers.live.playing
import workers.live.viewer
import workers.replays.film
import workers.replays.record
import workers.training.evaluation  # noqa: F401 - each is needed by a job
from sim.config import TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.suites import run_suite, suite_for
from workers import onnx_runtime


def load_compiled_code() -> None:
    """Load from the caches what the first job would wait for."""
    task = TaskConfig()
    run_suite(lambda observations: np.zeros((len(observations), 2), np.float32), task, suite_for(task))
    NavigationVectorEnv(task, 1, seed=0).reset()


onnx_runtime.load()
load_compiled_code()
