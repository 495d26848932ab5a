"""The proof of the chaos benchmark, against databases in which something is wrong on purpose: it must see all of it."""

import hashlib
import math
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from shutil import copyfile

import numpy as np
import pytest
from sqlalchemy import delete, select

from benchmarks.chaos.progress import Progress
from benchmarks.chaos.proof import Proof, Verdict, compare
from benchmarks.chaos.recorder import Attempt, Recorder
from benchmarks.chaos.recovery import Recovery
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.database.engine import Database
from server.files import StoredFile
from server.metrics.repository import MetricRepository, ReportedRow
from workers.checkpoints import read_checkpoint, write_checkpoint
from workers.runtime.spool import Spool

RUN, REFERENCE = "run", "reference"


def item(seq: int, step: int, value: float | None = 0.5) -> dict[str, object]:
    return {"kind": "metrics", "seq": seq, "step": step, "at": 100.0 + seq, "values": {"a": value, "b": 1.5}}


def said(seq: int, step: int, message: str) -> dict[str, object]:
    return {"kind": "event", "seq": seq, "step": step, "at": 100.0 + seq, "level": "info", "message": message}


# Attempt 1 reports steps 10, 20 and 30 and is lost; attempt 2 goes on from the checkpoint of step 20 and reports 30 and 40.
# So 10 and 20 of the first count, and 30 and 40 of the second: four items of two numbers.
ATTEMPTS = [
    Attempt(1, (item(1, 10), said(2, 10, "early"), item(3, 20), item(4, 30, 7.0), said(5, 30, "late"))),
    Attempt(2, (item(4, 30), item(5, 40, None))),
]


@pytest.fixture
def database(tmp_path: Path, new_database: Path) -> Iterator[Database]:
    """What the service would have stored of `ATTEMPTS`."""
    database = Database(f"sqlite:///{shutil.copy(new_database, tmp_path)}")
    with database.write() as session:
        session.add(tables.Experiment(id="e", name="e", training={}))
        for run_id in (RUN, REFERENCE):
            session.add(tables.Run(id=run_id, experiment_id="e", seed=0, state="completed"))
        session.flush()
        for message in ("Attempt 1 begins from the start on w.", "Attempt 2 begins from step 20 on w."):
            session.add(tables.RunEvent(run_id=RUN, level="info", message=message))
        session.add(tables.RunEvent(run_id=RUN, at=102.0, step=10, level="info", message="early"))
        stored = ((1, 10, 0.5), (3, 20, 0.5), (4, 30, 0.5), (5, 40, math.nan))
        rows = [ReportedRow(seq, step, 100.0 + seq, {"a": value, "b": 1.5}) for seq, step, value in stored]
        metrics = MetricRepository(session)
        metrics.append({RUN: rows[:2]})
        metrics.compact(RUN)  # half of them as chunks, half as rows
        metrics.append({RUN: rows[2:]})
    yield database
    database.dispose()


@pytest.fixture
def check(tmp_path: Path, database: Database, make_checkpoint: Callable[..., Path]) -> Callable[[], Verdict]:
    """Compares the run with what was spooled, and its only checkpoint with an undisturbed run's, which is the same."""
    archive = make_checkpoint()
    (tmp_path / "archives").mkdir()
    sha256 = hashlib.sha256(archive.read_bytes()).hexdigest()
    with database.write() as session:
        for run_id in (RUN, REFERENCE):
            copyfile(archive, tmp_path / "archives" / f"{run_id}c.zip")
            CheckpointRepository(session).add(run_id, 40, StoredFile(f"{run_id}c", archive.stat().st_size, sha256), None)

    def checked() -> Verdict:
        proof = Proof(f"sqlite:///{tmp_path / 'mapless.db'}", tmp_path / "archives", {RUN: ATTEMPTS}, set())
        proof.check(RUN, REFERENCE)
        proof.close()
        return proof.verdict

    return checked


def test_what_was_stored_as_it_was_said_is_found_whole(check: Callable[[], Verdict]) -> None:
    assert check() == Verdict(points=8, events=1, checkpoints=1, runs=1)


def test_a_lost_row_is_missed(check: Callable[[], Verdict], database: Database) -> None:
    with database.write() as session:
        session.execute(delete(tables.MetricRow).where(tables.MetricRow.step == 30))
    verdict = check()
    assert (verdict.lost, verdict.doubled, verdict.altered) == (2, 0, 0)


def test_a_lost_chunk_is_missed(check: Callable[[], Verdict], database: Database) -> None:
    with database.write() as session:
        session.execute(delete(tables.MetricChunk).where(tables.MetricChunk.name == "a"))
    assert check().lost == 2


def test_a_row_that_is_there_twice_is_seen(check: Callable[[], Verdict], database: Database) -> None:
    with database.write() as session:
        session.add(tables.MetricRow(run_id=RUN, seq=6, step=40, wall_time=105.0, values={"a": None, "b": 1.5}))
    verdict = check()
    assert (verdict.lost, verdict.doubled, verdict.altered) == (0, 2, 0)


def test_a_row_that_a_lost_attempt_left_behind_is_seen(check: Callable[[], Verdict], database: Database) -> None:
    with database.write() as session:
        session.add(tables.MetricRow(run_id=RUN, seq=6, step=30, wall_time=104.0, values={"a": 7.0}))
    assert check().doubled == 1


