"""What workers may do: claim a run, report on it over its link, bring and fetch checkpoints."""
