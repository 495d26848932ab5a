"""Series that are looked at again grow by what was reported since, and are what a first look shows."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from server.database import tables
from server.database.engine import Database
from server.metrics.buckets import MAX_BUCKETS, Buckets
from server.metrics.kept import KeptSeries
from server.metrics.repository import MetricRepository, ReportedRow
from server.runs.repository import RunRepository

EVERY_FIELD = ("steps", "sizes", "finite", "low", "mean", "high")


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory, new_database: Path) -> Path:
    """A database with one run in it."""
    path = tmp_path_factory.mktemp("kept") / "one.db"
    shutil.copy(new_database, path)
    database = Database(f"sqlite:///{path}")
    with database.write() as session:
        session.add(tables.Experiment(id="e", name="e", training={}, runs=[tables.Run(id="r", seed=0, attempt=1)]))
    database.dispose()
    return path


@pytest.fixture
def database(template: Path, tmp_path: Path) -> Database:
    path = tmp_path / "one.db"
    path.write_bytes(template.read_bytes())
    return Database(f"sqlite:///{path}")


def report(database: Database, count: int, names: tuple[str, ...] = ("loss", "rate")) -> None:
    """So many rows more, ten steps apart."""
    with database.write() as session:
        run = session.get_one(tables.Run, "r")
        rows = [
            ReportedRow(
                run.last_seq + i,
                run.step + 10 * i,
                1e9 + run.step + i,
                {name: float(np.sin(run.step + i)) for name in names},
            )
            for i in range(1, count + 1)
        ]
        MetricRepository(session).append({"r": rows})
        run.last_seq, run.step = run.last_seq + count, run.step + 10 * count


def compact(database: Database) -> None:
    with database.write() as session:
        MetricRepository(session).compact("r")


def take_back(database: Database, step: int) -> None:
    """To a checkpoint, from which the next attempt goes on."""
    with database.write() as session:
        run = session.get_one(tables.Run, "r")
        MetricRepository(session).drop_beyond("r", step)
        run.step, run.attempt = step, run.attempt + 1


def look(database: Database, kept: KeptSeries) -> dict[str, Buckets]:
    with database.read() as session:
        lines = kept.of(RunRepository(session).points_state("r"), MetricRepository(session))
    return {name: line.buckets for name, line in lines.items()}


def assert_same(seen: dict[str, Buckets], anew: dict[str, Buckets]) -> None:
    assert list(seen) == list(anew)
    for name, buckets in seen.items():
        for field in EVERY_FIELD:
            np.testing.assert_array_equal(getattr(buckets, field), getattr(anew[name], field))


def test_a_second_look_reads_what_was_reported_since(database: Database) -> None:
    kept = KeptSeries()
    report(database, 600)
    compact(database)
    report(database, 200)
    look(database, kept)
    report(database, 3)

    read: list[str] = []

    with database.read() as session:
        rows_of = MetricRepository._rows_of

        def counted(self: MetricRepository, run_ids: list[str], from_step: int | None = None) -> object:
            rows = rows_of(self, run_ids, from_step)
            read.extend(f"{row.step}" for row in rows["r"])
            return rows

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(MetricRepository, "_rows_of", counted)
            lines = kept.of(RunRepository(session).points_state("r"), MetricRepository(session))
    assert read == ["8000", "8010", "8020", "8030"]
    assert_same({name: line.buckets for name, line in lines.items()}, look(database, KeptSeries()))
    assert len(lines["loss"].buckets) == 803
    database.dispose()


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("report"), st.integers(1, 120)),
        st.tuples(st.just("report another"), st.integers(1, 30)),
        st.tuples(st.just("compact"), st.just(0)),
        st.tuples(st.just("take back"), st.integers(0, 2_000)),
        st.tuples(st.just("look"), st.just(0)),
    ),
    max_size=14,
)


@settings(deadline=None, max_examples=60)
@given(STEPS)
def test_what_has_grown_is_what_is_read_anew(
    template: Path, tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, int]]
) -> None:
    path = tmp_path_factory.mktemp("grown") / "one.db"
    path.write_bytes(template.read_bytes())
    database, kept = Database(f"sqlite:///{path}"), KeptSeries()
    for what, number in steps:
        if what == "report":
            report(database, number)
        elif what == "report another":
            report(database, number, ("eval/success", "loss"))
        elif what == "compact":
            compact(database)
        elif what == "take back":
            take_back(database, number)
        else:
            look(database, kept)
    assert_same(look(database, kept), look(database, KeptSeries()))
    database.dispose()


def test_a_long_series_that_grows_is_no_coarser_than_one_read_anew(database: Database) -> None:
    kept = KeptSeries()
    report(database, 5_000, ("loss",))
    compact(database)
    for _ in range(3):
        look(database, kept)
        report(database, 600, ("loss",))
        compact(database)
    seen, anew = look(database, kept)["loss"], look(database, KeptSeries())["loss"]
    assert len(seen) >= len(anew) >= MAX_BUCKETS // 2
    assert seen.sizes.sum() == anew.sizes.sum() == 6_800
    assert (np.diff(seen.steps) > 0).all()
    assert (seen.low.min(), seen.high.max()) == (anew.low.min(), anew.high.max())
    database.dispose()


def test_a_series_that_grew_too_long_is_read_anew(database: Database) -> None:
    kept = KeptSeries()
    report(database, 10, ("loss",))
    look(database, kept)
    report(database, 9_000, ("loss",))
    compact(database)
    assert_same(look(database, kept), look(database, KeptSeries()))
    database.dispose()


def test_what_is_kept_is_bounded(database: Database) -> None:
    kept = KeptSeries(max_bytes=1_000)
    report(database, 400)
    look(database, kept)
    assert not kept._runs
    assert kept._bytes == 0
    database.dispose()


def test_series_that_were_reported_together_lie_on_one_grid(database: Database) -> None:
    """However many there are: else a long run of forty series took four megabytes, and few were kept."""
    report(database, 5_000, ("loss", "rate"))
    compact(database)
    report(database, 10, ("loss", "rate"))
    kept = KeptSeries()
    with database.read() as session:
        lines = kept.of(RunRepository(session).points_state("r"), MetricRepository(session))
    loss, rate = lines["loss"], lines["rate"]
    assert loss.before is not None
    assert rate.before is not None
    for field in ("steps", "sizes", "finite"):
        assert getattr(loss.before, field) is getattr(rate.before, field)
    assert loss.points.steps is rate.points.steps
    database.dispose()
