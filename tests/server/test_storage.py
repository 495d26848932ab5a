"""Disk use, and rules for checkpoints: what they take, what they never take, and until when it can be had back."""

import threading
import time
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select, update

from server.app import create_services
from server.checkpoints.archives import sweep_archives
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.files import StoredFile
from server.http.paging import Window
from server.security.principal import OWNER
from server.services import Services
from server.settings import Settings
from server.storage.rule import KeepRule, Stored, staying
from server.storage.service import StorageService
from server.storage.sweep import StorageSweep
from tests.server.filling import fill
from tests.server.harness import Reports

DAY = 86_400.0


def stored(count: int, *, best: int = -1, damaged: tuple[int, ...] = ()) -> list[Stored]:
    return [Stored(str(number), number not in damaged, number == best) for number in range(count)]


@pytest.mark.parametrize(
    ("rule", "checkpoints", "expected"),
    [
        (KeepRule(), stored(4), "0 1 2 3"),
        (KeepRule(last=2), stored(6), "4 5"),
        (KeepRule(last=2), stored(6, best=1), "1 4 5"),
        (KeepRule(last=2, best=False), stored(6, best=1), "4 5"),
        (KeepRule(last=1, every=3), stored(8, best=7), "0 3 6 7"),
        (KeepRule(last=1, every=1), stored(3), "0 1 2"),
        (KeepRule(last=9), stored(2), "0 1"),
        # Of damaged ones none stays, and none counts: a run goes on from the newest whole one.
        (KeepRule(last=2), stored(5, best=0, damaged=(4, 2)), "0 1 3"),
        (KeepRule(last=1, every=2), stored(5, damaged=(0,)), "1 3 4"),
        (KeepRule(last=1), [], ""),
    ],
)
def test_what_stays_by_a_rule(rule: KeepRule, checkpoints: list[Stored], expected: str) -> None:
    assert staying(rule, checkpoints) == set(expected.split())


def test_a_rule_that_keeps_all_keeps_no_every_nth() -> None:
    with pytest.raises(ValueError, match="no rule"):
        KeepRule(every=3)


@pytest.fixture
def experiment(reports: Reports) -> dict[str, Any]:
    """Two seeds that have ended, with ten checkpoints each; the third is the best, the last evaluated one the tenth."""
    experiment = reports.experiment(seeds=(0, 1))
    for run in experiment["runs"]:
        for number in range(10):
            reports.checkpoint(run, 100 * (number + 1), reports.evaluation(9 if number == 2 else 5))
        reports.state(run, "completed")
    return experiment


def ids(client: TestClient, run: dict[str, Any]) -> dict[int, str]:
    """Its checkpoints by step."""
    return {each["step"]: each["id"] for each in client.get(f"/api/runs/{run['id']}/checkpoints").json()["items"]}


def going(client: TestClient, run: dict[str, Any]) -> set[int]:
    """The steps of those that go."""
    found = client.get(f"/api/runs/{run['id']}/checkpoints").json()["items"]
    return {each["step"] for each in found if each["goes_at"] is not None}


def thinning(experiment: dict[str, Any]) -> str:
    return f"/api/experiments/{experiment['id']}/thinning"


def put(client: TestClient, experiment: dict[str, Any], **rule: object) -> dict[str, Any]:
    response = client.put(thinning(experiment), json={"rule": rule or None})
    assert response.status_code == 200, response.text
    body: dict[str, Any] = response.json()
    return body


def test_the_largest_comes_first_with_what_it_takes(
    client: TestClient, reports: Reports, experiment: dict[str, Any]
) -> None:
    small = reports.experiment("Small")
    reports.checkpoint(small["runs"][0], 100, None)
    reports.experiment("Without checkpoints")

    found = client.get("/api/storage").json()
    size = len(b"archive of step 100") * 18 + len(b"archive of step 1000") * 2
    assert [(one["name"], one["checkpoints"], one["checkpoint_bytes"]) for one in found["items"]] == [
        ("Corridor", 20, size),
        ("Small", 1, 19),
    ]
    assert (found["total"], found["checkpoint_bytes"], found["going_bytes"]) == (2, size + 19, 0)
    assert found["free_bytes"] > 0
    assert [one["name"] for one in client.get("/api/storage?limit=1&offset=1").json()["items"]] == ["Small"]


def test_what_a_rule_takes_is_said_before_and_nothing_is_changed(client: TestClient, experiment: dict[str, Any]) -> None:
    found = client.get(thinning(experiment), params={"last": 2, "every": 5}).json()
    # Of each run stay 100 and 600 (one in 5), 300 (the best), 900 and 1000.
    assert (found["going"], found["staying"], found["going_bytes"]) == (10, 10, 10 * 19)
    assert found["spared"] == []
    assert going(client, experiment["runs"][0]) == set()
    assert client.get(thinning(experiment)).json()["going"] == 0
    assert client.get(thinning(experiment), params={"last": 0}).status_code == 422
    assert client.get(f"/api/experiments/{'x' * 12}/thinning").status_code == 404


