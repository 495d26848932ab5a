"""Recordings of robots (bags) that people upload: kept, read by a worker, held beside a policy."""
