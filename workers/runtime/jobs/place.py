"""A place for one job at a time: waits for one, sees it through in a process of its own, waits again."""

import logging
import math
import os
import shutil
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from workers.errors import ArchiveIntegrityError, RequestRefusedError, RunRefusedError, ServerError, ServerUnavailableError
from workers.job_protocol import (
    FRAME_LENGTH_BYTES,
    MAX_FRAMES_BYTES,
    BagJob,
    FilmJob,
    JobClaim,
    JobEnd,
    JobKind,
    JobOrders,
    WatchedJob,
)
from workers.play_protocol import PlaySeen
from workers.processes import how_it_ended
from workers.runtime.fitness import HEARTBEAT_FILE, Fitness
from workers.runtime.forked_process import ForkedProcess
from workers.runtime.jobs.client import JobClient
from workers.runtime.jobs.forks import Forks, Orders
from workers.runtime.jobs.process import (
    ARCHIVE,
    BAG,
    RECORDING,
    RESULT,
    Done,
    Failed,
    Progressed,
    Task,
    recording_name,
)
from workers.runtime.jobs.pulse import REPORT_SECONDS, pulse
from workers.runtime.sight import ServerSight

logger = logging.getLogger(__name__)

_CLAIM_WAIT_SECONDS = 10.0
_RETRY_SECONDS = 0.5
_LOOK_SECONDS = 0.05
# Of all but what is watched: a policy from elsewhere may compute for ever.
MAX_SECONDS = 3_600.0
# Two frames in one request: half the requests, and a thirtieth of a second that nobody sees.
_FRAMES_AT_ONCE = 2
_ERROR_CHARACTERS = 9_000
# A process that has said its last word has nothing left to do.
_EXIT_SECONDS = 2.0


class Place:
    """One job at a time.

    Args:
        name: under which the server knows it.
        kinds: of jobs that it takes.
        long: whether those too that go on for minutes.
        client: to the server.
        work_dir: where jobs keep their files while they are under way.
        fitness: of this machine.
        sight: of the server, one for all places of a process.
        forks: where processes are forked from, one for all places of a process.
        ending: set once the worker is to end.
    """

    def __init__(
        self,
        name: str,
        kinds: tuple[JobKind, ...],
        long: bool,
        client: JobClient,
        work_dir: Path,
        fitness: Fitness,
        sight: ServerSight,
        forks: Forks,
        ending: threading.Event,
    ) -> None:
        self.name = name
        self._kinds = kinds
        self._long = long
        self._client = client
        self._work_dir = work_dir
        self._fitness = fitness
        self._sight = sight
        self._forks = forks
        self._ending = ending

    def run(self) -> None:
        """Take up jobs until the worker ends."""
        claim_id = uuid.uuid4().hex
        while not self._ending.is_set():
            if self._fitness.trouble is not None:
                self._ending.wait(REPORT_SECONDS)
                continue
            try:
                claim = self._client.claim_job(self.name, self._kinds, claim_id, _CLAIM_WAIT_SECONDS, long=self._long)
            except ServerError as error:
                self._sight.lost(error)
                self._ending.wait(_RETRY_SECONDS)
                continue
            self._sight.found()
            (self._work_dir / HEARTBEAT_FILE).touch()
            if claim is None:
                continue
            claim_id = uuid.uuid4().hex
            try:
                self._see_through(claim)
            except (OSError, ServerError) as error:
                logger.exception("job %s: attempt %d broke; another one begins after its lease", claim.id, claim.attempt)
                self._fitness.rest(f"{type(error).__name__}: {error}", self._ending.is_set)

    def _see_through(self, claim: JobClaim) -> None:
        logger.info("job %s (%s): attempt %d begins", claim.id, claim.spec.kind, claim.attempt)
        directory = self._work_dir / f"{os.getpid()}-{claim.id}-{claim.attempt}"
        directory.mkdir(mode=0o700)
        try:
            end = self._do(claim, directory)
            if end is not None:
                self._patiently(lambda: self._client.end_job(claim.id, claim.attempt, end), claim.lease_seconds)
            logger.info("job %s: attempt %d ended: %s", claim.id, claim.attempt, end.outcome if end else "no longer wanted")
        except RunRefusedError as refusal:
            logger.info("job %s: attempt %d is over: %s", claim.id, claim.attempt, refusal)
        finally:
            shutil.rmtree(directory, ignore_errors=True)

    def _do(self, claim: JobClaim, directory: Path) -> JobEnd | None:
        """How the job ended; None where the server knows better."""
        try:
            with pulse(self._client, claim, 0.0):
                for fetch in self._needed(claim, directory):
                    self._patiently(fetch, claim.lease_seconds)
        except (ArchiveIntegrityError, RequestRefusedError) as error:
            return JobEnd(outcome="failed", error=str(error))
        # Under load what it is forked from may still be at its imports.
        with pulse(self._client, claim, 0.0):
            process, pipe = self._forks.begin(Task(claim.spec.model_dump_json(), str(directory), claim.ahead))
        try:
            end = _Watch(self._client, claim, process, pipe, self._ending).until_ended()
        finally:
            pipe.close()
            process.wait(_EXIT_SECONDS if not self._ending.is_set() else 0.0)
            process.kill()
            _ = process.status
        if end.outcome == "done" and not isinstance(claim.spec, WatchedJob):
            result = directory / RESULT
            with pulse(self._client, claim, 1.0):
                self._patiently(lambda: self._client.bring_result(claim.id, claim.attempt, result), claim.lease_seconds)
            recording = directory / RECORDING
            if recording.exists():
                self._patiently(
                    lambda: self._client.bring_recording(claim.id, claim.attempt, recording), claim.lease_seconds
                )
        return end

    def _needed(self, claim: JobClaim, directory: Path) -> Iterator[Callable[[], None]]:
        """Fetches what the job can't begin without, one file after another."""
        if claim.sha256 is not None:
            yield partial(self._client.fetch_archive, claim.id, claim.attempt, claim.sha256, directory / ARCHIVE)
        if isinstance(claim.spec, FilmJob):
            for number in range(len(claim.spec.film.policies)):
                path = directory / recording_name(number)
                yield partial(self._client.fetch_recording, claim.id, claim.attempt, number, path)
        if isinstance(claim.spec, BagJob):
            yield partial(self._client.fetch_bag, claim.id, claim.attempt, claim.spec.bag_sha256, directory / BAG)

    def _patiently(self, request: Callable[[], None], seconds: float) -> None:
        """Ask again while the server does not answer, for as long as it may keep the job for us."""
        deadline = time.monotonic() + seconds
        while True:
            try:
                return request()
            except ServerUnavailableError:
                if time.monotonic() > deadline or self._ending.is_set():
                    raise
                time.sleep(_RETRY_SECONDS)


