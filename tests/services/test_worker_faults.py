"""Whatever a worker's disk does to what a training reports, the run comes to the same end as if nothing had happened."""

import signal
from pathlib import Path

import httpx
import numpy as np

from tests.services.stack import ROLLOUT, Service, assert_one_unbroken_curve, until
from tests.services.test_lifecycle import until_checkpoint
from workers.checkpoints import read_checkpoint

STEPS, SAVE_EVERY = 24 * ROLLOUT, 4 * ROLLOUT


def final_state(service: Service, run_id: str, directory: Path) -> dict[str, bytes]:
    """Weights, optimiser, random states and environment of the run's last checkpoint."""
    last = service.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"][0]
    assert last["step"] == STEPS
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
    (disturbed,) = service.launch(STEPS, save_every=SAVE_EVERY)
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

    (undisturbed,) = service.launch(STEPS, save_every=SAVE_EVERY)
    service.until_state(undisturbed, "completed")
    assert final_state(service, disturbed, tmp_path) == final_state(service, undisturbed, tmp_path)
