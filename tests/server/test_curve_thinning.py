"""Thinning of curves: only by a rule, only of runs that ended long ago, and told wherever the curves go."""

import csv
import io
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from server.app import create_services
from server.checkpoints.repository import CheckpointRepository
from server.curve_thinning.repository import DAY
from server.curve_thinning.rule import CurveRule
from server.curve_thinning.service import CurveThinningService
from server.curve_thinning.sweep import sweep
from server.database import tables
from server.files import StoredFile
from server.metrics.buckets import Buckets
from server.metrics.points import Points
from server.metrics.repository import MetricRepository, ReportedRow
from server.metrics.thinning import ThinningRepository
from server.runs.service import resume_run
from server.services import Services
from server.settings import Settings
from tests.server.harness import Reports

COUNT = 10_000
RULE = CurveRule(points=200, after_days=30.0)
NOW = 1_000.0 * DAY


def points(name: str, first: int = 1, last: int = COUNT) -> Points:
    """A point each tenth step, of values that wander, with a spike in the middle of 10,000."""
    steps = np.arange(first, last + 1, dtype=np.int64)
    values = np.sin(steps / 500.0) + np.modf(steps * 0.618)[0] + len(name)
    values[steps == 5_000] = 99.0
    return Points(10 * steps, 1e9 + steps / 3.0, values.astype(np.float32))


def test_buckets_end_at_stops_worked_by_hand() -> None:
    series = Buckets.of(Points.of(list(range(1, 13)), [0.0] * 12, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]))

    cut = series.cut(6, np.array([5, 99]))

    # What even buckets would be, but that 5 stands alone, and nothing behind it is put together with it.
    assert cut.steps.tolist() == [3, 4, 5, 7, 11, 12]
    assert cut.mean.tolist() == [2.0, 4.0, 5.0, 6.5, 9.5, 12.0]
    assert (cut.low.tolist(), cut.high.tolist()) == ([1, 4, 5, 6, 8, 12], [3, 4, 5, 7, 11, 12])
    assert cut.sizes.tolist() == [3, 1, 1, 2, 4, 1]
    # No stop is within the series, or none is left of it.
    assert series.cut(4, np.array([0, 50])).steps.tolist() == series.cut(4).steps.tolist()


class Place:
    """A service on some database with one experiment in it, whose run has ended at `NOW`."""

    def __init__(self, services: Services) -> None:
        self.services = services
        self.service = CurveThinningService(services)
        with services.database.write() as session:
            run = tables.Run(id="r", seed=3, state="completed", finished_at=NOW, step=10 * COUNT, attempt=1)
            session.add(tables.Experiment(id="e", name="Corridor", training={}, runs=[run]))
            session.flush()
            series = {name: points(name) for name in ("loss", "return")}
            rare = Points.of([50_000, 100_000], [1e9, 2e9], [0.25, 0.75])
            dense = points("eval/steps")
            MetricRepository(session).add_series("r", series | {"eval/steps": dense, "eval/success_rate": rare})
            for step in (30_005, 100_000):
                CheckpointRepository(session).add("r", step, StoredFile(f"c{step}", 10, ""), None)

    def run(self) -> tables.Run:
        with self.services.database.read() as session:
            return session.get_one(tables.Run, "r")

    def curves(self, width: int = 100_000) -> dict[str, Buckets]:
        with self.services.database.read() as session:
            return MetricRepository(session).curves(["r"], None, width)["r"]

    def latest(self) -> dict[str, tuple[int, float]]:
        with self.services.database.read() as session:
            return {each.name: (each.step, each.value) for each in session.query(tables.LatestMetric)}

    def size(self) -> int:
        """Bytes of all curves."""
        kinds = (tables.MetricChunk.points, tables.MetricAxis.data, tables.MetricSummary.data, tables.ThinnedSeries.data)
        with self.services.database.read() as session:
            return sum(int(session.scalar(select(func.coalesce(func.sum(func.length(kind)), 0))) or 0) for kind in kinds)

    def sweep(self, now: float) -> int:
        """Everything that is due; in how many pieces."""
        count = 0
        while sweep(self.services, now):
            count += 1
        return count

    def thin(self, rule: CurveRule = RULE, now: float = NOW + 38 * DAY) -> None:
        """By a rule that was given long ago."""
        self.service.change("e", rule)
        self.sweep(now - 7 * DAY)
        self.sweep(now)


