"""Leaderboards: everything that was measured on a suite, side by side."""
