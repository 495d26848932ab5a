"""The service as processes: the server on its port, and `mapless up`, which keeps it and its workers running."""