@pytest.fixture
def place(settings: Settings, database_url: str) -> Iterator[Place]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    yield Place(services)
    services.database.dispose()


def same(one: Buckets, other: Buckets) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
        for name in ("steps", "sizes", "finite", "low", "mean", "high")
    )


def test_without_a_rule_nothing_is_touched(place: Place) -> None:
    size = place.size()
    assert place.sweep(NOW + 10_000 * DAY) == 0
    run = place.run()
    assert (run.thins_at, run.thin_enough, run.thinned_at, place.size()) == (None, None, None, size)


def test_a_rule_thins_after_its_days_and_those_of_the_trash(place: Place) -> None:
    whole, size, latest = place.curves(), place.size(), place.latest()
    told = place.service.preview("e", RULE)
    # The two that are no evaluations; as if now were long after the run's end.
    assert (told.runs, told.points, told.kept, told.later, told.marked) == (1, 2 * COUNT, 400, 0, 0)
    assert place.size() == size
    place.service.change("e", RULE)
    place.sweep(NOW + 29.9 * DAY)
    assert place.run().thins_at is None
    place.sweep(NOW + 31.0 * DAY)
    assert place.run().thins_at == NOW + 38.0 * DAY
    assert place.service.preview("e", None).marked == 1
    place.sweep(NOW + 37.9 * DAY)
    assert place.size() == size

    place.sweep(NOW + 38.1 * DAY)

    run, curves = place.run(), place.curves()
    assert (run.thinned_from, run.thins_at, run.thin_enough) == (2 * COUNT, None, 200)
    assert run.thinned_to == len(curves["loss"]) + len(curves["return"])
    for name in ("loss", "return"):
        thin, before = curves[name], whole[name]
        assert 190 <= len(thin) <= 200
        assert thin.sizes.sum() == COUNT
        # A spike stays, what is in a bucket is within its band, and the mean over all is what it was.
        assert (thin.high.max(), thin.low.min()) == (99.0, before.low.min())
        bucket = np.searchsorted(thin.steps, before.steps)
        assert (thin.low[bucket] <= before.mean).all()
        assert (before.mean <= thin.high[bucket]).all()
        assert np.average(thin.mean, weights=thin.sizes) == pytest.approx(before.mean.mean(), rel=1e-6)
        assert (thin.steps[-1], thin.mean[-1], thin.sizes[-1]) == (100_000, before.mean[-1], 1)
    for name in ("eval/steps", "eval/success_rate"):
        assert same(curves[name], whole[name])
    assert place.latest() == latest
    # What was said to be freed is, to a tenth of what there was.
    assert size - place.size() == pytest.approx(told.frees, abs=0.1 * size)
    # Its charts look as they did: the same steps' means, in a width that a summary would have answered.
    assert len(place.curves(100)["loss"]) <= 100
    assert place.curves(100)["loss"].high.max() == 99.0
    with place.services.database.read() as session:
        said = session.scalars(select(tables.RunEvent.message).where(tables.RunEvent.run_id == "r")).all()
        done = session.scalars(select(tables.AuditEntry.action).order_by(tables.AuditEntry.id)).all()
    assert said == [f"Curves were thinned: 20\u202f000 points to {run.thinned_to}."]
    assert done == ["experiment.curve_rule_changed", "experiment.curves_thinned"]


def test_what_is_left_takes_what_the_preview_says(place: Place) -> None:
    """Rates that wander with noise, twenty on one axis: 13.5 to 16.5 bytes a bucket, and the whole within a tenth."""
    random, steps = np.random.default_rng(0), np.arange(1, 20_001, dtype=np.int64)
    times = 1.7e9 + np.cumsum(random.uniform(0.2, 0.4, steps.size))
    with place.services.database.write() as session:
        MetricRepository(session).drop_beyond("r", -1)
        series = {
            f"rate{number}": Points(steps, times, (np.cumsum(noise) / 50 + noise).astype(np.float32))
            for number, noise in enumerate(random.normal(0.0, 0.1, (20, steps.size)))
        }
        MetricRepository(session).add_series("r", series)
        session.get_one(tables.Run, "r").last_seq = 1
    rule, size = CurveRule(points=1_000, after_days=30.0), place.size()
    told = place.service.preview("e", rule)
    place.thin(rule)
    left = place.size()
    assert 13.5 < left / (20 * 1_000) < 16.5
    assert size - left == pytest.approx(told.frees, rel=0.1)
    assert left < size / 4


