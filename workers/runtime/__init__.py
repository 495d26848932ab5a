"""What a worker process does: waits for the doorbell, claims a run, keeps its trainer, and reports over the link."""
