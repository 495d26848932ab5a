"""Faults, one round after another: launch, hit, wait until everything has recovered, hit again."""

import math
import random
import sys
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from benchmarks.chaos.kinds import Heal, Kind, MissedError, Scene
from benchmarks.chaos.progress import Progress, Rows
from benchmarks.chaos.recovery import Recovery
from benchmarks.chaos.stack import Node, Stack

# On top of the lease: for a run that shows no sign of life after a fault, before it counts as stuck.
STUCK_SECONDS = 60.0
# For trainings that nobody disturbs (any more), as a multiple of that.
_COMPLETION = 10.0
_POLL_SECONDS = 0.05
# Only runs with so much of their training before them are hit, as part of the whole.
_LATEST_HIT = 0.7
# A kind whose moment does not come so often in a row cannot be injected at all.
_MISSES = 20


@dataclass(frozen=True)
class Injected:
    """A fault that was injected; `seconds` to recovery is None where the run failed or got stuck."""

    kind: Kind
    run_id: str
    seconds: float | None


@dataclass
class Outcome:
    """What became of everything.

    Attributes:
        references: the undisturbed run of each seed.
        runs: the seed of each disturbed run.
        injected: faults, in order.
        failed: runs that the service gave up, with the reason.
        stuck: runs that showed no sign of life for longer than anything takes.
        damaged: ids of checkpoints that were damaged on purpose.
        revived: processes that ended although nobody had asked or killed them, and were started again.
    """

    references: dict[int, str] = field(default_factory=dict)
    runs: dict[str, int] = field(default_factory=dict)
    injected: list[Injected] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    stuck: set[str] = field(default_factory=set)
    damaged: set[str] = field(default_factory=set)
    revived: list[str] = field(default_factory=list)


