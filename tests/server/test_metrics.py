"""Curves: appended once, compacted without loss, cut back to a checkpoint, downsampled without losing extremes."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import pytest
from alembic import command
from fastapi.testclient import TestClient
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import delete, event, func, select

from server.database import tables
from server.database.engine import Database
from server.database.migrate import migration_config
from server.metrics.buckets import MAX_BUCKETS, SUMMARY_WIDTH, Buckets
from server.metrics.points import Axis, Points
from server.metrics.repository import MetricRepository, PackedSeries, ReportedRow
from server.metrics.service import json_numbers
from server.services import Services


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    """Each database that the service runs on, with one run in it."""
    database = Database(database_url)
    with database.write() as session:
        session.add(tables.Experiment(id="e", name="e", training={}, runs=[tables.Run(id="r", seed=0)]))
    yield database
    database.dispose()


def rows(*steps: int, first_seq: int = 1, name: str = "loss/policy") -> list[ReportedRow]:
    """One row a step, whose value is the step's negative."""
    return [ReportedRow(first_seq + i, step, 1_000.0 + step, {name: -float(step)}) for i, step in enumerate(steps)]


def append(database: Database, new: list[ReportedRow]) -> None:
    """What the link does with a batch: rows and cursor in one transaction."""
    with database.write() as session:
        run = session.get_one(tables.Run, "r")
        MetricRepository(session).append({"r": [row for row in new if row.seq > run.last_seq]})
        run.last_seq = max(run.last_seq, *(row.seq for row in new))


def compact(database: Database) -> None:
    with database.write() as session:
        MetricRepository(session).compact("r")


def drop_beyond(database: Database, step: int) -> None:
    with database.write() as session:
        MetricRepository(session).drop_beyond("r", step)


def steps(database: Database, name: str = "loss/policy") -> list[int]:
    with database.read() as session:
        found = MetricRepository(session).read("r").get(name, Points.joined([]))
    assert found.values.tolist() == [-float(step) for step in found.steps]
    assert found.times.tolist() == [1_000.0 + step for step in found.steps]
    return [int(step) for step in found.steps]


def latest(database: Database) -> dict[str, tuple[int, float]]:
    with database.read() as session:
        return {metric.name: (metric.step, metric.value) for metric in session.query(tables.LatestMetric)}


def test_rows_are_there_once_however_often_they_come(database: Database) -> None:
    append(database, rows(10, 20, 30))
    append(database, rows(10, 20, 30, 40))

    assert steps(database) == [10, 20, 30, 40]
    assert latest(database) == {"loss/policy": (40, -40.0)}


def test_rows_that_were_compacted_do_not_come_back(database: Database) -> None:
    append(database, rows(10, 20, 30))
    compact(database)
    append(database, rows(10, 20, 30, 40))

    assert steps(database) == [10, 20, 30, 40]


def test_compaction_leaves_the_curve_as_it_was(database: Database) -> None:
    append(database, [*rows(1, 2, 3), *rows(3, first_seq=4, name="eval/steps")])
    compact(database)
    append(database, [*rows(4, first_seq=5), *rows(4, first_seq=6, name="eval/steps")])
    compact(database)

    assert steps(database) == [1, 2, 3, 4]
    assert steps(database, "eval/steps") == [3, 4]
    with database.read() as session:
        # A chunk that is not full is grown: rare series don't end in chunks of one point.
        assert session.query(tables.MetricChunk).count() == 2
        assert session.query(tables.MetricRow).count() == 0


def test_a_chunk_that_is_full_is_followed_by_another(database: Database) -> None:
    append(database, rows(*range(1, 9_001)))
    compact(database)
    append(database, rows(9_001, first_seq=9_001))
    compact(database)

    assert steps(database) == list(range(1, 9_002))
    with database.read() as session:
        assert sorted(count for (count,) in session.query(tables.MetricChunk.count)) == [809, 8_192]


def together(first: int, last: int) -> list[ReportedRow]:
    """Rows of three series, the third of which is rare."""
    return [
        ReportedRow(
            step,
            step,
            1_000.0 + step / 3,
            {"a": step / 7, "b": -1.0 / step} | ({"rare": math.sqrt(step)} if step % 50 == 0 else {}),
        )
        for step in range(first, last + 1)
    ]


