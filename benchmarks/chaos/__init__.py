"""Faults injected into a whole service that trains, and the proof that nothing is lost: `python -m benchmarks.chaos`."""