def test_it_is_done_once(place: Place) -> None:
    place.thin()
    run, size = place.run(), place.size()
    assert place.sweep(NOW + 1_000 * DAY) == 0
    assert (place.run().thinned_at, place.size()) == (run.thinned_at, size)
    # By a finer rule nothing is to be done; by a coarser one the buckets are put together.
    place.thin(CurveRule(points=300, after_days=0.0), NOW + 2_000 * DAY)
    assert (place.run().thinned_at, place.run().thin_enough) == (run.thinned_at, 300)
    place.thin(CurveRule(points=100, after_days=0.0), NOW + 3_000 * DAY)
    coarse = place.curves()["loss"]
    assert (len(coarse) <= 100, int(coarse.sizes.sum()), coarse.high.max()) == (True, COUNT, 99.0)


@pytest.mark.parametrize("reason", ["starred", "trash", "study", "running", "no rule", "other rule"])
def test_what_speaks_against_it_is_asked_at_the_last_moment(place: Place, reason: str) -> None:
    size = place.size()
    place.service.change("e", RULE)
    place.sweep(NOW + 31 * DAY)
    assert place.run().thins_at is not None
    with place.services.database.write() as session:
        experiment, run = session.get_one(tables.Experiment, "e"), session.get_one(tables.Run, "r")
        match reason:
            case "starred":
                experiment.starred_at = 1.0
            case "trash":
                experiment.deleted_at = 1.0
            case "study":
                session.add(tables.Study(id="s", project_id="default", name="s", spec={}, budget=1))
                session.flush()
                session.add(tables.StudyTrial(study_id="s", number=0, experiment_id="e", values={}, rungs={}))
            case "running":
                run.state = "stopped"
                resume_run(session, run)
            case "no rule":
                experiment.curve_rule = None
            case "other rule":
                experiment.curve_rule = CurveRule(points=200, after_days=90.0).model_dump()
    place.sweep(NOW + 40 * DAY)
    assert (place.size(), place.run().thinned_at, place.run().thins_at) == (size, None, None)
    if reason == "starred":
        assert place.service.preview("e", RULE).spared == "it is starred"


