"""Episodes of an evaluation, driven once more to be looked at."""
