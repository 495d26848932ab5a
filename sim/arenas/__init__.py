"""Places to drive in: geometry in NumPy, without physics, so that the server and the live view can draw them."""

from sim.arenas.build import arena_clearance, build_arena, build_arenas, build_task_arenas, with_maps_of
from sim.arenas.geometry import Arena, free_distance
from sim.arenas.mover import Mover

__all__ = [
    "Arena",
    "Mover",
    "arena_clearance",
    "build_arena",
    "build_arenas",
    "build_task_arenas",
    "free_distance",
    "with_maps_of",
]
