"""The service: API, database, scheduling of runs, live view, statistics."""
