"""Drives a playground in the process of its job: frames thirty times a second, what it sees coming about once a second."""

import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Protocol

from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from workers.checkpoints import read_policy
from workers.job_protocol import JobOrders, PlayJob, UploadedPolicy
from workers.live.playground import Playground
from workers.live.viewer import FRAME_RATE
from workers.manifest import USUAL_GAMMA
from workers.onnx_policy import OnnxPolicy
from workers.play_protocol import PlaySeen

# Seconds between two looks ahead, which take up to a tenth of one, and how soon one follows a change.
_SEEN_SECONDS = 1.0
_SOON_SECONDS = 0.3
# This far behind, it gives up catching up.
_TOO_LATE = 0.25


class Audience(Protocol):
    """Who hears of a playground."""

    def frame(self, frame: bytes) -> None:
        """An encoded `workers.frames.Frame`."""

    def seen(self, seen: PlaySeen) -> None:
        """What is about to happen."""


def open_playground(archive: Path, job: PlayJob) -> Playground:
    """The playground of a job.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        ForeignPolicyError: an uploaded one can't be run, or is for another robot.
        ArenaError: the robot has no room in the arena.
    """
    policy: PolicyFunction
    if isinstance(job.policy, UploadedPolicy):
        task = job.policy.task or TaskConfig()
        policy, gamma, step = OnnxPolicy(archive.read_bytes(), task), USUAL_GAMMA, 0
    else:
        manifest, policy = read_policy(archive)
        task, gamma, step = manifest.training.task, manifest.gamma, manifest.step
    return Playground(policy, task, job.arena, gamma, step)


def play(ground: Playground, orders: "Connection[Any, JobOrders]", audience: Audience) -> None:
    """Drive until nobody is left to say what to do; time stands still while nobody looks.

    Args:
        ground: where.
        orders: from the server.
        audience: who hears of it.
    """
    watched = False
    due = seen_due = time.monotonic()
    seen_at = float("-inf")
    try:
        while True:
            while orders.poll(max(0.0, due - time.monotonic()) if watched else None):
                told = orders.recv()
                watched = told.watch is not None
                if told.play is not None:
                    ground.obey(told.play)
                    seen_due = min(seen_due, seen_at + _SOON_SECONDS)
            now = time.monotonic()
            due = (now if now - due > _TOO_LATE else due) + 1.0 / FRAME_RATE
            ground.advance(1.0 / FRAME_RATE)
            audience.frame(ground.frame().encode())
            if now >= seen_due:
                seen = ground.seen()
                seen_at, seen_due = now, now + _SEEN_SECONDS
                if seen.outcome is not None and ground.pace > 0.0:
                    # With the attempt ends what was foreseen.
                    seen_due = min(seen_due, now + max(_SOON_SECONDS, seen.seconds / ground.pace))
                audience.seen(seen)
    except (EOFError, BrokenPipeError):
        return
