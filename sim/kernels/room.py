"""How much of something one task may have: what configurations allow, and what records have room for (no imports)."""

MAX_PARTS = 16
"""Parts of one observation, at most."""

MAX_FRAMES = 8
"""Moments at which a part is seen, at most."""

MAX_TERMS = 16
"""Terms of one reward, at most."""

SHORT_TRAIL_KINDS, LONG_TRAIL_KINDS = 3, 4
"""Numbers of each sector in which a trail is seen, by how much of it is remembered."""

SHORT_TRAIL_ROOM, LONG_TRAIL_ROOM = 256, 1024
"""Crumbs that a robot remembers, the newest ones: on some 60 m and on some 250 m of its way."""

VIEW_ROOM = 256
"""Views that a robot remembers, the newest ones: on some 120 m of its way."""

OPENING_ROOM = 64
"""Openings that a robot remembers, the newest ones."""

OPENING_KINDS = 6
"""Numbers of each opening that a robot is told."""

MAX_LEADS = 3
"""Openings that a robot is told, at most."""

DETOUR = 4.0
"""Metres that a way is taken to be longer for each wall that a view shows between an opening and the target, and where a
view shows the target and the body can't go straight on to it."""

THROUGH_GAP, ROUND_A_BEND, STRAIGHT_ON = 0, 1, 2
"""How the body gets from a view to its opening: through a gap that it does not fit through, or not straight on."""

FARTHER = (8.0, 1.0, 0.0)
"""Metres that an opening is taken to be farther, by how the body gets there."""

GAP_ROOM = 64
"""Gaps that a robot does not fit through that it remembers, the newest ones."""

AWAY = 0.48
"""Metres from where a robot began to stay at which it stays no longer."""

LONG_STAY = 4.0
"""Seconds on one spot that a robot is told as one half."""

LINK_ROOM = 8
"""Earlier views that a view is linked to, at most."""

SHORT_OF = 0.2
"""Metres by which the end of a sight lies before what its ray meets; where that is nearer, half way there."""

REACH_DIRECTIONS = 4
"""Of each sector of the reach, of which the farthest is told: a narrow gap beside its middle is not missed."""
