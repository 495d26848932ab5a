"""Arenas drawn from a seed: nine families, each with a difficulty between 0 and 1."""

from sim.arenas.families.generate import CLEARANCE, FAMILIES, SUITE_SEEDS, generate_arena, pool_seeds

__all__ = ["CLEARANCE", "FAMILIES", "SUITE_SEEDS", "generate_arena", "pool_seeds"]
