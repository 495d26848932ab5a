"""Trainers are forked from a process that has imported everything: alone with their faults, and to the same bits."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from pathlib import Path

import psutil
import pytest

from sim.config import TaskConfig
from tests.workers.test_link import until
from workers.checkpoints import read_policy
from workers.config import Algorithm as AlgorithmConfig
from workers.config import DdpgConfig, EvaluationConfig, GruNetwork, MlpNetwork, PpoConfig, TrainingConfig
from workers.runtime.jobs.forks import Forks
from workers.runtime.jobs.process import Failed, Task
from workers.runtime.nursery import Nursery
from workers.runtime.nursery_keeper import NurseryKeeper
from workers.runtime.pipe import CheckpointReport, Control, Ended, Job, Report
from workers.runtime.trainer_handle import TrainerHandle

PPO = PpoConfig(network=MlpNetwork(hidden_sizes=(16,)), robots=4, rollout_steps=32, minibatch_size=64, epochs=2)


@pytest.fixture
def nursery(nursery_door: int) -> Iterator[Nursery]:
    nursery = Nursery(nursery_door)
    nursery.until_ready(120.0)
    yield nursery
    nursery.close()


@pytest.fixture
def keepers() -> Iterator[Callable[[], NurseryKeeper]]:
    """Nurseries of their own, for tests that do something to them."""
    made: list[NurseryKeeper] = []

    def make() -> NurseryKeeper:
        made.append(NurseryKeeper())
        made[-1].keep_running()
        return made[-1]

    yield make
    for each in made:
        each.close()


def job(directory: Path, algorithm: AlgorithmConfig = PPO, steps: int = 1_024) -> Job:
    directory.mkdir()
    training = TrainingConfig(
        task=TaskConfig(), algorithm=algorithm, steps=steps, evaluation=EvaluationConfig(every_steps=1_000_000)
    )
    return Job(training.model_dump_json(), 3, str(directory), None)


def trained(trainer: TrainerHandle, job: Job) -> tuple[list[Report], list[str]]:
    """What it reports until its end, and what it prints."""
    reports: list[Report] = []
    printed: list[str] = []
    trainer.train(job, reports.append, printed.append)
    assert trainer.wait(120.0)
    trainer.close()
    return reports, printed


def weights(reports: list[Report]) -> dict[str, bytes]:
    archive = next(report.archive for report in reversed(reports) if isinstance(report, CheckpointReport))
    return {name: array.tobytes() for name, array in read_policy(Path(archive))[1].weights.items()}


def test_a_trainer_begins_in_a_session_of_its_own_and_ends_with_a_status(nursery: Nursery, tmp_path: Path) -> None:
    trainer = nursery.trainer()
    until(lambda: os.getsid(trainer.pid) == trainer.pid)
    assert trainer.pid != nursery.pid
    reports, _ = trained(trainer, job(tmp_path / "run"))
    assert reports[-1] == Ended("completed")
    assert not trainer.alive
    assert trainer.cause_of_death() == "The trainer process ended with status 0."
    assert nursery.alive


@pytest.mark.parametrize(
    "algorithm",
    [PPO, PPO.model_copy(update={"network": GruNetwork(sequence_length=4)}), DdpgConfig()],
    ids=["PPO", "memory", "DDPG"],
)
def test_whoever_is_forked_trains_to_the_same_bits_as_a_process_of_its_own(
    nursery: Nursery, tmp_path: Path, algorithm: AlgorithmConfig
) -> None:
    first, second = (weights(trained(nursery.trainer(), job(tmp_path / name, algorithm))[0]) for name in ("one", "two"))
    assert first == second
    alone = job(tmp_path / "alone", algorithm)
    script = (
        "import sys; from pathlib import Path; from benchmarks.training_rates import Silent\n"
        "from workers.config import TrainingConfig; from workers.training.trainer import train\n"
        "train(TrainingConfig.model_validate_json(sys.argv[1]), 3, Silent(), Path(sys.argv[2]))"
    )
    subprocess.run([sys.executable, "-c", script, alone.training, alone.directory], check=True, timeout=120)
    (archive,) = Path(alone.directory).glob("step-*.zip")
    assert first == {name: array.tobytes() for name, array in read_policy(archive)[1].weights.items()}


def test_a_killed_trainer_says_by_what_and_takes_neither_its_nursery_nor_others_along(
    nursery: Nursery, tmp_path: Path
) -> None:
    killed, other = nursery.trainer(), nursery.trainer()
    os.kill(killed.pid, signal.SIGKILL)
    assert killed.wait(10.0)
    killed.close()
    assert killed.cause_of_death().startswith("The trainer process was killed by signal 9 (SIGKILL)")
    assert trained(other, job(tmp_path / "run"))[0][-1] == Ended("completed")


# Loaded by the nursery as `sitecustomize` is: each trainer starts a process, as libraries do.
_STARTS = """
import os, subprocess, threading
def start():
    timer = threading.Timer(0.2, subprocess.Popen, [["sleep", "600"]])
    timer.daemon = True
    timer.start()