def test_it_goes_after_days_and_is_kept_by_another_rule_until_then(
    client: TestClient, services: Services, experiment: dict[str, Any]
) -> None:
    run = experiment["runs"][0]
    put(client, experiment, last=2, every=5)
    assert going(client, run) == {200, 400, 500, 700, 800}
    item = client.get("/api/storage").json()["items"][0]
    assert (item["going"], item["own_rule"], item["rule"]["last"]) == (10, True, 2)
    # As good as before: it can be taken home, and looked at.
    assert client.get(f"/api/checkpoints/{ids(client, run)[200]}/download").status_code == 200

    storage = StorageService(services)
    assert storage.remove_due(time.time() + 6.9 * DAY, 100) == 0
    put(client, experiment, last=5)
    assert going(client, run) == {100, 200, 400, 500}
    assert storage.remove_due(time.time() + 7.1 * DAY, 100) == 8
    assert set(ids(client, run)) == {300, 600, 700, 800, 900, 1000}
    sweep_archives(services, time.time())
    assert services.files.ids() == {each for one in experiment["runs"] for each in ids(client, one).values()}
    # What is gone is gone; what is left stays again.
    put(client, experiment)
    assert going(client, run) == set()
    done = client.get("/api/audit", params={"target": experiment["id"], "action": "experiment.thinned"}).json()["items"]
    assert [entry["details"] for entry in done] == ["8 checkpoints, 152 bytes"]


def wait_until_freed(client: TestClient) -> None:
    deadline = time.monotonic() + 20.0
    while client.get("/api/storage").json()["going_bytes"]:
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_it_is_freed_at_once_when_somebody_says_so(client: TestClient, experiment: dict[str, Any]) -> None:
    assert client.post(f"{thinning(experiment)}/free").json()["staying"] == 20
    put(client, experiment, last=1, best=False)
    assert client.post(f"{thinning(experiment)}/free").status_code == 200
    wait_until_freed(client)
    assert set(ids(client, experiment["runs"][1])) == {1000}
    item = client.get("/api/storage").json()["items"][0]
    assert (item["checkpoints"], item["checkpoint_bytes"], item["going"], item["going_bytes"]) == (2, 40, 0, 0)
    done = client.get("/api/audit", params={"target": experiment["id"], "action": "experiment.freed"}).json()["items"]
    assert [entry["details"] for entry in done] == ["18 checkpoints go now"]


