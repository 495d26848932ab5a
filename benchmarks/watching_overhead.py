"""What watching costs a training: steps per second while somebody watches and while nobody does, in turns of one training.

The default training runs, and every two seconds somebody starts or stops to watch, so that both meet the same weights, the
same machine and the same minute. The overhead is one minus the ratio of the medians of the turns. How much of a core the
view's thread takes is read from its own clock, the encoding of its frames included. `cpu_overhead_percent` is the same in
processor time per step: where other programs keep all cores busy, only that one means something.

    python -m benchmarks.watching_overhead --check
"""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.report import finish, parser
from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from workers.config import EvaluationConfig, TrainingConfig
from workers.frames import Frame
from workers.live.viewer import LiveViewer
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.training.trainer import train

TURN_SECONDS = 2.0
# The first moments of a turn still belong to the one before: threads start and end.
SETTLING_SECONDS = 0.4
MAX_OVERHEAD_PERCENT = 5.0
MAX_CORE_PERCENT = 3.0
# Of the 30 that the view aims at.
MIN_FRAMES_PER_SECOND = 29.0


class Turns:
    """A reporter that is watched in every other turn, and ends the training after the last one."""

    def __init__(self, request: WatchRequest, pairs: int) -> None:
        self._request = request
        self._turns = 2 * pairs
        self._begun = float("inf")
        self.frame_count = 0
        self.byte_count = 0

    @property
    def turn(self) -> int:
        """Number of the turn that is going on; odd ones are watched."""
        return int(max(0.0, time.monotonic() - self._begun) / TURN_SECONDS)

    @property
    def watch(self) -> WatchRequest | None:
        """Somebody watches in every other turn."""
        return self._request if self.turn % 2 else None

    @property
    def stop_requested(self) -> bool:
        """All turns are over."""
        return self.turn >= self._turns

    @property
    def settled(self) -> bool:
        """The turn has gone on for a while."""
        return max(0.0, time.monotonic() - self._begun) % TURN_SECONDS > SETTLING_SECONDS

    def start(self) -> None:
        """The first turn begins now."""
        self._begun = time.monotonic()

    def frames(self, frames: Sequence[Frame]) -> None:
        """Turn frames into bytes, as a worker does before it sends them."""
        for frame in frames:
            self.frame_count += 1
            self.byte_count += len(frame.encode())

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Not looked at."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """A view that has stopped would look very cheap."""
        raise RuntimeError(message)

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Not looked at."""


class Stopwatch(LiveViewer):
    """The real view, which also notes when each update was over."""

    def __init__(self, task: TaskConfig, reporter: Turns) -> None:
        super().__init__(task, reporter)
        self._turns = reporter
        self._last: tuple[int, int, float, float] | None = None
        self.rates: dict[int, list[float]] = {}
        self.costs: dict[int, list[float]] = {}
        self.core: dict[int, float] = {}
        self._busy: tuple[int, float, float] | None = None

    def on_weights(self, snapshot: Callable[[], PolicyFunction], step: int) -> None:
        """After each update: steps per second since the one before, where both lie in the settled part of one turn."""
        if self._last is None:
            self._turns.start()
        super().on_weights(snapshot, step)
        now, spent, turn = time.perf_counter(), time.process_time(), self._turns.turn
        if not self._turns.settled:
            self._last = (-1, step, now, spent)
            self._busy = None
            return
        if self._last is not None and self._last[0] == turn:
            steps = step - self._last[1]
            self.rates.setdefault(turn, []).append(steps / (now - self._last[2]))
            self.costs.setdefault(turn, []).append((spent - self._last[3]) / steps)
        self._last = (turn, step, now, spent)
        self._measure_thread(turn, now)

    def _measure_thread(self, turn: int, now: float) -> None:
        thread = self._thread
        if turn % 2 == 0 or thread is None or thread.ident is None or not thread.is_alive():
            return
        spent = time.clock_gettime(time.pthread_getcpuclockid(thread.ident))
        if self._busy is None:
            self._busy = (turn, now, spent)
        elif now > self._busy[1]:
            self.core[turn] = 100.0 * (spent - self._busy[2]) / (now - self._busy[1])


def by_turns(values: Mapping[int, Sequence[float]], parity: int) -> float:
    """Median over the turns of the medians within them, without the first pair of turns, in which everything warms up."""
    return median(median(within) for turn, within in values.items() if turn > 1 and turn % 2 == parity)


def main() -> None:
    """Measure and print."""
    options = parser(__doc__)
    options.add_argument("--robots", type=int, default=64)
    options.add_argument("--mode", choices=("policy", "training"), default="policy")
    options.add_argument("--pairs", type=int, default=10, help="watched turns, and as many unwatched ones")
    arguments = options.parse_args()

    config = TrainingConfig(steps=1_000_000_000, evaluation=EvaluationConfig(every_steps=1_000_000_000))
    reporter = Turns(WatchRequest(mode=arguments.mode, robots=arguments.robots), arguments.pairs)
    viewer = Stopwatch(config.task, reporter)
    with TemporaryDirectory() as directory:
        train(config, 0, reporter, Path(directory), viewer=viewer)
    assert threading.active_count() == 1, "the view left a thread behind"

    unwatched, watched = (by_turns(viewer.rates, parity) for parity in (0, 1))
    costs_unwatched, costs_watched = (by_turns(viewer.costs, parity) for parity in (0, 1))
    finish(
        "watching_overhead",
        {
            "mode": arguments.mode,
            "robots": arguments.robots,
            "steps_per_second_unwatched": round(unwatched),
            "steps_per_second_watched": round(watched),
            "overhead_percent": round(100.0 * (1.0 - watched / unwatched), 2),
            "cpu_overhead_percent": round(100.0 * (costs_watched / costs_unwatched - 1.0), 2),
            "core_percent": round(median(core for turn, core in viewer.core.items() if turn > 1), 2),
            "frames_per_second": round(reporter.frame_count / (arguments.pairs * TURN_SECONDS), 1),
            "bytes_per_frame": round(reporter.byte_count / reporter.frame_count),
        },
        at_least={"frames_per_second": MIN_FRAMES_PER_SECOND},
        at_most={"overhead_percent": MAX_OVERHEAD_PERCENT, "core_percent": MAX_CORE_PERCENT},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
