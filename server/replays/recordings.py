"""Evaluations driven once more: by a worker on demand, and kept for a while."""

import asyncio
from collections.abc import Sequence
from pathlib import Path

from server.errors import JobFailedError, ReplayFailedError
from server.jobs.asked import Asked
from server.jobs.names import recordings_prefix, result_name
from server.jobs.repository import JobRepository
from server.jobs.waiting import result_of
from server.replays.schemas import ReplayProgress
from server.replays.simulator import simulator
from server.replays.subject import Subject
from server.services import Services
from workers.job_protocol import ReplayJob
from workers.replays.recording import Recording


async def recording_of(services: Services, subject: Subject) -> Recording:
    """What a policy did on its suite; driven again now if that is not kept.

    Raises:
        ReplayFailedError: its archive is refused, or the suite is no longer what it was.
        JobTimeoutError: it took too long.
        NoWorkerError: nobody is there to do it.
        BusyError: as much waits as may.
    """
    asked = asked_for(subject)
    lane = services.lanes.replays
    try:
        recording = await lane.run(_load, await result_of(services, asked))
        if recording is None:
            # What was kept was damaged, and is gone now.
            recording = await lane.run(_load, await result_of(services, asked))
    except JobFailedError as error:
        raise ReplayFailedError(f"The episodes could not be driven again: {error.message}") from error
    if recording is None:
        raise ReplayFailedError("The episodes could not be driven again: what came of it is damaged.")
    if recording.evaluation.suite_hash != subject.recorded.suite_hash:
        raise ReplayFailedError(
            f"The suite {subject.recorded.suite} has changed since this evaluation: its episodes can't be driven again."
        )
    return recording


def asked_for(subject: Subject, *, ahead: bool = False) -> Asked:
    """The job that drives its episodes again; `ahead`: nobody waits for it yet."""
    return Asked(
        spec=ReplayJob(policy=subject.policy, suite=subject.suite),
        key=recording_key(subject),
        title=f"{subject.title}, made ahead" if ahead else subject.title,
        sha256=subject.sha256,
        ahead=ahead,
    )


async def recordings_of(services: Services, subjects: Sequence[Subject]) -> list[Recording]:
    """What several did, driven again side by side.

    Raises:
        ReplayFailedError: see `recording_of`, also for more.
    """
    tasks = [asyncio.create_task(recording_of(services, subject)) for subject in subjects]
    try:
        return await asyncio.gather(*tasks)
    finally:
        # Where one fails, or the client has left, nobody waits for the others.
        for task in tasks:
            task.cancel()


def recording_key(subject: Subject) -> str:
    """Says what decides how the episodes go: policy, suite, and what drives."""
    return f"{recordings_prefix(subject.identity)}{subject.recorded.suite_hash[:16]}-{simulator()}"


async def progress_of(services: Services, subjects: Sequence[Subject]) -> ReplayProgress:
    """How far the recordings of these are made."""
    shares = await services.lanes.jobs.run(_shares, services, subjects)
    return ReplayProgress(
        ready=sum(share == 1.0 for share in shares), policies=len(shares), share=sum(shares) / max(1, len(shares))
    )


def _shares(services: Services, subjects: Sequence[Subject]) -> list[float]:
    """Of each the share that is made; one that is there counts as looked at."""
    keys = [recording_key(subject) for subject in subjects]
    kept = [services.results.find(result_name("replay", key)) is not None for key in keys]
    with services.database.read() as session:
        jobs = [None if there else JobRepository(session).open_of(key) for key, there in zip(keys, kept, strict=True)]
    return [
        1.0 if there else min(0.99, services.board.progress(job.id)) if job is not None else 0.0
        for there, job in zip(kept, jobs, strict=True)
    ]


def _load(path: Path) -> Recording | None:
    """A recording; one that can't be read is removed."""
    try:
        return Recording.load(path)
    except (OSError, ValueError):
        path.unlink(missing_ok=True)
        return None