def axes(database: Database) -> int:
    with database.read() as session:
        return session.query(tables.MetricAxis).count()


def same(database: Database, last: int) -> None:
    """Every point is as it was reported, bit for bit."""
    with database.read() as session:
        found = MetricRepository(session).read("r")
    for name in ("a", "b", "rare"):
        wanted = [row for row in together(1, last) if name in row.values]
        expected = Points.of(
            [row.step for row in wanted], [row.wall_time for row in wanted], [row.values[name] for row in wanted]
        )
        assert np.array_equal(found[name].steps, expected.steps)
        assert found[name].times.tobytes() == expected.times.tobytes()
        assert found[name].values.tobytes() == expected.values.tobytes()


def test_series_that_are_reported_together_share_their_steps_and_times(database: Database) -> None:
    for first in range(1, 9_001, 500):
        append(database, together(first, first + 499))
        compact(database)
        same(database, first + 499)
    # Two chunks of the first two series, one of the third; what grew has left nothing behind.
    assert axes(database) == 3
    drop_beyond(database, 8_500)
    same(database, 8_500)
    assert axes(database) == 3
    drop_beyond(database, 4_000)
    same(database, 4_000)
    assert axes(database) == 2
    with database.write() as session:
        session.execute(delete(tables.Experiment))
    assert axes(database) == 0


def test_where_points_lie_is_unpacked_once_and_nobody_changes_it(database: Database) -> None:
    append(database, together(1, 300))
    compact(database)
    read = []
    for name in ("a", "b"):
        with database.read() as session:
            read.append(MetricRepository(session).read("r")[name].steps)
    assert read[0].base is not None
    assert read[0].base is read[1].base
    with pytest.raises(ValueError, match="read-only"):
        read[0][0] = 7


def test_points_of_a_database_from_before_axes_are_read_and_grown(database: Database) -> None:
    config = migration_config(database)
    append(database, together(1, 700))
    compact(database)
    append(database, together(701, 900))
    # Back and up again: what was there before the migration has its steps and times in its chunks.
    command.downgrade(config, "0018")
    command.upgrade(config, "head")
    assert axes(database) == 0
    same(database, 900)
    drop_beyond(database, 650)
    same(database, 650)
    append(database, [dataclasses.replace(row, seq=row.seq + 1_000) for row in together(651, 800)])
    compact(database)
    same(database, 800)
    assert axes(database) == 2


def test_rates_take_three_and_a_half_bytes_a_point_with_their_summaries(database: Database) -> None:
    random, count, names = np.random.default_rng(0), 50_000, [f"s{index}" for index in range(20)]
    steps = np.arange(1, count + 1, dtype=np.int64) * 512
    times = 1.7e9 + np.cumsum(random.gamma(20.0, 0.035, count))
    walks = 0.5 + 0.4 * np.tanh(np.cumsum(random.standard_normal((20, count)), axis=1) / math.sqrt(count))
    values = (walks + 0.05 * random.standard_normal((20, count))).astype(np.float32)
    with database.write() as session:
        repository = MetricRepository(session)
        repository.add_series("r", {name: Points(steps, times, values[at]) for at, name in enumerate(names)})
        session.flush()
        stored = sum(
            session.scalar(select(func.sum(func.length(column)))) or 0
            for column in (tables.MetricChunk.points, tables.MetricAxis.data, tables.MetricSummary.data)
        )
        read = repository.read("r")
    assert stored / (20 * count) < 3.5
    for at, name in enumerate(names):
        assert read[name].values.tobytes() == values[at].tobytes()
        assert read[name].times.tobytes() == times.tobytes()


@pytest.mark.parametrize("compacted", [False, True])
@pytest.mark.parametrize(("cut", "left"), [(25, [10, 20]), (20, [10, 20]), (9, []), (99, [10, 20, 30])])
def test_what_a_lost_attempt_did_beyond_its_checkpoint_is_dropped(
    database: Database, compacted: bool, cut: int, left: list[int]
) -> None:
    append(database, rows(10, 20, 30))
    if compacted:
        compact(database)
    drop_beyond(database, cut)

    assert steps(database) == left
    assert latest(database) == ({"loss/policy": (left[-1], -float(left[-1]))} if left else {})


