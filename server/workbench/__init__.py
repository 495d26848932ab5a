"""Many trainings in order: found by any setting or figure, sorted, grouped, tagged, put away."""
