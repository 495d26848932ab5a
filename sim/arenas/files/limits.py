"""How large a file may be before it is not even looked at, each number with its reason."""

MAX_TEXT_BYTES = 1 * 2**20
"""Of a YAML file: 2,000 obstacles take 150 kB."""

MAX_SDF_BYTES = 8 * 2**20
"""Of a Gazebo world: Gazebo spends 2 to 3 kB on a cylinder, so a world of 2,000 fits."""

MAX_IMAGE_BYTES = 16 * 2**20
"""Of a map's image."""

MAX_IMAGE_CELLS = 4_000_000
"""Pixels of a map's image: 2000 x 2000, 100 x 100 m at 5 cm."""

MAX_DEPTH = 40
"""How deep YAML and XML may be nested; an honest file needs ten levels."""

MAX_EVENTS = 200_000
"""YAML scalars, lists and mappings of a file."""

MAX_XML_EVENTS = 800_000
"""Beginnings and ends of a world's elements; Gazebo spends about 140 on a cylinder and its state."""

RESOLUTIONS = (0.005, 1.0)
"""Metres per pixel of a map."""
