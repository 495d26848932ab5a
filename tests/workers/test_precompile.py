"""What `make` compiles is all that any training needs: none waits for the compiler."""

import subprocess
import sys

_LOOK = """
import gc

import numpy as np
from numba.core.dispatcher import Dispatcher

import sim.precompile
import workers.precompile
from sim.actions import action_layout
from sim.config import RacecarConfig, RidgebackConfig, TaskConfig
from sim.envs.vector import NavigationVectorEnv
from workers.presets import PRESETS
from workers.shipped.recipes import RECIPES


def compiled():
    return {
        (kernel.py_func.__qualname__, signature)
        for kernel in gc.get_objects()
        if isinstance(kernel, Dispatcher)
        for signature in kernel.signatures
    }


sim.precompile.main()
workers.precompile.update_all()
workers.precompile.warm_up()
before = compiled()
trainings = [each.training for each in (*RECIPES, *PRESETS)]
asked = [(each.task, getattr(each.algorithm, "critic_sees", "") == "path") for each in trainings]
asked += [(TaskConfig(robot=robot), False) for robot in (RacecarConfig(), RidgebackConfig())]
asked += [(TaskConfig(together=3), False)]
for task, guides in asked:
    if hasattr(task.arena, "maps"):
        task = task.model_copy(update={"arena": task.arena.model_copy(update={"maps": 3})})
    env = NavigationVectorEnv(task, 8, seed=0, guides=guides)
    env.reset()
    for _ in range(30):
        env.step(np.ones((8, action_layout(task.robot).size), np.float32))
late = compiled() - before
assert not late, sorted({name for name, _ in late})
"""


def test_no_training_waits_for_the_compiler() -> None:
    """In a process of its own: here other tests have compiled what they needed."""
    subprocess.run([sys.executable, "-c", _LOOK], check=True, timeout=300)
