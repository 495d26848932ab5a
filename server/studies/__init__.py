"""Studies: trainings over ranges of settings, one after another where the ones before did best."""
