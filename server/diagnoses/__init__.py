"""Is it learning? A run's diagnoses."""
