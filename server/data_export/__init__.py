"""What leaves for other tools: the data of runs, of experiments and of comparisons, streamed."""
