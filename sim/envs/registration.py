"""Gymnasium's ids for the environments, which `import sim` registers; what is behind them is imported when it is made.

>>> import gymnasium, sim
>>> gymnasium.register_envs(sim)  # says what the import is for
>>> env = gymnasium.make("Mapless/Navigation-v0", task={"arena": {"name": "complex"}})
>>> envs = gymnasium.make_vec("Mapless/Navigation-v0", num_envs=64)
"""

import gymnasium

NAVIGATION = "Mapless/Navigation-v0"
POINT_GOAL = "Mapless/PointGoal-v0"

gymnasium.register(
    id=NAVIGATION,
    entry_point="sim.envs.single:NavigationEnv",
    vector_entry_point="sim.envs.vector:NavigationVectorEnv",
    disable_env_checker=True,  # it would run on every make; the tests run it once
)
gymnasium.register(
    id=POINT_GOAL,
    entry_point="sim.envs.point_goal:PointGoalEnv",
    vector_entry_point="sim.envs.point_goal:PointGoalVectorEnv",
    max_episode_steps=500,
    disable_env_checker=True,
)
