"""`python -m benchmarks.load.workers`: runs that report over the real link without training anything.

Each has the worker's own spool and link (`workers.runtime`), so batches, renewals, reconnections and frames are the real
ones; only the numbers are made up.
"""

import logging
import random
import threading
import time
import uuid
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
import numpy as np

from benchmarks.load.lag import watch_thread_lag
from benchmarks.load.plan import Plan, WorkersTold, await_beginning, read_plan, tell
from sim.config import LidarConfig
from workers.errors import ServerError
from workers.frames import Frame
from workers.protocol import HEARTBEAT_SECONDS, Orders
from workers.reporting import WatchRequest
from workers.runtime.client import ServerClient
from workers.runtime.link import Link
from workers.runtime.spool import Spool

logger = logging.getLogger(__name__)

_FRAMES_PER_SECOND = 30.0
_STEPS_PER_ITEM = 8_192


def made_up_frame(watch: WatchRequest, step: int, moment: float) -> Frame:
    """Robots that go round in circles; `moment` in seconds."""
    robots, rays = watch.robots, LidarConfig().rays
    angles = moment + np.arange(robots, dtype=np.float32)
    return Frame(
        mode=watch.mode,
        step=step,
        sim_time=moment,
        speed=1.0,
        poses=np.stack((np.cos(angles), np.sin(angles), angles), axis=1).astype(np.float32),
        targets=np.zeros((robots, 2), np.float32),
        ranges=np.full((robots, rays), 1.0 + 0.5 * np.sin(moment), np.float32),
        fields_of_view=np.full(robots, 180.0, np.float32),
        rewards=np.zeros(robots, np.float32),
        outcomes=np.zeros(robots, np.uint8),
    )


class SyntheticRun:
    """A claimed run: its spool, its link and what it makes up."""

    def __init__(self, plan: Plan, client: ServerClient, run_id: str, number: int, directory: Path) -> None:
        self._plan = plan
        self._client = client
        self._directory = directory
        self.run_id = run_id
        self.worker = f"synthetic@load/{number}"
        self._dice = random.Random(number)
        self._names = tuple(f"group{index % 6}/series_{index}" for index in range(plan.series))
        self._step = 0
        self._watch: WatchRequest | None = None
        self._spool: Spool | None = None
        self._link: Link | None = None
        self._first_seq = 0
        self._broken: str | None = None
        self.items = self.acknowledged = self.frames = 0

    def claim(self, attempt: int) -> None:
        """Take the run up at this attempt, and open its link."""
        self.close()
        self._broken = None
        claim = self._client.claim(self.run_id, self.worker, attempt, uuid.uuid4().hex)
        self._first_seq = claim.last_seq
        self._spool = Spool(self._directory / f"{self.run_id}-{claim.attempt}.jsonl", claim.last_seq)
        self._link = Link(
            self._plan.server_url,
            self._plan.worker_token,
            self.run_id,
            claim.attempt,
            self._spool,
            claim.lease_seconds,
            self._obey,
            self._give_up,
        )

    @property
    def lost(self) -> bool:
        """Whether the server has given the run to nobody, or somebody else."""
        return self._link is None or self._link.fenced() or self._broken is not None

    def report(self) -> None:
        """One item of made-up numbers."""
        assert self._spool is not None
        assert self._link is not None
        self._step += _STEPS_PER_ITEM
        self._spool.metrics(self._step, time.time(), {name: self._dice.random() for name in self._names})
        self.items += 1
        self._link.notify()

    @property
    def settled(self) -> bool:
        """Whether the server has all that was reported."""
        return self._spool is None or self._spool.acked == self._spool.last_seq

    def begin(self) -> None:
        """Count from now on."""
        assert self._spool is not None
        self._first_seq, self.items = self._spool.acked, 0

    def show(self, moment: float) -> None:
        """One frame, while somebody watches."""
        watch = self._watch  # orders change it meanwhile
        if watch is None or self._link is None:
            return
        self._link.frame(made_up_frame(watch, self._step, moment).encode())
        self.frames += 1

    def close(self) -> None:
        """Close the link and count what the server has."""
        if self._link is not None and self._spool is not None:
            self._link.close()
            self.acknowledged += self._spool.acked - self._first_seq
            self._spool.close()
            self._link = self._spool = None

    def _obey(self, orders: Orders) -> None:
        self._watch = orders.watch

    def _give_up(self, reason: str) -> None:
        logger.error("run %s: %s", self.run_id, reason)
        self._broken = reason


def _heartbeats(plan: Plan, client: ServerClient, runs: list[SyntheticRun], errors: Counter[str]) -> None:
    """Each worker's, spread over the interval."""
    while not plan.over:
        for run in runs:
            try:
                client.heartbeat(run.worker, "cpu")
            except ServerError as error:
                errors[f"heartbeat: {type(error).__name__}"] += 1
            time.sleep(HEARTBEAT_SECONDS / len(runs))


def _frames(plan: Plan, runs: list[SyntheticRun]) -> None:
    due = time.monotonic()
    while not plan.over:
        for run in runs:
            run.show(due)
        due += 1.0 / _FRAMES_PER_SECOND
        time.sleep(max(0.0, due - time.monotonic()))


def _report_history(plan: Plan, runs: list[SyntheticRun]) -> None:
    """What runs that have gone on for a while have reported."""
    for run in runs:
        for _ in range(plan.history):
            run.report()
    for run in runs:
        while not run.settled and not run.lost:
            time.sleep(0.1)
    for run in runs:
        run.begin()


def work(plan: Plan) -> WorkersTold:
    """Claim every run and report from the beginning to the end of the plan; a run that is lost is taken up again."""
    errors: Counter[str] = Counter()
    lags: list[float] = []
    leases_lost = 0
    with (
        TemporaryDirectory() as directory,
        ServerClient(plan.server_url, plan.worker_token) as client,
        httpx.Client(base_url=plan.server_url, headers={"Authorization": f"Bearer {plan.token}"}) as api,
    ):
        runs = [SyntheticRun(plan, client, run_id, number, Path(directory)) for number, run_id in enumerate(plan.run_ids)]
        for run in runs:
            run.claim(attempt=0)
        _report_history(plan, runs)
        plan = await_beginning(plan)
        threads = [
            threading.Thread(target=_heartbeats, args=(plan, client, runs, errors)),
            threading.Thread(target=_frames, args=(plan, runs)),
            threading.Thread(target=watch_thread_lag, args=(plan, lags)),
        ]
        for thread in threads:
            thread.start()
        due = time.monotonic()
        while not plan.over:
            for run in runs:
                # Spread over the interval, as trainings on many machines are.
                due += 1.0 / (plan.batches * len(runs))
                time.sleep(max(0.0, due - time.monotonic()))
                if run.lost:
                    leases_lost += 1
                    try:
                        run.claim(api.get(f"/api/runs/{run.run_id}").raise_for_status().json()["attempt"])
                    except (ServerError, httpx.HTTPError) as error:
                        errors[f"claim: {type(error).__name__}"] += 1
                        continue
                run.report()
        for thread in threads:
            thread.join()
        time.sleep(1.0)  # the last acknowledgements
        for run in runs:
            run.close()
    return WorkersTold(
        items=sum(run.items for run in runs),
        acknowledged=sum(run.acknowledged for run in runs),
        leases_lost=leases_lost,
        frames=sum(run.frames for run in runs),
        errors=errors,
        lags=lags,
    )


if __name__ == "__main__":
    logging.getLogger().setLevel(logging.ERROR)
    tell(work(read_plan()))
