"""Numbers that compiled and plain code share; they stand here, so that what was compiled is never older than they are."""

LEAKY_SLOPE = 0.01
"""Of LeakyReLU below zero."""
