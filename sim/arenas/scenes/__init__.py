"""Scenes among people, each with a start and a target of its own."""

from sim.arenas.scenes.draft import Scene
from sim.arenas.scenes.generate import SCENES, SceneName, generate_scene, training_scene

__all__ = ["SCENES", "Scene", "SceneName", "generate_scene", "training_scene"]
