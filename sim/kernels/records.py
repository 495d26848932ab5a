"""The records that the compiled code and the rest of the simulator share."""

import numpy as np

NONE, ARRIVAL, COLLISION, TIMEOUT = 0, 1, 2, 3
"""How an attempt ended in this step; NONE while it goes on."""

PAPER, IMPROVED = 0, 1
"""Observation layouts, see `sim.observations`."""

BASIC, CLEARANCE, ALIGNMENT = 0, 1, 2
"""Rewards, see `sim.config.RewardConfig`."""

PARAMETERS = np.dtype(
    [
        ("period", "f8"),  # s
        ("max_linear", "f8"),  # m/s
        ("max_angular", "f8"),  # rad/s
        ("linear_change", "f4"),  # largest change of a velocity in one step, as a fraction of its limit
        ("angular_change", "f4"),
        ("radius", "f4"),  # m, of the robot
        ("range", "f4"),  # m, of the LiDAR
        ("noise", "f4"),  # m, standard deviation of a range
        ("dropout", "f4"),  # probability that a ray sees nothing
        ("looks_ahead", "i4"),  # 1 when the field of view is within the front half plane
        ("batches", "i4"),
        ("rays_per_batch", "i4"),
        ("observation", "i4"),
        ("near", "f4"),  # m, see `sim.observations.near_distance`
        ("reward", "i4"),
        ("arrival_reward", "f4"),
        ("collision_reward", "f4"),
        ("progress", "f4"),  # reward per metre
        ("penalty", "f4"),  # reward, the advanced ones' c_p
        ("ahead_first", "i4"),  # rays whose minimum is the free distance ahead: first, and one past the last
        ("ahead_last", "i4"),
        ("arrival_distance", "f4"),  # m
        ("collision_distance", "f4"),  # m
        ("step_limit", "i4"),
        ("spawn_clearance", "f4"),  # m
        ("path_samples", "i4"),  # points of a step at which the body is checked
        ("replica_stride", "i4"),  # tiles between one replica of the pool and the next
    ],
    align=True,
)
"""One task, flat: the scalar arguments of the kernels."""

ROBOT = np.dtype(
    [
        ("random", "u8"),  # state of the robot's own generator
        ("attempt_reward", "f8"),
        ("path_length", "f8"),  # m
        ("map", "i4"),  # index into the arenas
        ("replica", "i4"),  # which copy of the arenas the robot lives in
        ("steps", "i4"),  # of this attempt
        ("distance", "f4"),  # m, to the target
        ("min_clearance", "f4"),  # m, body to anything else, smallest of this attempt
        ("linear", "f4"),  # velocities of the last step, as fractions of the limits
        ("angular", "f4"),
        ("parked", "i4"),  # 1 when the robot neither senses nor acts any more
    ],
    align=True,
)
"""What the simulator remembers of a robot besides pose and target."""

CIRCLE_COLUMNS = 3
"""x, y, radius; a radius below zero is an empty slot."""

BOX_COLUMNS = 6
"""x, y, half length, half width, cos, sin; a half length below zero is an empty slot."""
