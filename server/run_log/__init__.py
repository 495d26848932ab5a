"""What a run's trainer printed and what happened to it, in one stream."""
