"""The records that the compiled code and the rest of the simulator share."""

import numpy as np

from sim.kernels.room import MAX_FRAMES, MAX_PARTS, MAX_TERMS

CELL = 0.1
"""Edge of a cell of free space (`sim.arenas.freespace`), metres."""

NONE, ARRIVAL, COLLISION, TIMEOUT = 0, 1, 2, 3
"""How an attempt ended in this step; NONE while it goes on."""

PART_KINDS = (
    "ranges",
    "speeds",
    "actions",
    "distance",
    "direction",
    "bearing",
    "heading",
    "deviation",
    "trail",
    "way",
    "reach",
    "known",
    "openings",
    "dwell",
)
"""Kinds of an observation's parts, see `sim.config.ObservationPart`; a kind's place here is its number."""

(
    RANGES_PART,
    SPEEDS_PART,
    ACTIONS_PART,
    DISTANCE_PART,
    DIRECTION_PART,
    BEARING_PART,
    HEADING_PART,
    DEVIATION_PART,
    TRAIL_PART,
    WAY_PART,
    REACH_PART,
    KNOWN_PART,
    OPENINGS_PART,
    DWELL_PART,
) = range(len(PART_KINDS))

DIFFERENTIAL, OMNIDIRECTIONAL, ACKERMANN = 0, 1, 2
"""Drives, see `sim.config.AnyDrive`."""

TERM_KINDS = (
    "arrival",
    "collision",
    "timeout",
    "progress",
    "time",
    "clearance",
    "proximity",
    "alignment",
    "smoothness",
    "speed",
    "people",
    "formula",
    "path_progress",
)
"""Kinds of reward terms, see `sim.config.RewardTerm`; a kind's place here is its number."""

(
    ARRIVAL_TERM,
    COLLISION_TERM,
    TIMEOUT_TERM,
    PROGRESS_TERM,
    TIME_TERM,
    CLEARANCE_TERM,
    PROXIMITY_TERM,
    ALIGNMENT_TERM,
    SMOOTHNESS_TERM,
    SPEED_TERM,
    PEOPLE_TERM,
    FORMULA_TERM,
    PATH_PROGRESS_TERM,
) = range(len(TERM_KINDS))

QUANTITIES = (
    "range",
    "noise",
    "dropout",
    "rate",
    "distance_noise",
    "heading_noise",
    "command_delay",
    "max_linear_speed",
    "max_angular_speed",
    "field_of_view",
)
"""Columns of `Robots.drawn`: what may differ from robot to robot, see `sim.config.RandomisationConfig`."""

RANGE, NOISE, DROPOUT, RATE, DISTANCE_NOISE, HEADING_NOISE, DELAY, MAX_LINEAR, MAX_ANGULAR, FIELD_OF_VIEW = range(10)

