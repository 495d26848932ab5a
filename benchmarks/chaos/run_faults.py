"""Faults of one run: its trainer, its worker, the way to the server, the spool, the disk, the checkpoint it resumes from."""

import re
import time
from collections.abc import Callable
from functools import partial

from benchmarks.chaos.kinds import Heal, Kind, MissedError, Scene
from benchmarks.chaos.proxy import Trap
from benchmarks.processes import kill, resume, suspend
from benchmarks.service import wait_for

# For what comes by itself as long as the run goes on: a report, an upload.
_MOMENT_SECONDS = 10.0
# A disk that is full for so long at least, in seconds, and a server that is not reached.
_FULL_SECONDS = 3.0
_AWAY_SECONDS = 2.0
# A trainer that stands still for so long.
_STILL_SECONDS = 2.0


def _kill_trainer(scene: Scene) -> None:
    trainer = scene.node.trainer()
    if trainer is None:
        raise MissedError
    kill([trainer])


def _kill_nursery(scene: Scene) -> None:
    nursery = scene.node.nursery()
    if nursery is None or scene.node.trainer() is None:
        raise MissedError
    kill([nursery])


def _stop_trainer(scene: Scene) -> None:
    trainer = scene.node.trainer()
    if trainer is None:
        raise MissedError
    suspend([trainer])
    time.sleep(_STILL_SECONDS)
    resume([trainer])


def _kill_worker(scene: Scene) -> None:
    scene.node.kill()
    scene.node.start()


def _kill_child(scene: Scene) -> None:
    child = scene.node.child()
    if child is None:
        raise MissedError
    kill([child])


def _stop_worker(scene: Scene) -> Heal:
    frozen = scene.node.members()
    suspend(frozen)
    return partial(resume, frozen)


def _restart_worker(scene: Scene) -> None:
    scene.node.stop()
    scene.node.start()


def _cut_link(scene: Scene) -> None:
    scene.node.proxy.cut()


def _refuse_link(scene: Scene) -> None:
    scene.node.proxy.refuse()
    time.sleep(_AWAY_SECONDS)
    scene.node.proxy.open()


def _silence_link(scene: Scene) -> Heal:
    scene.node.proxy.silence()
    return scene.node.proxy.open


def _cut_upload(scene: Scene) -> None:
    trap = Trap(b"/checkpoints/", lose="request")
    scene.node.proxy.set_trap(trap)
    sprung = trap.sprung.wait(_MOMENT_SECONDS)
    scene.node.proxy.set_trap(None)
    if not sprung:
        raise MissedError


def _lose_upload_answer(scene: Scene) -> None:
    trap = Trap(b"PUT /api/worker/runs/", lose="answer")
    scene.node.proxy.set_trap(trap)
    sprung = trap.sprung.wait(_MOMENT_SECONDS)
    scene.node.proxy.set_trap(None)
    if not sprung:
        raise MissedError


def _lose_claim_answer(scene: Scene) -> None:
    """Whoever claims first after the trainer's death is given the run and does not hear of it."""
    trap = Trap(f"/api/worker/runs/{scene.run_id}/claim".encode(), lose="answer")
    proxies = [node.proxy for node in scene.stack.nodes]
    for proxy in proxies:
        proxy.set_trap(trap)
    try:
        _kill_trainer(scene)
        if not trap.sprung.wait(_MOMENT_SECONDS + scene.stack.lease_seconds):
            raise MissedError
    finally:
        for proxy in proxies:
            proxy.set_trap(None)


def _zero(line: bytes) -> bytes:
    third = len(line) // 3
    return line[:third] + bytes(third) + line[2 * third :]


def _alter(line: bytes) -> bytes:
    """Another digit at the end of the last number: it still parses."""
    digit = re.search(rb"\d(?=\D*$)", line)
    assert digit is not None
    at = digit.start()
    return line[:at] + (b"1" if line[at : at + 1] != b"1" else b"2") + line[at + 1 :]