class Campaign:
    """A number of faults of these kinds, in an order that a seed decides.

    Args:
        stack: the service; one of its workers stays free for the runs of silent ones.
        kinds: to inject, in equal numbers as far as possible.
        faults: how many.
        seed: of everything that is left to chance.
        training: of every run.
        seconds: after which no more faults come, however many are left.
        patience: seconds on top of the lease after which a run that shows no sign of life counts as stuck.
        talk: whether each fault is told on standard error as it happens.
    """

    def __init__(
        self,
        stack: Stack,
        kinds: Sequence[Kind],
        faults: int,
        seed: int,
        training: dict[str, Any],
        *,
        seconds: float = math.inf,
        patience: float = STUCK_SECONDS,
        talk: bool = False,
    ) -> None:
        self._stack = stack
        self._kinds = tuple(kind for kind in kinds if stack.mode in kind.modes)
        self._faults = faults
        self._dice = random.Random(seed)
        self._training = training
        self._end = time.monotonic() + seconds
        self._patience = patience
        self._talk = talk
        self._rows = Rows(stack.database_url)
        self._side_by_side = len(stack.nodes) - 1
        self._active: list[str] = []
        self._deck: deque[Kind] = deque()
        self._misses = 0
        self.outcome = Outcome()

    def run(self) -> Outcome:
        """Train undisturbed, then disturbed, until all faults are injected or the time is up, and all runs have ended."""
        self._train_recipes()
        while len(self.outcome.injected) < self._faults and time.monotonic() < self._end:
            self._revive()
            self._round(self._draw())
        self._await_completion(self._active)
        return self.outcome

    # -- runs -------------------------------------------------------------------------------------------------------------

    def _train_recipes(self) -> None:
        for seed in range(self._side_by_side):
            self.outcome.references[seed] = self._stack.launch(self._training, seed)
        self._say(f"{self._side_by_side} undisturbed runs")
        self._await_completion(list(self.outcome.references.values()))
        if self.outcome.stuck or self.outcome.failed:
            raise RuntimeError(f"runs that nobody disturbed did not complete: {self.outcome}")

    def _top_up(self) -> None:
        """Launch as many runs as have ended."""
        rows = self._rows.read(self._active)
        self._active = [run_id for run_id in self._active if run_id not in rows or not self._ended(run_id, rows[run_id])]
        while len(self._active) < self._side_by_side:
            seed = len(self.outcome.runs) % self._side_by_side
            run_id = self._stack.launch(self._training, seed)
            self.outcome.runs[run_id] = seed
            self._active.append(run_id)

    def _ended(self, run_id: str, row: Progress) -> bool:
        if row.state in ("failed", "stopped"):
            reason = self._stack.until(lambda: self._stack.api.get(f"/api/runs/{run_id}").json())["error"]
            self.outcome.failed[run_id] = f"{row.state}: {reason}"
            self._say(f"run {run_id} {self.outcome.failed[run_id]}")
        return row.state in ("completed", "failed", "stopped") or run_id in self.outcome.stuck

    def _await_completion(self, run_ids: Sequence[str]) -> None:
        deadline = time.monotonic() + _COMPLETION * self._patience
        waiting = set(run_ids)
        while waiting and time.monotonic() < deadline:
            self._revive()
            rows = self._rows.read(waiting)
            waiting -= {run_id for run_id, row in rows.items() if self._ended(run_id, row)}
            time.sleep(_POLL_SECONDS)
        self.outcome.stuck |= waiting

    def _victims(self, number: int) -> list[tuple[str, Node]]:
        """So many runs that train, have checkpoints and have recovered from whatever hit them before."""
        nodes = {node.name: node for node in self._stack.nodes}
        deadline = time.monotonic() + _COMPLETION * self._patience
        while time.monotonic() < deadline:
            self._revive()
            self._top_up()
            rows = self._rows.read(self._active)
            ready = [
                (run_id, nodes[row.worker])
                for run_id, row in rows.items()
                if row.worker in nodes and row.state == "running" and row.losses == 0 and self._hittable(row)
            ]
            if len(ready) >= number:
                return self._dice.sample(ready, number)
            time.sleep(_POLL_SECONDS)
        raise TimeoutError("no run trains")

    def _hittable(self, row: Progress) -> bool:
        earliest: float = 2.5 * self._training["evaluation"]["every_steps"]  # two checkpoints
        return earliest < row.step < _LATEST_HIT * float(self._training["steps"])

    # -- faults -----------------------------------------------------------------------------------------------------------

    def _draw(self) -> list[Kind]:
        """The next kinds: one of the whole service, or one for each of several runs, at most one of them silent.

        One worker is free, and takes over from one that falls silent.
        """
        drawn: list[Kind] = []
        rest = self._faults - len(self.outcome.injected)
        while len(drawn) < min(self._side_by_side, rest):
            if not self._deck:
                self._deck.extend(self._dice.sample(self._kinds, len(self._kinds)))
            kind = self._deck[0]
            alone = kind.scope == "service" or any(other.heard == "silent" for other in drawn)
            if drawn and (alone or kind.heard == "silent"):
                break
            drawn.append(self._deck.popleft())
            if kind.scope == "service":
                break
        return drawn

    def _round(self, kinds: Sequence[Kind]) -> None:
        victims = self._victims(len(kinds))
        with ThreadPoolExecutor(len(kinds)) as pool:
            # Each with dice of its own: threads take turns in no certain order.
            hits = list(pool.map(self._hit, kinds, victims, [random.Random(self._dice.random()) for _ in kinds]))
        for kind, hit in zip(kinds, hits, strict=True):
            if hit is None:
                self._misses += 1
                if self._misses > _MISSES:
                    raise RuntimeError(f"the moment for {kind.name!r} does not come: are the runs too short?")
                self._deck.append(kind)
            else:
                self._misses = 0
        self._settle([hit for hit in hits if hit is not None])

    def _hit(self, kind: Kind, victim: tuple[str, Node], dice: random.Random) -> "_Hit | None":
        run_id, node = victim
        scene = Scene(self._stack, run_id, node, dice, self.outcome.damaged)
        watched = [run_id] if kind.scope == "run" else list(self._active)
        try:
            heal = kind.inject(scene)
        except MissedError:
            return None
        now = time.monotonic()
        rows = self._rows.read(watched)
        while not rows and time.monotonic() < now + self._patience:
            time.sleep(_POLL_SECONDS)
            rows = self._rows.read(watched)
        before = {key: row for key, row in rows.items() if row.state not in ("completed", "failed")}
        # Only the run that was hit needs another attempt; the others wait for the service.
        recoveries = {key: Recovery(row, kind.new_attempt and key == run_id, now) for key, row in before.items()}
        return _Hit(kind, run_id, node, heal, recoveries)

    def _settle(self, hits: Sequence["_Hit"]) -> None:
        """Wait until every run that was hit has recovered, and has a new checkpoint where it lost an attempt."""
        patience = time.monotonic() + self._stack.lease_seconds + self._patience
        waiting = list(hits)
        while waiting and time.monotonic() < patience:
            self._revive()
            for hit in list(waiting):
                # All are looked at each time: how long each has taken is noted then.
                missing = [run_id for run_id, recovery in hit.recoveries.items() if not self._recovered(run_id, recovery)]
                if not missing:
                    self._note(hit)
                    waiting.remove(hit)
            time.sleep(_POLL_SECONDS)
        for hit in waiting:
            self.outcome.stuck.update(run_id for run_id, recovery in hit.recoveries.items() if recovery.seconds is None)
            self._note(hit)
        self.outcome.stuck -= self.outcome.failed.keys()
        while time.monotonic() < patience:
            rows = self._rows.read([run_id for hit in hits for run_id in hit.recoveries])
            if rows and all(row.losses == 0 or row.state in ("completed", "failed") for row in rows.values()):
                return
            self._revive()
            time.sleep(_POLL_SECONDS)

    def _recovered(self, run_id: str, recovery: Recovery) -> bool:
        row = self._rows.read([run_id]).get(run_id)
        if row is None:
            return False
        if row.state in ("failed", "stopped"):
            return self._ended(run_id, row)
        return recovery.look(row)

    def _note(self, hit: "_Hit") -> None:
        if hit.heal is not None:
            hit.heal()
        times = [recovery.seconds for recovery in hit.recoveries.values()]
        slowest = None if None in times else max((time for time in times if time is not None), default=0.0)
        self.outcome.injected.append(Injected(hit.kind, hit.run_id, slowest))
        told = "NOT RECOVERED" if slowest is None else f"{slowest:.1f} s"
        self._say(f"{len(self.outcome.injected):4d}  {hit.kind.name:26s} {hit.node.name} {hit.run_id}  {told}")
        if slowest is None and hit.kind.scope == "run":
            # So that the other faults find a worker that works.
            hit.node.kill()
            hit.node.start()

    def _revive(self) -> None:
        """Start what has ended, as a supervisor would."""
        for node in self._stack.nodes:
            if node.ended:
                self.outcome.revived.append(node.name)
                self._say(f"{node.name} ended by itself")
                node.start()
        if self._stack.server_ended:
            self.outcome.revived.append("server")
            self._say("the server ended by itself")
            self._stack.start_server()

    def _say(self, line: str) -> None:
        if self._talk:
            sys.stderr.write(f"{time.strftime('%H:%M:%S')} {line}\n")
            sys.stderr.flush()


@dataclass(frozen=True)
class _Hit:
    """A fault that was injected, and the runs that have to recover from it."""

    kind: Kind
    run_id: str
    node: Node
    heal: Heal | None
    recoveries: dict[str, Recovery]
