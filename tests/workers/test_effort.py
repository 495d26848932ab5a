"""Time under way, CPU time and episodes: counted over attempts, and never while nobody trains."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.workers.test_trainer import TINY, Recorder, learned
from workers.checkpoints import read_checkpoint, write_checkpoint
from workers.manifest import Effort
from workers.training import effort
from workers.training.effort import CPU, EPISODES, WALL, EffortMeter
from workers.training.trainer import train


class Clock:
    """Stands where a test puts it."""

    def __init__(self) -> None:
        self.wall, self.cpu = 1_000.0, 3.0

    def perf_counter(self) -> float:
        return self.wall

    def process_time(self) -> float:
        return self.cpu

    def pass_by(self, wall: float, cpu: float = 0.0) -> None:
        self.wall += wall
        self.cpu += cpu


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(effort, "time", clock)
    return clock


def test_a_night_and_a_lost_attempt_are_not_in_it(clock: Clock) -> None:
    first = EffortMeter(Effort())
    clock.pass_by(60.0, 90.0)
    first.ended(7)
    saved = first.read()
    assert saved == Effort(wall_seconds=60.0, cpu_seconds=90.0, episodes=7)
    # Forty seconds and two episodes more, which are lost with the machine; then a night.
    clock.pass_by(40.0, 40.0)
    first.ended(2)
    clock.pass_by(8 * 3600.0)

    second = EffortMeter(Effort())
    clock.pass_by(5.0, 4.0)  # until the checkpoint is read
    second.resume(saved)
    clock.pass_by(10.0, 16.0)
    second.ended(1)
    assert second.metrics() == {WALL: 75.0, CPU: 110.0, EPISODES: 8.0}


class Ticking(Recorder):
    """Ten seconds go by after each report, on one and a half processors."""

    def __init__(self, clock: Clock, stop_after: int | None = None) -> None:
        super().__init__(stop_after)
        self._clock = clock

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        super().metrics(step, values)
        self._clock.pass_by(10.0, 15.0)

    def told(self, name: str) -> list[float]:
        """A metric's values."""
        return [values[name] for _, values in self.rows]


def test_a_stopped_training_counts_on_when_it_is_resumed(tmp_path: Path, clock: Clock) -> None:
    first = Ticking(clock, stop_after=5)
    train(TINY, 5, first, tmp_path / "first", report_interval=0.0)
    assert first.told(WALL) == [0.0, 10.0, 20.0, 30.0, 40.0]
    clock.pass_by(8 * 3600.0, 100.0)  # another process by then

    stopped = Ticking(clock)
    train(TINY, 5, stopped, tmp_path / "second", resume=first.checkpoints[-1][1], report_interval=0.0)
    assert stopped.told(WALL) == [50.0, 60.0, 70.0]
    assert stopped.told(CPU) == [75.0, 90.0, 105.0]

    # Lost instead: it goes on from its checkpoint at 2,048, saved after four reports, and the fifth is made anew.
    clock.pass_by(8 * 3600.0, 100.0)
    lost = Ticking(clock)
    step, archive, _ = first.checkpoints[0]
    assert step == 2_048
    train(TINY, 5, lost, tmp_path / "third", resume=archive, report_interval=0.0)
    assert lost.told(WALL) == [40.0, 50.0, 60.0, 70.0]
    # What is learned, and so the episodes, is the same either way.
    assert learned(first.rows[4:] + stopped.rows) == learned(lost.rows)
    assert lost.told(EPISODES) == sorted(lost.told(EPISODES))
    assert lost.told(EPISODES)[-1] > first.told(EPISODES)[3] > 0


def test_what_was_not_counted_before_is_not_guessed(tmp_path: Path) -> None:
    first = Recorder(stop_after=4)
    train(TINY, 5, first, tmp_path / "first", report_interval=0.0)
    checkpoint = read_checkpoint(first.checkpoints[-1][1])
    assert checkpoint.counters.effort is not None
    before = type(checkpoint)(
        checkpoint.manifest,
        checkpoint.weights,
        checkpoint.arrays,
        checkpoint.counters.model_copy(update={"effort": None}),
    )
    write_checkpoint(tmp_path / "old.zip", before)

    resumed = Recorder()
    train(TINY, 5, resumed, tmp_path / "second", resume=tmp_path / "old.zip", report_interval=0.0)
    assert not any(name in values for _, values in resumed.rows for name in (WALL, CPU, EPISODES))
    assert read_checkpoint(resumed.checkpoints[-1][1]).counters.effort is None
