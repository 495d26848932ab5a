"""What a worker does beside trainings: views, replays, films, recordings, exports, evaluations, each in a warm process."""
