"""Suites of one's own: arenas of the gallery that bring a start and a target, measured on like those that are built in."""
