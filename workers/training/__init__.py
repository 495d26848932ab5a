"""A training: the loop, what it measures of itself, and its evaluations."""
