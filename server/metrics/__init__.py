"""Curves: stored as they come, compacted, read at the width of a screen."""
