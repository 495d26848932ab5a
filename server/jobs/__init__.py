"""Jobs: what people ask for beside trainings, done by workers. Views, replays, films, exports, evaluations."""