def test_a_cut_costs_the_same_however_long_the_run_is(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = np.arange(1, 50_001, dtype=np.int64)
    values = np.linspace(0.0, 1.0, steps.size, dtype=np.float32)
    series = {name: Points(steps, steps.astype(float), values) for name in ("a", "b")}
    gone = {"gone": Points(steps[-10:], steps[-10:].astype(float), values[-10:])}
    rare = {"rare": Points(steps[:1], steps[:1].astype(float), np.array([7.0], np.float32))}
    with database.write() as session:
        MetricRepository(session).add_series("r", series | gone | rare)
    decoded: list[int] = []
    decode = Points.decode_parts.__func__  # type: ignore[attr-defined]

    def counted(cls: type[Points], axis: Any, packed: bytes, count: int) -> Points:
        decoded.append(count)
        return cast("Points", decode(cls, axis, packed, count))

    monkeypatch.setattr(Points, "decode_parts", classmethod(counted))
    with database.write() as session:
        MetricRepository(session).drop_beyond("r", 45_000)
    monkeypatch.undo()

    # Of 13 chunks of each series the one that is cut, and once more as the last that is left.
    assert 2 <= len(decoded) <= 4
    with database.read() as session:
        latest = {row.name: (row.step, row.value) for row in session.query(tables.LatestMetric)}
        left = MetricRepository(session).read("r")
    assert latest == {
        "a": (45_000, pytest.approx(0.9, abs=1e-3)),
        "b": (45_000, pytest.approx(0.9, abs=1e-3)),
        "rare": (1, 7),
    }
    assert {name: len(points) for name, points in left.items()} == {"a": 45_000, "b": 45_000, "rare": 1}
    assert np.array_equal(left["a"].values, values[:45_000])


def add(database: Database, first: int, last: int, seed: int = 0) -> None:
    """Points of the steps from `first` to `last`, each once."""
    steps = np.arange(first, last + 1, dtype=np.int64)
    values = np.random.default_rng(seed).normal(size=steps.size).astype(np.float32)
    with database.write() as session:
        MetricRepository(session).add_series("r", {"a": Points(steps, steps.astype(float), values)})


def agrees(database: Database) -> None:
    """The curve that is read from the summary says of every point what the points say."""
    with database.read() as session:
        repository = MetricRepository(session)
        points = repository.read("r")["a"]
        curve = repository.curves(["r"], None, 600)["r"]["a"]
    assert len(curve) <= 600
    assert int(curve.sizes.sum()) == len(points)
    assert (np.diff(curve.steps) > 0).all()
    ends = np.cumsum(curve.sizes)
    assert curve.steps.tolist() == points.steps[ends - 1].tolist()
    parts = np.split(points.values.astype(np.float64), ends[:-1])
    assert curve.low.tolist() == [part.min() for part in parts]
    assert curve.high.tolist() == [part.max() for part in parts]
    assert curve.mean == pytest.approx(np.array([part.mean() for part in parts]), rel=1e-5, abs=1e-6)
    assert (curve.steps[-1], curve.mean[-1]) == (points.steps[-1], points.values[-1])


def test_a_long_curve_is_read_from_its_summary_as_the_points_say(database: Database) -> None:
    add(database, 1, 30_000)
    agrees(database)
    for first in range(30_001, 36_000, 700):
        add(database, first, first + 699, seed=first)
    agrees(database)
    append(database, rows(40_000, 40_001, name="a"))
    agrees(database)
    compact(database)
    agrees(database)
    # A lost attempt's points go, in the middle of a bucket and of a chunk, and others follow.
    with database.write() as session:
        MetricRepository(session).drop_beyond("r", 21_777)
    agrees(database)
    add(database, 21_778, 23_000, seed=3)
    agrees(database)
    # What comes late is counted where it belongs.
    add(database, 22_990, 24_000, seed=4)
    agrees(database)
    with database.write() as session:
        MetricRepository(session).drop_beyond("r", -1)
    add(database, 1, 9_000)
    agrees(database)


def test_what_is_packed_before_the_database_is_held_is_what_would_be_written(database: Database) -> None:
    steps = np.arange(1, 10_001, dtype=np.int64)
    values = np.random.default_rng(0).normal(size=steps.size).astype(np.float32)
    points = Points(steps, steps / 3, values)
    series = {"a": points, "b": points[:5_000], "rare": points[::50]}
    kinds = (tables.MetricAxis, tables.MetricChunk, tables.MetricSummary, tables.LatestMetric)

    def written() -> list[list[dict[str, Any]]]:
        with database.read() as session:
            rows = [[dict(row) for row in session.execute(select(*kind.__table__.columns)).mappings()] for kind in kinds]
        return [sorted(each, key=str) for each in rows]

    with database.write() as session:
        MetricRepository(session).add_series("r", series)
    one_by_one = written()
    with database.write() as session:
        for kind in kinds:
            session.execute(delete(kind))
    with database.write() as session:
        MetricRepository(session).add_packed("r", PackedSeries.of("r", series))
    assert written() == one_by_one


def test_looking_at_a_curve_costs_the_same_however_long_the_run_is(database: Database) -> None:
    add(database, 1, 200_000)
    add(database, 200_001, 200_100)
    loaded: list[int] = []

    def load(chunk: tables.MetricChunk, _context: object) -> None:
        loaded.append(chunk.count)

    event.listen(tables.MetricChunk, "load", load)
    try:
        with database.read() as session:
            curves = MetricRepository(session).curves(["r"], ["a"], SUMMARY_WIDTH)
    finally:
        event.remove(tables.MetricChunk, "load", load)
    assert loaded == []
    assert SUMMARY_WIDTH / 2 < len(curves["r"]["a"]) <= SUMMARY_WIDTH
    with database.read() as session:
        (summary,) = session.query(tables.MetricSummary)
        assert MAX_BUCKETS / 2 < summary.buckets <= MAX_BUCKETS
        chunks = session.query(tables.MetricChunk)
        assert len(summary.data) < 0.05 * sum(len(chunk.points) for chunk in chunks)


def test_a_curve_of_an_older_database_has_no_summary_and_is_read_all_the_same(database: Database) -> None:
    add(database, 1, 10_000)
    with database.write() as session:
        session.query(tables.MetricSummary).delete()
    agrees(database)
    add(database, 10_001, 13_000, seed=1)
    agrees(database)


def test_many_runs_are_read_in_three_queries(database: Database) -> None:
    with database.write() as session:
        experiment = tables.Experiment(id="many", name="many", training={})
        experiment.runs = [tables.Run(id=f"m{seed}", seed=seed) for seed in range(30)]
        session.add(experiment)
        session.flush()
        for run in experiment.runs:
            repository = MetricRepository(session)
            repository.append({run.id: [ReportedRow(1, 10, 0.0, {"a": 1.0, "b": 2.0})]})
            repository.compact(run.id)
            repository.append({run.id: [ReportedRow(2, 20, 0.0, {"a": float(run.seed)})]})
    asked: list[str] = []

    @event.listens_for(database.engine, "before_cursor_execute")
    def _(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        asked.append(statement)

    with database.read() as session:
        read = MetricRepository(session).read_many([f"m{seed}" for seed in range(30)], ["a"])
    assert len([query for query in asked if query.startswith("SELECT")]) == 3
    assert {run_id: series["a"].values.tolist() for run_id, series in read.items()} == {
        f"m{seed}": [1.0, float(seed)] for seed in range(30)
    }


def test_the_next_attempt_continues_where_the_lost_one_was_cut(database: Database) -> None:
    append(database, rows(10, 20, 30))
    compact(database)
    drop_beyond(database, 20)
    append(database, rows(25, 35, first_seq=4))
    compact(database)

    assert steps(database) == [10, 20, 25, 35]


def test_values_that_are_not_finite_are_gaps(database: Database) -> None:
    append(database, [ReportedRow(1, 1, 0.0, {"x": 1.0}), ReportedRow(2, 2, 0.0, {"x": math.nan, "y": math.inf})])
    for _ in range(2):
        with database.read() as session:
            series = MetricRepository(session).read("r")
        assert np.isnan(series["x"].values).tolist() == [False, True]
        assert np.isnan(series["y"].values).tolist() == [True]
        compact(database)
    assert latest(database) == {"x": (1, 1.0)}


points_strategy = st.lists(
    st.tuples(st.integers(0, 2**40), st.floats(0, 2e9), st.floats(width=32, allow_nan=False, allow_infinity=False)),
    unique_by=lambda point: point[0],
    max_size=300,
).map(sorted)


@given(points_strategy)
def test_a_chunk_gives_back_exactly_what_was_put_in(points: list[tuple[int, float, float]]) -> None:
    original = Points.of([p[0] for p in points], [p[1] for p in points], [p[2] for p in points])
    decoded = Points.decode(original.encode(), len(points))

    assert decoded.steps.tolist() == [p[0] for p in points]
    assert decoded.times.tolist() == [p[1] for p in points]
    assert decoded.values.tolist() == [p[2] for p in points]
    parts = Points.decode_parts(Axis.decode(original.encode_axis()), original.encode_values(), len(points))
    for again in (decoded, parts):
        assert again.steps.tobytes() == original.steps.tobytes()
        assert again.times.tobytes() == original.times.tobytes()
        assert again.values.tobytes() == original.values.tobytes()


def test_of_several_values_at_one_step_the_last_counts() -> None:
    points = Points.of([1, 2, 2, 3], [0, 0, 0, 0], [1, 2, 9, 3])

    assert points.steps.tolist() == [1, 2, 3]
    assert points.values.tolist() == [1, 9, 3]


@given(points_strategy, st.integers(2, 50))
def test_downsampling_keeps_extremes_ends_and_order(points: list[tuple[int, float, float]], limit: int) -> None:
    original = Points.of([p[0] for p in points], [p[1] for p in points], [p[2] for p in points])
    cut = Buckets.of(original).cut(limit)

    if len(points) <= limit:
        assert cut.single
        assert cut.mean.tolist() == original.values.tolist()
        return
    assert cut.steps.size == limit
    assert (np.diff(cut.steps) > 0).all()
    assert cut.low.min() == original.values.min()
    assert cut.high.max() == original.values.max()
    assert (cut.low <= cut.mean).all()
    assert (cut.mean <= cut.high).all()
    # The newest point stands alone, so that the end of a curve is what the run's page says in figures.
    assert (cut.steps[-1], cut.mean[-1]) == (original.steps[-1], original.values[-1])


def test_downsampling_worked_by_hand() -> None:
    cut = Buckets.of(Points.of([1, 2, 3, 4, 5], [0] * 5, [1, 3, 5, math.nan, 2])).cut(3)

    # Two buckets of two and the newest point.
    assert cut.steps.tolist() == [2, 4, 5]
    assert cut.mean.tolist() == [2, 5, 2]
    assert cut.low.tolist() == [1, 5, 2]
    assert cut.high.tolist() == [3, 5, 2]


def run_of(client: TestClient) -> str:
    run_id: str = client.post("/api/experiments", json={}).json()["runs"][0]["id"]
    return run_id


def test_the_steps_of_buckets_are_read_without_the_rest() -> None:
    buckets = Buckets.of(Points.of([2, 3, 5, 8, 13], [0] * 5, [1, 3, 5, math.nan, 2]))
    encoded = buckets.encode()
    for count in range(6):
        assert Buckets.steps_in(encoded, count).tolist() == [2, 3, 5, 8, 13][:count]
    with pytest.raises(ValueError, match="not the steps"):
        Buckets.steps_in(encoded, 1_000)


def test_a_runs_curves_over_http(client: TestClient, services: Services) -> None:
    run_id = run_of(client)
    with services.database.write() as session:
        reported = [ReportedRow(i, i * 10, 0.0, {"train/return": i / 4, "loss/value": math.nan}) for i in range(1, 6)]
        MetricRepository(session).append({run_id: reported})

    everything = client.get(f"/api/runs/{run_id}/metrics").json()["series"]
    assert [series["name"] for series in everything] == ["loss/value", "train/return"]
    assert everything[0]["values"] == [None] * 5
    assert everything[1]["steps"] == [10, 20, 30, 40, 50]
    assert everything[1]["values"] == [0.25, 0.5, 0.75, 1.0, 1.25]
    assert everything[1]["min"] is None

    (narrow,) = client.get(f"/api/runs/{run_id}/metrics", params={"names": "train/return", "points": 2}).json()["series"]
    assert narrow == {
        "name": "train/return",
        "steps": [40, 50],
        "values": [0.625, 1.25],
        "min": [0.25, 1.25],
        "max": [1.0, 1.25],
    }
    nothing = client.get(f"/api/runs/{run_id}/metrics", params={"names": "nothing"}).json()
    assert nothing == {"series": [], "attempt": 0, "thinned": None, "since": None}


def test_who_follows_a_run_is_told_what_is_new(client: TestClient, services: Services) -> None:
    run_id = run_of(client)

    def report(first: int, last: int, *, compacted: bool = False) -> None:
        with services.database.write() as session:
            # An evaluation comes with a step of which something was reported before.
            reported = [ReportedRow(2 * i, i * 10, 0.0, {"a": float(i)}) for i in range(first, last + 1)]
            reported += [ReportedRow(2 * last + 1, last * 10, 0.0, {"rare": float(last)})]
            MetricRepository(session).append({run_id: reported})
            run = session.get_one(tables.Run, run_id)
            run.attempt, run.step, run.last_seq = 1, last * 10, 2 * last + 1
            if compacted:
                MetricRepository(session).compact(run_id)

    def ask(since: int, attempt: int = 1) -> Any:
        params = {"since": since, "attempt": attempt, "points": 100}
        return client.get(f"/api/runs/{run_id}/metrics", params=params).raise_for_status().json()

    def told(since: int) -> dict[str, list[int]]:
        answer = ask(since)
        assert (answer["since"], answer["attempt"]) == (since, 1)
        return {series["name"]: series["steps"] for series in answer["series"]}

    report(1, 5)
    assert told(30) == {"a": [30, 40, 50], "rare": [50]}
    report(6, 8)
    assert told(50) == {"a": [50, 60, 70, 80], "rare": [50, 80]}
    report(9, 10, compacted=True)
    assert told(80) == {"a": [80, 90, 100], "rare": [80, 100]}
    report(11, 11)
    assert told(90) == {"a": [90, 100, 110], "rare": [100, 110]}
    assert told(110) == {"a": [110], "rare": [110]}
    # Much that is new comes as a curve does: at the width that was asked for.
    report(12, 400)
    (series, _) = ask(110)["series"]
    assert len(series["steps"]) == 100
    assert (series["steps"][-1], series["max"][-1]) == (4_000, 400.0)

    # What another attempt has dropped is not known any more, nor what lies beyond the step that a run was taken back to.
    for since, attempt in ((110, 0), (5_000, 1)):
        whole = ask(since, attempt)
        assert whole["since"] is None
        assert whole["series"][0]["steps"][0] <= 40


def test_who_knows_little_of_a_long_run_is_told_all_of_it(client: TestClient, services: Services) -> None:
    run_id = run_of(client)
    steps = np.arange(1, 20_001, dtype=np.int64)
    with services.database.write() as session:
        points = Points(steps, steps.astype(float), steps.astype(np.float32))
        MetricRepository(session).add_series(run_id, {"a": points})
        session.get_one(tables.Run, run_id).step = 20_000

    told = client.get(f"/api/runs/{run_id}/metrics", params={"since": 7, "attempt": 0, "points": 50}).json()
    assert told["since"] is None
    assert len(told["series"][0]["steps"]) == 50
    told = client.get(f"/api/runs/{run_id}/metrics", params={"since": 19_999, "attempt": 0}).json()
    assert told["since"] == 19_999
    assert told["series"][0]["steps"] == [19_999, 20_000]


def test_curves_of_no_run_and_in_no_width(client: TestClient) -> None:
    assert client.get("/api/runs/nobody/metrics").status_code == 404
    assert client.get(f"/api/runs/{run_of(client)}/metrics", params={"points": 1}).status_code == 422


@given(st.lists(st.floats(width=32), max_size=30))
def test_numbers_are_rounded_as_they_would_be_written(values: list[float]) -> None:
    written = [float(f"{value:.7g}") if math.isfinite(value) else None for value in values]
    for number, as_written in zip(json_numbers(np.array(values)), written, strict=True):
        # Of a number that lies halfway between two, either is right.
        assert number == as_written or (number is not None and number == pytest.approx(as_written, rel=2e-7))


def test_figures_have_the_seven_digits_that_are_kept(client: TestClient, services: Services) -> None:
    run_id = run_of(client)
    with services.database.write() as session:
        MetricRepository(session).append({run_id: [ReportedRow(1, 10, 0.0, {"x": 0.1})]})

    assert client.get(f"/api/runs/{run_id}/metrics").json()["series"][0]["values"] == [0.1]