def test_a_piece_at_a_time_and_broken_off_anywhere(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each series there is all or what is left of it, whatever becomes of the process; the next look goes on."""
    whole = place.curves()
    monkeypatch.setattr("server.curve_thinning.service._PIECE_POINTS", COUNT)
    place.service.change("e", RULE)
    sweep(place.services, NOW + 31 * DAY)
    after = NOW + 39 * DAY
    assert place.service.thin_some(after) == 1
    half = place.curves()
    assert len(half["loss"]) <= 200
    assert same(half["return"], whole["return"])
    assert (place.run().thinned_from, place.run().thins_at) == (COUNT, NOW + 38 * DAY)

    class Killed(BaseException):
        """The process ends here."""

    def killed(*_: object) -> None:
        raise Killed

    write = ThinningRepository.write
    monkeypatch.setattr(ThinningRepository, "write", killed)
    with pytest.raises(Killed):
        place.service.thin_some(after)
    assert all(same(place.curves()[name], half[name]) for name in whole)
    monkeypatch.setattr(ThinningRepository, "write", write)
    assert place.service.thin_some(after) == 1
    assert place.service.thin_some(after) == 0
    assert (place.run().thinned_from, place.run().thins_at) == (2 * COUNT, None)
    assert all(len(place.curves()[name]) <= 200 for name in ("loss", "return"))


def test_what_cannot_be_read_keeps_no_other_waiting(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    place.service.change("e", RULE)
    place.sweep(NOW + 31 * DAY)

    def broken(*_: object, **__: object) -> None:
        raise ValueError("not so many points")

    monkeypatch.setattr(MetricRepository, "read", broken)
    assert place.service.thin_some(NOW + 39 * DAY) == 1
    assert place.run().thins_at == NOW + 40 * DAY
    assert place.service.thin_some(NOW + 39 * DAY) == 0


def test_points_that_come_while_it_is_computed_are_not_lost(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    place.service.change("e", RULE)
    place.sweep(NOW + 31 * DAY)
    read = MetricRepository.read

    def meanwhile(self: MetricRepository, run_id: str, names: Sequence[str] | None = None) -> dict[str, Points]:
        found = read(self, run_id, names)
        monkeypatch.setattr(MetricRepository, "read", read)
        with place.services.database.write() as session:
            MetricRepository(session).append({"r": [ReportedRow(1, 100_010, 0.0, {"loss": 7.0})]})
            session.get_one(tables.Run, "r").last_seq = 1
        return found

    monkeypatch.setattr(MetricRepository, "read", meanwhile)
    place.service.thin_some(NOW + 39 * DAY)
    assert place.run().thinned_at is None
    assert place.curves()["loss"].mean[-1] == 7.0


def resumed(place: Place, step: int) -> None:
    """As a claim does it."""
    with place.services.database.write() as session:
        run = session.get_one(tables.Run, "r")
        run.state = "stopped"
        resume_run(session, run)
        run.state, run.attempt, run.step = "running", run.attempt + 1, step
        MetricRepository(session).drop_beyond("r", step)


@pytest.mark.parametrize("step", [100_000, 30_005])
def test_a_thinned_run_that_is_resumed_has_every_point_up_to_its_checkpoint(place: Place, step: int) -> None:
    """The checkpoints are at steps 30,005 and 100,000: buckets end there, and the last point before stands alone."""
    whole = place.curves()["loss"]
    place.thin()
    marked = place.run()
    resumed(place, step)

    known = int(np.searchsorted(whole.steps, step, side="right"))
    thin, run = place.curves()["loss"], place.run()
    assert thin.sizes.sum() == known
    assert thin.high.max() == whole.high[:known].max()
    assert (thin.steps[-1], thin.mean[-1]) == (whole.steps[known - 1], whole.mean[known - 1])
    assert place.latest()["loss"] == (whole.steps[known - 1], whole.mean[known - 1])
    assert (run.thinned_from, run.thinned_at, run.thin_enough) == (2 * known, marked.thinned_at, None)

    # It goes on: what comes is kept to the point, however long it gets, and is looked at in any width.
    more = points("loss", step // 10 + 1, step // 10 + 12_000)
    with place.services.database.write() as session:
        MetricRepository(session).add_series("r", {"loss": more})
        MetricRepository(session).append({"r": [ReportedRow(1, 10**6, 0.0, {"loss": 5.0})]})
        MetricRepository(session).compact("r")
    grown = place.curves()["loss"]
    assert grown.sizes.sum() == known + 12_001
    assert same(grown[len(thin) : -1], Buckets.of(more))
    wide = place.curves(1_000)["loss"]
    assert (wide.sizes.sum(), wide.high.max(), wide.mean[-1]) == (known + 12_001, max(99.0, grown.high.max()), 5.0)

    # Ended once more, and long ago again: thinned from all points that there ever were.
    with place.services.database.write() as session:
        run = session.get_one(tables.Run, "r")
        run.state, run.finished_at, run.last_seq = "completed", NOW + 100 * DAY, 1
    place.sweep(NOW + 131 * DAY)
    place.sweep(NOW + 139 * DAY)
    again = place.curves()["loss"]
    assert (len(again) <= 200, int(again.sizes.sum()), again.mean[-1]) == (True, known + 12_001, 5.0)
    assert again.low.min() == pytest.approx(min(whole.low[:known].min(), more.values.min()))


def test_a_run_that_begins_anew_was_never_thinned(place: Place) -> None:
    place.thin()
    resumed(place, -1)
    run = place.run()
    assert (run.thinned_at, run.thinned_from, run.thinned_to, place.curves()) == (None, None, None, {})


def test_a_run_with_few_points_is_looked_at_once(place: Place) -> None:
    with place.services.database.write() as session:
        run = tables.Run(id="short", seed=4, state="failed", finished_at=NOW, experiment_id="e")
        session.add(run)
        session.flush()
        rows = [ReportedRow(seq, seq, 0.0, {"loss": 1.0}) for seq in range(1, 200)]
        MetricRepository(session).append({"short": rows})
    place.thin()
    with place.services.database.read() as session:
        short = session.get_one(tables.Run, "short")
        assert (short.thinned_at, short.thins_at, short.thin_enough) == (None, None, 200)
        assert len(MetricRepository(session).read("short")["loss"]) == 199


class TestByTheSettings:
    """The installation's rule holds where an experiment has none of its own."""

    @pytest.fixture
    def settings(self, settings: Settings) -> Settings:
        return settings.model_copy(update={"thin_curves": RULE})

    def test_it_does_unless_all_stay(self, place: Place) -> None:
        place.service.change("e", CurveRule())
        place.sweep(NOW + 31 * DAY)
        assert place.run().thins_at is None
        place.service.change("e", None)
        place.sweep(NOW + 31 * DAY)
        place.sweep(NOW + 39 * DAY)
        assert place.run().thinned_from == 2 * COUNT


# -- over HTTP ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def run(client: TestClient, services: Services, reports: Reports) -> dict[str, Any]:
    """A run that ended a year ago, with two long metrics, one short one and an evaluation."""
    (run,) = reports.experiment("Corridor")["runs"]
    with services.database.write() as session:
        few = Points.of([10, 20], [1e9, 2e9], [0.5, float("nan")])
        MetricRepository(session).add_series(run["id"], {"loss": points("loss"), "return": points("return"), "few": few})
    reports.state(run, "completed", finished_at=time.time() - 365 * DAY, step=10 * COUNT, attempt=1)
    found: dict[str, Any] = client.get(f"/api/runs/{run['id']}").json()
    return found


def path_of(run: dict[str, Any]) -> str:
    return f"/api/experiments/{run['experiment_id']}/curve-thinning"


def thin(client: TestClient, run: dict[str, Any], points: int = 100) -> dict[str, Any]:
    """By a rule, and at once; the run afterwards."""
    rule = {"points": points, "after_days": 30.0}
    told = client.put(path_of(run), json={"rule": rule}).raise_for_status().json()
    deadline = time.monotonic() + 20.0
    while not told["marked"]:
        assert time.monotonic() < deadline
        time.sleep(0.02)
        told = client.get(path_of(run)).json()
    client.post(f"{path_of(run)}/now").raise_for_status()
    while True:
        found: dict[str, Any] = client.get(f"/api/runs/{run['id']}").json()
        if found["thinned"] is not None and found["thins_at"] is None:
            return found
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_rule_is_set_looked_at_and_hastened(client: TestClient, run: dict[str, Any]) -> None:
    assert (run["thinned"], run["thins_at"]) == (None, None)
    told = client.get(path_of(run), params={"points": 100, "after_days": 400}).json()
    assert (told["runs"], told["later"], told["frees"]) == (0, 1, 0)
    told = client.get(path_of(run), params={"points": 100}).json()
    assert (told["runs"], told["points"], told["kept"]) == (1, 2 * COUNT, 200)
    assert told["frees"] > 30_000
    assert client.get(path_of(run), params={"points": 99}).status_code == 422
    assert client.get(f"/api/experiments/{'x' * 12}/curve-thinning").status_code == 404

    begun = time.time()
    thinned = thin(client, run)
    assert thinned["thinned"]["points"] == 2 * COUNT
    assert 150 < thinned["thinned"]["kept"] <= 200
    assert begun <= thinned["thinned"]["since"] <= time.time()
    (stored,) = client.get("/api/experiments", params={"query": "Corridor"}).json()["items"]
    assert stored["id"] == run["experiment_id"]
    actions = [each["action"] for each in client.get("/api/audit", params={"target": run["experiment_id"]}).json()["items"]]
    assert {"experiment.curve_rule_changed", "experiment.curves_hastened", "experiment.curves_thinned"} <= set(actions)


def test_the_page_storage_tells_the_rule(client: TestClient, reports: Reports, run: dict[str, Any]) -> None:
    reports.checkpoint(run, 100, None)
    (item,) = client.get("/api/storage").json()["items"]
    assert (item["curve_rule"], item["own_curve_rule"]) == ({"points": None, "after_days": 30.0}, False)
    before = item["curve_bytes"]
    thin(client, run)
    (item,) = client.get("/api/storage").json()["items"]
    assert (item["curve_rule"]["points"], item["own_curve_rule"]) == (100, True)
    assert item["curve_bytes"] < before / 5


def test_who_asks_for_curves_is_told(client: TestClient, run: dict[str, Any]) -> None:
    path = f"/api/runs/{run['id']}/metrics"
    before = client.get(path, params={"points": 1_000})
    assert before.json()["thinned"] is None
    thinned = thin(client, run)["thinned"]

    # What was kept under the old ETag is no answer any more.
    after = client.get(path, params={"points": 1_000}, headers={"If-None-Match": before.headers["etag"]})
    assert (after.status_code, after.json()["thinned"]) == (200, thinned)
    loss = next(each for each in after.json()["series"] if each["name"] == "loss")
    assert len(loss["steps"]) <= 100
    assert max(loss["max"]) == 99.0
    # Who knows every point up to the middle is told all of it anew; who knows the end, what comes after it.
    half = {"since": 50_000, "attempt": 1}
    assert client.get(path, params=half).json()["since"] is None
    assert client.get(path, params={"since": 100_000, "attempt": 1}).json()["since"] == 100_000


def export(client: TestClient, kind: str, identifier: str, data_format: str) -> Any:
    return client.get(f"/api/{kind}/{identifier}/export", params={"format": data_format}).raise_for_status()


def test_what_leaves_tells_how_many_points_there_were(client: TestClient, run: dict[str, Any], tmp_path: Path) -> None:
    before = export(client, "runs", run["id"], "csv").text
    assert before.startswith("run,seed,metric,step,wall_time,value\r\n")
    thinned = thin(client, run)["thinned"]

    rows = list(csv.DictReader(io.StringIO(export(client, "runs", run["id"], "csv").text)))
    assert list(rows[0]) == ["run", "seed", "metric", "step", "wall_time", "value", "points", "min", "max"]
    loss = [row for row in rows if row["metric"] == "loss"]
    assert len(loss) <= 100
    assert sum(int(row["points"]) for row in loss) == COUNT
    assert max(float(row["max"]) for row in loss) == 99.0
    assert all(float(row["min"]) <= float(row["value"]) <= float(row["max"]) for row in loss)
    # The last point is what it was, and when it was.
    last = next(line for line in reversed(before.splitlines()) if ",loss," in line).split(",")
    assert list(loss[-1].values())[:6] == last
    assert [[row[key] for key in ("value", "points", "min", "max")] for row in rows if row["metric"] == "few"] == [
        ["0.5", "1", "0.5", "0.5"],
        ["", "1", "", ""],
    ]

    document = export(client, "experiments", run["experiment_id"], "json").json()
    assert document["runs"][0]["thinned"] == thinned

    file = tmp_path / "events.out.tfevents.1.thinned"
    file.write_bytes(export(client, "runs", run["id"], "tensorboard").content)
    events = EventAccumulator(str(file), size_guidance={"scalars": 0, "tensors": 0})
    events.Reload()
    assert max(each.value for each in events.Scalars("loss (max)")) == 99.0
    assert len(events.Scalars("loss")) == len(loss)
    assert "few (min)" not in events.Tags()["scalars"]
    (note,) = events.Tensors("mapless/thinned")
    said = note.tensor_proto.string_val[0].decode()
    assert f"loss {COUNT} to {len(loss)}" in said
    assert events.summary_metadata["mapless/thinned"].plugin_data.plugin_name == "text"


def test_a_download_that_is_overtaken_breaks_off(client: TestClient, services: Services, run: dict[str, Any]) -> None:
    from server.data_export.series import ThinnedMeanwhileError, read_run

    pieces = read_run(services.database, run["id"]).pieces
    next(pieces)
    thin(client, run)
    with pytest.raises(ThinnedMeanwhileError):
        list(pieces)


def test_comparisons_tell_it(client: TestClient, run: dict[str, Any]) -> None:
    ids = {"experiment": [run["experiment_id"]]}
    seeds = client.get("/api/compare/curves", params=ids | {"name": "loss"}).json()["experiments"][0]["seeds"]
    assert [each["thinned"] for each in seeds] == [False]
    thin(client, run)
    warnings = client.get("/api/compare", params=ids).json()["warnings"]
    assert any("Curves of 1 of 1 runs of Corridor were thinned" in each for each in warnings)
    seeds = client.get("/api/compare/curves", params=ids | {"name": "loss"}).json()["experiments"][0]["seeds"]
    assert [each["thinned"] for each in seeds] == [True]
