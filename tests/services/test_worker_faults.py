"""What befalls a worker and its machine: damaged disks, machines that are taken away, and work that comes to an end."""

import signal
import time
from pathlib import Path

import httpx
import numpy as np

from tests.services.stack import PATIENCE, ROLLOUT, Service, assert_one_unbroken_curve, tree, until
from tests.services.test_lifecycle import ENDLESS, until_checkpoint, until_resumed
from workers.checkpoints import read_checkpoint

STEPS, SAVE_EVERY = 24 * ROLLOUT, 4 * ROLLOUT
# Enough for its disk to be damaged in mid-training, however late this process gets its turn.
MANY_STEPS = 4 * STEPS


def final_state(service: Service, run_id: str, directory: Path) -> dict[str, bytes]:
    """Weights, optimiser, random states and environment of the run's last checkpoint."""
    last = service.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"][0]
    assert last["step"] == MANY_STEPS
    path = directory / f"{run_id}.zip"
    response: httpx.Response = service.api.get(f"/api/checkpoints/{last['id']}/download")
    path.write_bytes(response.raise_for_status().content)
    checkpoint = read_checkpoint(path)
    return {name: np.asarray(array).tobytes() for name, array in {**checkpoint.arrays, **checkpoint.weights}.items()}


def alter_what_waits(spool: Path) -> bool:
    """Change one digit of the last whole line; False while there is none that the server does not have."""
    lines = spool.read_bytes().splitlines(keepends=True)
    if len(lines) < 3 or not lines[-2].endswith(b"\n"):
        return False
    place = sum(map(len, lines[:-2])) + lines[-2].index(b'"step":') + len(b'"step":')
    with spool.open("r+b") as file:
        file.seek(place)
        digit = file.read(1)
        file.seek(place)
        file.write(b"1" if digit != b"1" else b"2")
    return True


def test_a_damaged_spool_line_rewinds_the_run_which_ends_bit_for_bit_as_an_undisturbed_one(
    service: Service, tmp_path: Path
) -> None:
    server = service.start_server()
    service.start_worker()
    (disturbed,) = service.launch(MANY_STEPS, save_every=SAVE_EVERY)
    until_checkpoint(service, disturbed)
    (spool,) = (tmp_path / "work").glob("*/spool.jsonl")
    # The server stands still, so that what is reported now waits on the worker's disk.
    before = spool.stat().st_size
    server.send_signal(signal.SIGSTOP)
    try:
        until(lambda: spool.stat().st_size > before + 2_000 and alter_what_waits(spool))
    finally:
        server.send_signal(signal.SIGCONT)
    completed = service.until_state(disturbed, "completed")
    assert completed["attempt"] == 2
    assert any("cannot be read back" in message for message in service.events(disturbed))
    assert_one_unbroken_curve(service, disturbed)

    (undisturbed,) = service.launch(MANY_STEPS, save_every=SAVE_EVERY)
    service.until_state(undisturbed, "completed")
    assert final_state(service, disturbed, tmp_path) == final_state(service, undisturbed, tmp_path)


def test_a_machine_that_is_taken_away_hands_its_run_back_with_a_checkpoint_within_ten_seconds(service: Service) -> None:
    """As a cloud or a batch system does it: SIGTERM to every process of the job at once."""
    service.start_server()
    worker = service.start_worker()
    (run_id,) = service.launch(ENDLESS)
    until_checkpoint(service, run_id)
    saved = max(service.checkpoints(run_id))
    started = time.monotonic()
    for process in tree(worker.pid):
        process.send_signal(signal.SIGTERM)
    assert worker.wait(10) == 0
    handed_back = service.run(run_id)
    assert time.monotonic() - started < 10
    assert handed_back["state"] == "queued"
    assert handed_back["step"] > saved
    assert service.checkpoints(run_id)[-1] == handed_back["step"] == service.steps(run_id)[-1]
    assert any("handed the run back" in message for message in service.events(run_id))
    # Another machine goes on from there.
    service.start_worker("another")
    assert until_resumed(service, run_id, attempt=2) == handed_back["step"]
    service.stop(run_id)
    assert_one_unbroken_curve(service, run_id)


def test_a_drained_worker_finishes_its_run_and_takes_no_more(service: Service) -> None:
    service.start_server()
    worker = service.start_worker()
    (first,) = service.launch(STEPS)
    until(lambda: service.run(first)["state"] == "running")
    (second,) = service.launch(STEPS)
    (name,) = [entry["name"] for entry in service.api.get("/api/status").json()["workers"]]
    service.api.post("/api/workers/drain", json={"worker": name}).raise_for_status()
    assert worker.wait(PATIENCE) == 0
    assert service.run(first)["state"] == "completed"
    assert (service.run(second)["state"], service.run(second)["attempt"]) == ("queued", 0)


def test_a_worker_of_a_batch_job_ends_when_there_was_nothing_to_do_for_a_while(service: Service) -> None:
    service.environment["MAPLESS_UNTIL_IDLE_SECONDS"] = "6"
    service.start_server()
    (run_id,) = service.launch(STEPS)
    worker = service.start_worker()
    assert worker.wait(PATIENCE) == 0
    assert service.run(run_id)["state"] == "completed"
