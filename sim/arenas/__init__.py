"""Places to drive in: geometry in NumPy, without physics, so that the server and the live view can draw them."""

from sim.arenas.build import build_arena, build_arenas
from sim.arenas.geometry import Arena, free_distance

__all__ = ["Arena", "build_arena", "build_arenas", "free_distance"]