PARAMETERS = np.dtype(
    [
        ("period", "f8"),  # s
        ("spans", "f8", (len(QUANTITIES), 2)),  # lowest and highest of what robots draw; equal where they draw nothing
        ("perceives", "i4"),  # 1 where the scan that is seen differs from the true one
        ("drifts", "i4"),  # 1 where the believed pose differs from the true one
        ("drive", "i4"),
        ("least_linear", "f4"),  # lowest fraction of the top speed: below zero where the robot reverses
        ("sideways", "f8"),  # of an omnidirectional drive, share of the top speed
        ("wheel_base", "f8"),  # m, of an Ackermann drive
        ("steering_limit", "f8"),  # rad
        ("steering_rate", "f8"),  # rad/s, 0 is unlimited
        ("max_linear_acceleration", "f8"),  # m/s², 0 is unlimited
        ("max_angular_acceleration", "f8"),  # rad/s²
        ("radius", "f4"),  # m, of a round robot
        ("half_length", "f4"),  # m, of a rectangular robot; 0 for a round one
        ("half_width", "f4"),
        ("range", "f4"),  # m, of the LiDAR
        ("field_of_view", "f8"),  # degrees, of the LiDAR that the policy believes in
        ("mounted", "i4"),  # 0 where the only LiDAR looks ahead from the body's middle
        ("lidars", "i4"),
        ("mounts", "f8", (2, 3)),  # of each x ahead and y to the left of the body's middle, m, and yaw, rad
        ("looks_ahead", "i4"),  # 1 when every field of view that is drawn is within the front half plane
        ("part_places", "i4", (len(PART_KINDS),)),  # where each kind's newest numbers begin; -1 where it is not seen
        ("part_options", "i4", (len(PART_KINDS),)),  # see `sim.observations.pack_parts`
        ("batches", "i4"),
        ("rays_per_batch", "i4"),
        ("trail_sectors", "i4"),
        ("reach_sectors", "i4"),
        ("known_sectors", "i4"),
        ("frames", "i4"),  # moments at which anything is seen
        ("parts", "i4"),  # of the observation
        ("part_sizes", "i4", (MAX_PARTS,)),  # numbers of each at one moment
        ("part_frames", "i4", (MAX_PARTS,)),
        ("part_starts", "i4", (MAX_PARTS, MAX_FRAMES)),  # where the numbers of each moment begin
        ("near", "f4"),  # m, see `sim.observations.near_distance`
        ("terms", "i4"),  # of the reward
        ("term_kinds", "i4", (MAX_TERMS,)),
        ("term_weights", "f4", (MAX_TERMS,)),
        ("term_options", "f4", (MAX_TERMS,)),  # a margin, m; of progress 1 where it is exponential
        ("tabulates", "i4"),  # 1 where a formula reads `Robots.quantities`
        ("arrival_distance", "f4"),  # m
        ("collision_distance", "f4"),  # m
        ("step_limit", "i4"),
        ("arrival_ends", "i4"),  # 1 where an arrival ends the episode, 0 where it brings the next target
        ("starts_anew", "i4"),  # 1 where the next episode begins in the step that ended one, 0 where a call begins it
        ("spawn_clearance", "f4"),  # m
        ("min_target_distance", "f4"),  # m, of a new target from its robot
        ("path_samples", "i4"),  # points of a step at which the body is checked
        ("replica_stride", "i4"),  # tiles between one replica of the pool and the next
        ("closing", "f4"),  # m that a robot and a mover may come nearer in one step
        ("together", "i4"),  # robots of a group, one after another, that see one another; 1 where each is alone
        ("body", "f4"),  # m, radius of the disc that the others of a group take a robot for
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
        ("angular", "f4"),  # of an Ackermann drive the steering angle
        ("last_linear", "f4"),  # those of the step before
        ("last_angular", "f4"),
        ("lateral", "f4"),  # likewise, of an omnidirectional drive
        ("last_lateral", "f4"),
        ("parked", "i4"),  # 1 when the robot neither senses nor acts any more
    ],
    align=True,
)
"""What the simulator remembers of a robot besides pose and target."""

PATROL, WALKER, PEDESTRIAN, TIMED = 0, 1, 2, 3
"""Kinds of movers, see `sim.arenas.mover.Kind`."""

MOVER = np.dtype(
    [
        ("random", "u8"),  # state of the mover's own generator
        ("x", "f8"),  # m, in the arena's frame: independent of where the tile is, to the last bit
        ("y", "f8"),
        ("vx", "f8"),  # m/s, kept until the next decision
        ("vy", "f8"),
        ("goal_x", "f8"),  # m, where it goes; a walker's direction
        ("goal_y", "f8"),
        ("other_x", "f8"),  # m, other end of a patrol's line
        ("other_y", "f8"),
        ("patience", "f8"),  # s, until it gives up what it is about
        ("radius", "f8"),  # m
        ("speed", "f8"),  # m/s, top
        ("kind", "i4"),
        ("first_waypoint", "i4"),  # of a patrol's round or a timed way, and how many it has
        ("waypoints", "i4"),
        ("waypoint", "i4"),  # the next one, counted from the first; of a timed way the last one
        ("way", "i4"),  # 1, or -1 where it goes round backwards; 0 where a timed way ends at its end
        ("present", "i4"),  # 0 where the arena had no room for it
    ],
    align=True,
)
"""What the simulator remembers of a mover."""

DISC_COLUMNS = 5
"""x, y, radius, and how far it came in the last step in x and y; a radius below zero is an empty slot."""

CIRCLE_COLUMNS = 3
"""x, y, radius; a radius below zero is an empty slot."""

BOX_COLUMNS = 6
"""x, y, half length, half width, cos, sin; a half length below zero is an empty slot."""