os.register_at_fork(after_in_child=start)
"""


def test_what_a_trainer_has_started_is_killed_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keepers: Callable[[], NurseryKeeper]
) -> None:
    (tmp_path / "sitecustomize.py").write_text(_STARTS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    nursery = Nursery(keepers().door)
    try:
        nursery.until_ready(120.0)
        trainer = nursery.trainer()
        until(lambda: bool(psutil.Process(trainer.pid).children()))
        (started,) = psutil.Process(trainer.pid).children()
        trainer.close()
        until(lambda: not started.is_running())
    finally:
        nursery.close()


def test_a_trainer_stops_when_it_is_told_and_ends_where_nobody_is_left_to_tell(nursery: Nursery, tmp_path: Path) -> None:
    reports: list[Report] = []
    trainer = nursery.trainer()
    trainer.train(job(tmp_path / "run", steps=10_000_000), reports.append, lambda _: None)
    until(lambda: bool(reports))
    trainer.control(Control(stop=True, watch=None))
    assert trainer.wait(60.0)
    trainer.close()
    assert reports[-1] == Ended("stopped")


def test_what_nobody_expected_is_among_its_last_words(nursery: Nursery, tmp_path: Path) -> None:
    trainer = nursery.trainer()
    # No task sends such a job.
    reports, printed = trained(trainer, Job("{}", "three", str(tmp_path), None))  # type: ignore[arg-type]
    assert reports == []
    assert any("ValidationError" in line for line in printed)
    assert trainer.cause_of_death().startswith("The trainer process ended with status 1. It printed last:\nTraceback")


def test_where_its_nursery_is_killed_a_trainer_ends_too_and_the_next_comes_from_another(
    keepers: Callable[[], NurseryKeeper],
) -> None:
    door = keepers().door
    nursery = Nursery(door)
    nursery.until_ready(120.0)
    trainer = nursery.trainer()
    assert nursery.pid is not None
    os.kill(nursery.pid, signal.SIGKILL)
    assert trainer.wait(10.0)
    trainer.close()
    until(lambda: not psutil.pid_exists(trainer.pid), 10.0)
    assert "was killed by signal 9" in trainer.cause_of_death()
    with pytest.raises(OSError, match="has ended"):
        nursery.trainer()
    nursery.close()
    another = Nursery(door)
    another.until_ready(120.0)
    another.trainer().close()
    another.close()


def test_one_nursery_has_the_trainers_of_all_and_who_leaves_takes_only_its_own_along(
    nursery: Nursery, nursery_door: int, tmp_path: Path
) -> None:
    leaving = Nursery(nursery_door)
    leaving.until_ready(120.0)
    assert leaving.pid == nursery.pid
    stays, goes = nursery.trainer(), leaving.trainer()
    leaving.close()
    until(lambda: not psutil.pid_exists(goes.pid), 10.0)
    assert goes.wait(0.0)
    goes.close()
    assert trained(stays, job(tmp_path / "run"))[0][-1] == Ended("completed")


def test_a_slot_that_is_killed_leaves_no_trainer_behind(nursery: Nursery, nursery_door: int) -> None:
    script = (
        "import sys, time; from workers.runtime.nursery import Nursery\n"
        "nursery = Nursery(int(sys.argv[1])); nursery.until_ready(120.0)\n"
        "print(nursery.trainer().pid, flush=True); time.sleep(600)"
    )
    slot = subprocess.Popen(
        [sys.executable, "-c", script, str(nursery_door)], pass_fds=(nursery_door,), stdout=subprocess.PIPE, text=True
    )
    assert slot.stdout is not None
    trainer = int(slot.stdout.readline())
    until(lambda: psutil.Process(trainer).name() == "mapless-trainer")
    slot.kill()
    slot.wait()
    slot.stdout.close()
    until(lambda: not psutil.pid_exists(trainer), 10.0)


def test_a_job_comes_from_there_too_and_says_what_was_wrong(nursery_door: int, tmp_path: Path) -> None:
    forks = Forks(nursery_door)
    process, pipe = forks.begin(Task("{}", str(tmp_path), ahead=False))
    with pipe:
        said = pipe.recv()
        assert isinstance(said, Failed)
        assert process.wait(10.0)
    assert process.status == 0
    forks.close()


def test_a_job_is_killed_with_what_it_starts_and_makes_way_for_others_as_it_says(nursery: Nursery) -> None:
    ours, theirs = Pipe()
    with ours, theirs:
        waits = nursery.job(theirs)
        until(lambda: os.getpgid(waits.pid) == waits.pid)
        # The session of who began it: Linux shares cores among sessions, and niceness counts within one.
        assert os.getsid(waits.pid) == os.getsid(0)
        waits.kill()
        assert waits.wait(10.0)
    assert waits.status == -signal.SIGKILL


def test_many_begin_and_end_at_once(nursery: Nursery, tmp_path: Path) -> None:
    ends: list[Report] = []

    def one(number: int) -> None:
        ends.append(trained(nursery.trainer(), job(tmp_path / f"run{number}"))[0][-1])

    threads = [threading.Thread(target=one, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert ends == [Ended("completed")] * 6