class _Watch:
    """Stands between a job's process and the server for as long as the process runs."""

    def __init__(
        self, client: JobClient, claim: JobClaim, process: ForkedProcess, pipe: Orders, ending: threading.Event
    ) -> None:
        self._client = client
        self._claim = claim
        self._process = process
        self._pipe = pipe
        self._ending = ending
        self._progress = 0.0
        self._frames: list[bytes] = []
        self._told: JobOrders | None = None
        # The newest orders of a playground that its process has.
        self._revision = -1
        self._deadline = math.inf if isinstance(claim.spec, WatchedJob) else time.monotonic() + MAX_SECONDS

    def until_ended(self) -> JobEnd:
        """How the process ended.

        Raises:
            RunRefusedError: nobody wants the job any more, or somebody else has it.
        """
        due = 0.0
        while not self._ending.is_set():
            if time.monotonic() > self._deadline:
                return JobEnd(
                    outcome="failed", error=f"It took longer than {MAX_SECONDS / 60.0:.0f} minutes, and was ended."
                )
            if time.monotonic() >= due:
                due = time.monotonic() + REPORT_SECONDS
                self._report()
            if not self._pipe.poll(_LOOK_SECONDS):
                if not self._process.alive and not self._pipe.poll():
                    return self._died()
                continue
            try:
                said = self._pipe.recv()
            except EOFError:
                return self._died()
            match said:
                case bytes():
                    self._frames.append(said)
                    if len(self._frames) >= _FRAMES_AT_ONCE:
                        due = time.monotonic() + REPORT_SECONDS
                        self._send_frames()
                case PlaySeen():
                    # Behind the moment that it is of, which nobody is to see it without.
                    self._send_frames()
                    self._send_seen(said)
                case Progressed():
                    self._progress = said.share
                case Failed():
                    return JobEnd(outcome="failed", error=said.reason[-_ERROR_CHARACTERS:])
                case Done():
                    return JobEnd(outcome="done")
        return JobEnd(outcome="released")

    def _report(self) -> None:
        try:
            self._obey(self._client.report_job(self._claim.id, self._claim.attempt, self._progress, self._revision))
        except ServerUnavailableError as error:
            # It may be back before the lease is over; if not, the next report is refused.
            logger.warning("job %s: %s", self._claim.id, error)

    def _send_frames(self) -> None:
        frames, self._frames = self._frames, []
        if not frames:
            return
        packed = b"".join(len(frame).to_bytes(FRAME_LENGTH_BYTES, "little") + frame for frame in frames)
        if len(packed) > MAX_FRAMES_BYTES:
            return
        try:
            self._obey(self._client.send_frames(self._claim.id, self._claim.attempt, packed, self._revision))
        except ServerUnavailableError as error:
            logger.warning("job %s: %s", self._claim.id, error)

    def _send_seen(self, seen: PlaySeen) -> None:
        try:
            self._obey(self._client.send_seen(self._claim.id, self._claim.attempt, seen, self._revision))
        except ServerUnavailableError as error:
            logger.warning("job %s: %s", self._claim.id, error)

    def _obey(self, orders: JobOrders) -> None:
        if not isinstance(self._claim.spec, WatchedJob) or orders == self._told:
            return
        self._told = orders.model_copy(update={"play": None})
        if orders.play is not None:
            self._revision = orders.play.revision
        try:
            self._pipe.send(orders)
        except BrokenPipeError:
            return  # it has ended, and whoever waits for it notices

    def _died(self) -> JobEnd:
        how = how_it_ended(self._process.status) if self._process.wait(_EXIT_SECONDS) else "said nothing any more"
        return JobEnd(outcome="lost", error=f"The process {how}.")
