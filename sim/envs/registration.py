"""Gymnasium's ids for the environments; importing this module registers them.

>>> import gymnasium, sim.envs.registration
>>> env = gymnasium.make("Mapless/Navigation-v0", task={"arena": {"name": "complex"}})
>>> envs = gymnasium.make_vec("Mapless/Navigation-v0", num_envs=64)
"""

import gymnasium

NAVIGATION = "Mapless/Navigation-v0"

gymnasium.register(
    id=NAVIGATION,
    entry_point="sim.envs.single:NavigationEnv",
    vector_entry_point="sim.envs.vector:NavigationVectorEnv",
    disable_env_checker=True,  # it would run on every make; the tests run it once
)
