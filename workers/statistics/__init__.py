"""How sure a measured number is: the one implementation for commands, pages, the reproduction and benchmarks.

SciPy is imported where a quantile is asked for and not before: it takes a third of a second, which neither `--help` nor
the server's start has to wait for.
"""
