"""Gymnasium's interfaces to the world: one robot, many robots, their pictures and ids."""
