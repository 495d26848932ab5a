"""Arenas from files: our own YAML, ROS maps, Gazebo worlds. Whatever is wrong with a file is said, and harms nothing."""

from sim.arenas.document import check_free_space, to_arena, to_document
from sim.arenas.files.own_yaml import write_own
from sim.arenas.files.read import load_arena, read_arena

__all__ = ["check_free_space", "load_arena", "read_arena", "to_arena", "to_document", "write_own"]
