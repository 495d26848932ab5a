"""A lab's load on one server: reporting runs, open pages, watched runs: `python -m benchmarks.load`."""
