"""What a trainer prints reaches the run's log, also that of a worker that is killed."""

import os
import signal
from pathlib import Path

from tests.services.stack import ROLLOUT, Service, trainers, until

# Loaded by every Python process of the worker, as `sitecustomize` is: trainers print, as libraries do.
_PRINTS = """
import os, sys, threading
if any("nursery_process" in part for part in sys.orig_argv):
    def tell():
        print("printed by the trainer", flush=True)
        print("complained by the trainer", file=sys.stderr, flush=True)
        again = threading.Timer(0.5, tell)
        again.daemon = True
        again.start()
    os.register_at_fork(after_in_child=tell)
"""


def lines(service: Service, run_id: str) -> list[str]:
    return [line["text"] for line in service.api.get(f"/api/runs/{run_id}/log").json()["lines"] if line["kind"] == "output"]


def test_a_killed_worker_leaves_what_it_had_sent(service: Service, tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(_PRINTS)
    service.environment["PYTHONPATH"] = str(tmp_path / "site")
    service.start_server()
    worker = service.start_worker("a")
    run_id = service.launch(10_000 * ROLLOUT)[0]

    until(lambda: len(lines(service, run_id)) >= 4)
    for process in trainers(worker.pid):
        process.kill()
    os.killpg(worker.pid, signal.SIGKILL)
    worker.wait()
    service.until_state(run_id, "queued")

    kept = lines(service, run_id)
    assert set(kept) == {"printed by the trainer", "complained by the trainer"}
    text = service.api.get(f"/api/runs/{run_id}/log/text").text
    assert text.count("[attempt 1] printed by the trainer") == kept.count("printed by the trainer")
    assert "was lost" in text
    service.api.post(f"/api/runs/{run_id}/stop").raise_for_status()
    assert lines(service, run_id) == kept