def test_who_frees_much_does_not_wait_for_a_store_that_takes_its_time(
    client: TestClient, services: Services, experiment: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on, delete = threading.Event(), services.files.delete

    def slowly(archive_id: str) -> None:
        assert goes_on.wait(30.0)
        delete(archive_id)

    monkeypatch.setattr(services.files, "delete", slowly)
    put(client, experiment, last=1, best=False)
    try:
        assert client.post(f"{thinning(experiment)}/free").status_code == 200
        assert len(services.files.ids()) == 20
    finally:
        goes_on.set()
    wait_until_freed(client)


def test_what_others_need_stays_and_is_named(
    client: TestClient, services: Services, reports: Reports, experiment: dict[str, Any]
) -> None:
    first, second = experiment["runs"]
    begun, measured = ids(client, first)[200], ids(client, first)[400]
    with services.database.write() as session:
        child = tables.Experiment(id="child", name="child", training={})
        session.add(child)
        session.flush()
        session.add(tables.ExperimentKey(experiment_id="child", key=tables.START_KEY, text=begun))
        session.add(
            tables.PolicyEvaluation(id="e", job_id="j", key="k", title="t", policy={}, choice={}, checkpoint_id=measured)
        )
    # Not evaluated, and beyond the one by which the run stands on leaderboards.
    reports.checkpoint(second, 2_000, None)
    found = put(client, experiment, last=1, best=False)
    assert {(one["seed"], one["step"], one["reason"]) for one in found["spared"]} == {
        (0, 200, "a training began with it"),
        (0, 400, "somebody had it evaluated"),
        (1, 1000, "its run stands by it on leaderboards"),
    }
    assert found["spared_total"] == 3
    client.post(f"{thinning(experiment)}/free")
    wait_until_freed(client)
    assert set(ids(client, first)) == {200, 400, 1000}
    assert set(ids(client, second)) == {1000, 2000}


def test_what_somebody_begins_with_meanwhile_stays_after_all(
    client: TestClient, services: Services, experiment: dict[str, Any]
) -> None:
    put(client, experiment, last=1)
    begun = ids(client, experiment["runs"][0])[200]
    with services.database.write() as session:
        session.add(tables.Experiment(id="child", name="child", training={}))
        session.flush()
        session.add(tables.ExperimentKey(experiment_id="child", key=tables.START_KEY, text=begun))
    StorageService(services).remove_due(time.time() + 8 * DAY, 100)
    assert set(ids(client, experiment["runs"][0])) == {200, 300, 1000}
    assert going(client, experiment["runs"][0]) == set()


def test_the_checkpoint_that_a_run_goes_on_from_never_goes(
    client: TestClient, services: Services, experiment: dict[str, Any]
) -> None:
    """The newest one was whole when the rule took the one before it, and is damaged when that is to go."""
    run = experiment["runs"][0]
    put(client, experiment, last=1, best=False)
    with services.database.write() as session:
        session.get_one(tables.Checkpoint, ids(client, run)[1000]).damaged_at = 1.0
    StorageService(services).remove_due(time.time() + 8 * DAY, 100)
    assert set(ids(client, run)) == {900, 1000}


def test_a_study_that_goes_on_keeps_what_it_measures_by(
    client: TestClient, services: Services, experiment: dict[str, Any]
) -> None:
    with services.database.write() as session:
        session.add(tables.Study(id="s", project_id="default", name="s", spec={}, budget=1))
        session.flush()
        session.add(tables.StudyTrial(study_id="s", number=0, experiment_id=experiment["id"], values={}, rungs={}))
    found = client.get(thinning(experiment), params={"last": 1}).json()
    assert (found["going"], found["spared_total"]) == (0, 16)
    assert found["spared"][0]["reason"] == "a study that goes on measures by it"


def test_on_each_database(settings: Settings, database_url: str) -> None:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    fill(services.database)
    with services.database.write() as session:
        # A checkpoint of a byte and one of two are there, and stay.
        session.execute(update(tables.Checkpoint).values(goes_at=None))
        for number in (1, 2):
            sums = {"checkpoint_count": 1, "checkpoint_bytes": number, "going_count": 0, "going_bytes": 0}
            row = update(tables.Experiment).where(tables.Experiment.id == f"{number}experiments")
            session.execute(row.values(deleted_at=None, **sums))
        for step in (10, 20, 30):
            CheckpointRepository(session).add("1runs", step, StoredFile(f"c{step}", 2**40, ""), None)
    storage = StorageService(services)
    page = storage.page(OWNER, Window(10, 0))
    assert [(one.id, one.checkpoints) for one in page.items] == [("1experiments", 4), ("2experiments", 1)]
    # A byte of the curve, one of its steps and one of what was thinned, as the filled rows have them.
    assert (page.items[0].checkpoint_bytes, page.items[0].curve_bytes) == (3 * 2**40 + 1, 3)

    taken = storage.change("1experiments", KeepRule(last=1, best=False))
    assert (taken.going, taken.going_bytes, [one.id for one in taken.spared]) == (2, 2 * 2**40, ["1checkpoints"])
    assert storage.page(OWNER, Window(10, 0)).items[0].going_bytes == 2 * 2**40
    storage.free("1experiments")
    storage.remove_due(time.time(), 10)
    largest = storage.page(OWNER, Window(10, 0))
    assert (largest.items[0].checkpoints, largest.items[0].checkpoint_bytes, largest.going_bytes) == (2, 2**40 + 1, 0)
    # What is kept is what adding up gives.
    with services.database.read() as session:
        added_up = (
            select(tables.Run.experiment_id, func.count(), func.sum(tables.Checkpoint.size))
            .join(tables.Checkpoint, tables.Checkpoint.run_id == tables.Run.id)
            .group_by(tables.Run.experiment_id)
        )
        assert {row[0]: (row[1], int(row[2])) for row in session.execute(added_up)} == {
            item.id: (item.checkpoints, item.checkpoint_bytes) for item in largest.items
        }
    services.database.dispose()


class TestByTheSettings:
    """The installation's rule holds where an experiment has none of its own, for what comes too."""

    @pytest.fixture
    def settings(self, settings: Settings) -> Settings:
        return settings.model_copy(update={"keep_checkpoints": KeepRule(last=2, best=False)})

    def test_new_checkpoints_come_and_old_ones_go(
        self, client: TestClient, services: Services, reports: Reports, experiment: dict[str, Any]
    ) -> None:
        own = reports.experiment("Own")
        for step in (100, 200, 300):
            reports.checkpoint(own["runs"][0], step, None)
        client.put(thinning(own), json={"rule": {}})
        sweep = StorageSweep(services)
        assert sweep.sweep(time.time()) == 2
        run = experiment["runs"][0]
        assert going(client, run) == set(range(100, 900, 100))
        assert going(client, own["runs"][0]) == set()

        # At the next look only what has come since is looked at.
        reports.checkpoint(run, 1_100, None)
        assert sweep.sweep(time.time()) == 1
        # 1000 is what the run stands by on leaderboards.
        assert going(client, run) == set(range(100, 1_000, 100))
        assert sweep.sweep(time.time()) == 0
