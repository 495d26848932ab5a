"""What every page costs with a lab's worth of trainings behind it: `python -m benchmarks.dashboard`."""
