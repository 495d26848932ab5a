"""What a worker does beside trainings: views, replays, exports and evaluations, each in a process that is warm already."""
