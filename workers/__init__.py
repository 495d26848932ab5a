"""The learning: networks, algorithms, training, evaluation, checkpoints, and the processes that run them."""
