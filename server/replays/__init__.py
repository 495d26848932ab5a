"""Replays: any episode of an evaluation in 3D, to play, seek and take away."""
