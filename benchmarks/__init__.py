"""Measurements: each script is run as `python -m benchmarks.<name>` and ends with one line of JSON."""