@pytest.mark.parametrize("change", [{"values": {"a": 0.5000001, "b": 1.5}}, {"wall_time": 104.5}])
def test_a_value_or_a_time_that_differs_is_seen(
    check: Callable[[], Verdict], database: Database, change: dict[str, object]
) -> None:
    with database.write() as session:
        row = session.scalars(select(tables.MetricRow).where(tables.MetricRow.step == 30)).one()
        for name, value in change.items():
            setattr(row, name, value)
    verdict = check()
    assert (verdict.lost, verdict.doubled) == (0, 0)
    assert verdict.altered == (1 if "values" in change else 2)


def test_a_line_of_the_log_that_is_missing_or_there_twice_is_seen(check: Callable[[], Verdict], database: Database) -> None:
    with database.write() as session:
        session.add(tables.RunEvent(run_id=RUN, at=102.0, step=10, level="info", message="early"))
    assert check().events_wrong == 1
    with database.write() as session:
        session.execute(delete(tables.RunEvent).where(tables.RunEvent.message == "early"))
    assert check().events_wrong == 1


def test_a_torn_archive_is_seen(check: Callable[[], Verdict], tmp_path: Path) -> None:
    archive = tmp_path / "archives" / f"{RUN}c.zip"
    archive.write_bytes(archive.read_bytes()[:-100])
    verdict = check()
    assert (verdict.torn, verdict.differing) == (1, [RUN])


def test_one_bit_of_one_weight_is_seen(check: Callable[[], Verdict], tmp_path: Path) -> None:
    archive = tmp_path / "archives" / f"{RUN}c.zip"
    checkpoint = read_checkpoint(archive)
    name = next(iter(checkpoint.weights))
    checkpoint.weights[name].flat[0] = np.nextafter(checkpoint.weights[name].flat[0], np.float32(np.inf))
    write_checkpoint(archive, checkpoint)
    assert check().differing == [RUN]


def test_equal_points_are_counted_not_merged() -> None:
    point, other = ("a", 10, b"x"), ("a", 10, b"y")
    verdict = Verdict()
    compare(Counter({point: 1}), Counter({point: 1, other: 1}), verdict)
    compare(Counter({point: 2}), Counter({point: 1, other: 1}), verdict)
    compare(Counter({point: 1}), Counter(), verdict)
    assert (verdict.points, verdict.doubled, verdict.altered, verdict.lost) == (4, 1, 1, 1)


def test_a_recorder_keeps_what_a_worker_removes_and_what_is_damaged(tmp_path: Path) -> None:
    recorder = Recorder([tmp_path])
    directory = tmp_path / "work" / "77-abc-2"
    directory.mkdir()
    spool = Spool(directory / "spool.jsonl", 4)
    spool.metrics(10, 1.0, {"a": 0.5})
    spool.metrics(20, 2.0, {"a": math.nan})
    recorded = tmp_path / "recorded" / "77-abc-2.jsonl"
    while not recorded.exists():
        pass
    recorder.keep(directory / "spool.jsonl")
    with (directory / "spool.jsonl").open("r+b") as file:
        file.write(b"\0" * 20)
    spool.close()
    (directory / "spool.jsonl").unlink()
    recorder.close()
    (attempt,) = recorder.attempts()["abc"]
    assert attempt.number == 2
    assert [(entry["seq"], entry["values"]) for entry in attempt.items] == [(5, {"a": 0.5}), (6, {"a": None})]


def test_a_spool_that_was_not_recorded_whole_proves_nothing(tmp_path: Path) -> None:
    recorder = Recorder([tmp_path])
    recorder.close()
    spool = Spool(tmp_path / "recorded" / "77-abc-1.jsonl", 0)
    for step in (10, 20, 30):
        spool.metrics(step, 1.0, {"a": 0.5})
    spool.close()
    first, second, third = (tmp_path / "recorded" / "77-abc-1.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "recorded" / "77-abc-1.jsonl").write_bytes(first + second.replace(b"0.5", b"0.6") + third)
    with pytest.raises(RuntimeError, match="attempt 1 of run abc"):
        recorder.attempts()


def test_an_attempt_ends_at_the_line_that_was_torn_on_purpose_with_what_was_written_onto_it(tmp_path: Path) -> None:
    recorder = Recorder([tmp_path])
    recorder.close()
    recorded = tmp_path / "recorded" / "77-abc-1.jsonl"
    spool = Spool(recorded, 0)
    for step in (10, 20, 30, 40):
        spool.metrics(step, 1.0, {"a": 0.5})
    spool.close()
    first, second, third, fourth = recorded.read_bytes().splitlines(keepends=True)
    recorded.with_suffix(".kept").write_bytes(first + second)
    recorded.write_bytes(first + second[: len(second) // 2] + third + fourth)
    (attempt,) = recorder.attempts()["abc"]
    assert [entry["step"] for entry in attempt.items] == [10, 20]


def row(state: str, attempt: int, last_seq: int) -> Progress:
    return Progress(state=state, attempt=attempt, last_seq=last_seq, step=0, losses=0, worker=None)


def test_a_run_has_recovered_when_something_new_is_in_the_database() -> None:
    cut = Recovery(row("running", 1, 10), new_attempt=False, begun_at=0.0)
    assert not cut.look(row("running", 1, 10))
    assert cut.look(row("running", 1, 11))


def test_what_a_lost_attempt_had_on_its_way_is_no_recovery() -> None:
    killed = Recovery(row("running", 1, 10), new_attempt=True, begun_at=0.0)
    assert not killed.look(row("running", 1, 12))
    assert not killed.look(row("queued", 1, 12))
    assert not killed.look(row("running", 2, 12))
    assert killed.look(row("running", 2, 13))


def test_a_run_that_is_completed_has_recovered() -> None:
    assert Recovery(row("running", 1, 10), new_attempt=True, begun_at=0.0).look(row("completed", 1, 14))