def _tear(line: bytes) -> bytes:
    """The next line is written where this one ends."""
    return line[: len(line) // 2]


def _damage_spool(scene: Scene, damage: Callable[[bytes], bytes]) -> None:
    """While the server is not reached, so that what is damaged has not been read yet."""
    spool = scene.node.spool(scene.run_id)
    if spool is None:
        raise MissedError
    scene.node.proxy.refuse()
    try:
        time.sleep(0.2)  # what was under way is there, or lost
        size = spool.stat().st_size
        wait_for(lambda: spool.read_bytes().count(b"\n", size) >= 2, seconds=_MOMENT_SECONDS)
        scene.stack.recorder.keep(spool)
        line = spool.read_bytes()[size:].splitlines(keepends=True)[0]
        damaged = damage(line)
        with spool.open("r+b") as file:
            file.seek(size)
            file.write(damaged)
            if len(damaged) < len(line):
                file.truncate()
    except (OSError, TimeoutError) as error:
        raise MissedError from error
    finally:
        scene.node.proxy.open()


def _fill_worker_disk(scene: Scene) -> Heal:
    """It stays full until the run goes on elsewhere: this worker must not take it up again and again."""
    scene.node.disk.fill()
    time.sleep(_FULL_SECONDS)
    return scene.node.disk.free


def _damage_checkpoint(scene: Scene) -> None:
    """The newest archive is damaged where it is kept, and the trainer dies, so that it is asked for."""
    trainer = scene.node.trainer()
    if trainer is None:
        raise MissedError
    suspend([trainer])
    time.sleep(0.5)  # what is on its way arrives
    checkpoints = scene.stack.api.get(f"/api/runs/{scene.run_id}/checkpoints").json()["items"]
    newest = max(checkpoints, key=lambda checkpoint: checkpoint["step"], default=None)
    archive = scene.stack.data / "checkpoints" / f"{newest['id']}.zip" if newest else None
    if newest is None or archive is None or not archive.exists() or len(checkpoints) < 2:
        resume([trainer])
        raise MissedError
    scene.damaged.add(newest["id"])
    size = archive.stat().st_size
    match scene.dice.choice(("overwritten", "truncated", "removed")):
        case "overwritten":
            with archive.open("r+b") as file:
                file.seek(size // 2)
                file.write(b"\xa5" * 64)
        case "truncated":
            with archive.open("r+b") as file:
                file.truncate(size // 2)
        case "removed":
            archive.unlink()
    kill([trainer])


def _set_clock_back(scene: Scene) -> None:
    scene.stack.clock.shift(-3600.0)
    _kill_worker(scene)


def _set_clock_forward(scene: Scene) -> None:
    scene.stack.clock.shift(3600.0)
    _kill_worker(scene)


RUN_FAULTS = (
    Kind("trainer killed", "SIGKILL to the process that trains", _kill_trainer, "run", "closed", True),
    Kind("nursery killed", "SIGKILL to the process that trainers are forked from", _kill_nursery, "run", "closed", True),
    Kind("trainer stopped", f"SIGSTOP, SIGCONT {_STILL_SECONDS:g} s later", _stop_trainer, "run", "closed"),
    Kind("worker killed", "SIGKILL to a worker and all its processes", _kill_worker, "run", "silent", new_attempt=True),
    Kind(
        "slot killed", "SIGKILL to the process that looks after an attempt", _kill_child, "run", "silent", new_attempt=True
    ),
    Kind("worker stopped", "SIGSTOP to all its processes until another has its run", _stop_worker, "run", "silent", True),
    Kind("worker restarted", "SIGTERM, and started anew", _restart_worker, "run", "closed", True),
    Kind("link cut", "every connection of a worker to the server closed", _cut_link, "run", "closed"),
    Kind("link refused", f"the server not reached for {_AWAY_SECONDS:g} s", _refuse_link, "run", "closed"),
    Kind("link silent", "nothing carried until another worker has its run", _silence_link, "run", "silent", True),
    Kind("upload cut", "the connection closed in the middle of a checkpoint", _cut_upload, "run", "closed"),
    Kind("upload's answer lost", "a checkpoint is taken and its worker not told", _lose_upload_answer, "run", "closed"),
    Kind("claim's answer lost", "a run is given away and its worker not told", _lose_claim_answer, "run", "silent", True),
    Kind(
        "spool overwritten",
        "a line that waits becomes zeros in part",
        partial(_damage_spool, damage=_zero),
        "run",
        "closed",
        new_attempt=True,
    ),
    Kind("spool altered", "one digit of a line that waits", partial(_damage_spool, damage=_alter), "run", "closed", True),
    Kind(
        "spool truncated",
        "cut in the middle of a line that waits",
        partial(_damage_spool, damage=_tear),
        "run",
        "closed",
        new_attempt=True,
    ),
    Kind("worker's disk full", "no byte left until another worker has its run", _fill_worker_disk, "run", "closed"),
    Kind("checkpoint damaged", "the newest archive, then its trainer killed", _damage_checkpoint, "run", "closed", True),
    Kind("clock set back", "the server's, by an hour, and a worker killed", _set_clock_back, "run", "silent", True),
    Kind("clock set forward", "the server's, by an hour, and a worker killed", _set_clock_forward, "run", "silent", True),
)
"""Every kind that hits one run."""
