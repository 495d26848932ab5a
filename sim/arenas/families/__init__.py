"""Arenas drawn from a seed: ten families and two benchmarks, each with a difficulty between 0 and 1."""

from sim.arenas.families.generate import BENCHMARKS, CLEARANCE, FAMILIES, SUITE_SEEDS, generate_arena, pool_seeds

__all__ = ["BENCHMARKS", "CLEARANCE", "FAMILIES", "SUITE_SEEDS", "generate_arena", "pool_seeds"]
