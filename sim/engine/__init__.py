"""Robots in arenas, stepped: physics, movers, what a step is worth; `sim.envs` gives it Gymnasium's interfaces."""
