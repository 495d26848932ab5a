"""Workers are shared fairly between people, and nobody has more of them at a time than the limits allow."""

import threading
import uuid
from collections import Counter
from collections.abc import Iterator

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from server.app import create_services
from server.database import tables
from server.errors import ConflictError
from server.http.paging import Window
from server.queueing.service import QueueService
from server.runs.repository import RunRepository
from server.runs.shares import Shares
from server.services import Services
from server.settings import Settings
from server.worker_api.attempts import end
from server.worker_api.service import WorkerService
from tests.server.harness import BASE_URL, TOKEN, Reports
from tests.server.people import Lab
from workers.config import TrainingConfig
from workers.protocol import ClaimRequest, Final


def waiting(*names: str) -> list[tables.Run]:
    """A run each, the one that has waited longest first; the first letter says whose, "-" stands for nobody."""
    return [
        tables.Run(
            id=name,
            queued_at=float(at),
            priority=0,
            experiment=tables.Experiment(id=name[0], launched_by=None if name[0] == "-" else name[0]),
        )
        for at, name in enumerate(names)
    ]


def order(shares: Shares, runs: list[tables.Run]) -> str:
    return " ".join(run.id for run in shares.in_turn(runs))


def test_turns_by_hand() -> None:
    nothing = Shares({}, {}, frozenset(), frozenset())
    runs = waiting("a1", "a2", "a3", "a4", "b1", "b2", "-1")
    assert order(nothing, runs) == "a1 b1 -1 a2 b2 a3 a4"
    # b was given a worker last; a has two now.
    assert order(Shares({"a": 0}, {"a": 1, "b": 2}, frozenset(), frozenset()), runs) == "-1 a1 b1 a2 b2 a3 a4"
    assert order(Shares({"a": 2}, {}, frozenset(), frozenset()), runs) == "b1 -1 b2 a1 a2 a3 a4"
    # Priorities come first, and count.
    runs[3].priority = 5
    assert order(nothing, sorted(runs, key=lambda run: -run.priority)) == "a4 b1 -1 a1 b2 a2 a3"


@pytest.fixture
def services(settings: Settings, database_url: str, limits: dict[str, int]) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url, **limits}))
    yield services
    services.database.dispose()


@pytest.fixture
def limits() -> dict[str, int]:
    return {}


def launch(services: Services, name: str, runs: int, person: str | None, parallel_runs: int | None = None) -> None:
    with services.database.write() as session:
        training = TrainingConfig().model_dump(mode="json")
        session.add(
            tables.Experiment(id=name, name=name, training=training, launched_by=person, parallel_runs=parallel_runs)
        )
        session.flush()
        session.add_all(tables.Run(id=f"{name}{seed}", experiment_id=name, seed=seed) for seed in range(runs))


def claim_at_once(services: Services, run_id: str, workers: int) -> list[str]:
    """The runs that so many workers got who all asked in the same moment."""
    granted: list[str] = []
    begin = threading.Barrier(workers)

    def work(number: int) -> None:
        request = ClaimRequest(worker=f"w{number}@host/0", published_attempt=0, any_run=True, claim_id=uuid.uuid4().hex)
        begin.wait()
        try:
            granted.append(str(WorkerService(services).claim(run_id, request).run_id))
        except ConflictError:
            return

    threads = [threading.Thread(target=work, args=(number,)) for number in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return granted


def test_who_launched_much_and_early_leaves_half_to_who_came_late(services: Services) -> None:
    launch(services, "first", 12, "ann")
    launch(services, "late", 12, "bob")
    granted = claim_at_once(services, "first0", 8)
    assert Counter(run_id.rstrip("0123456789") for run_id in granted) == {"first": 4, "late": 4}
    assert len(set(granted)) == 8


def test_one_after_another_the_one_served_longest_ago_is_next(services: Services) -> None:
    for person in ("ann", "bob", "cy"):
        launch(services, person, 3, person)
    served = []
    for _ in range(6):
        (run_id,) = claim_at_once(services, "ann0", 1)
        served.append(run_id.rstrip("0123456789"))
        with services.database.write() as session:
            # It ends at once: nobody has a run under way when the next worker comes.
            end(session, RunRepository(session).get(run_id, for_update=True), Final(outcome="completed"))
    assert served == ["ann", "bob", "cy"] * 2


@pytest.mark.parametrize("limits", [{"max_runs_per_experiment": 2}])
def test_an_experiment_has_no_more_workers_than_it_may(services: Services) -> None:
    launch(services, "one", 6, "ann")
    launch(services, "own", 6, "ann", parallel_runs=3)
    granted = claim_at_once(services, "one0", 8)
    assert Counter(run_id.rstrip("0123456789") for run_id in granted) == {"one": 2, "own": 3}


@pytest.mark.parametrize("limits", [{"max_runs_per_person": 3}])
def test_a_person_has_no_more_workers_than_they_may(services: Services) -> None:
    launch(services, "one", 3, "ann")
    launch(services, "two", 3, "ann")
    launch(services, "nobodys", 6, None)
    granted = claim_at_once(services, "one0", 10)
    people = Counter("ann" if run_id[:3] in ("one", "two") else "nobody" for run_id in granted)
    assert people == {"ann": 3, "nobody": 3}
    # Nor by asking for a certain one.
    with services.database.read() as session:
        left = next(run.id for run in RunRepository(session).queued() if run.experiment.launched_by == "ann")
    with pytest.raises(ConflictError, match="person limit"):
        WorkerService(services).claim(left, ClaimRequest(worker="z@host/0", published_attempt=0))

    items = QueueService(services).page(Window(50, 0), None).items
    assert {item.waits_for for item in items} == {"person limit"}
    # One ends: the next one's turn has come.
    with services.database.write() as session:
        mine = next(run_id for run_id in granted if run_id[:3] in ("one", "two"))
        end(session, RunRepository(session).get(mine, for_update=True), Final(outcome="completed"))
    assert len(claim_at_once(services, left, 4)) == 1


def test_a_launch_says_whose_it_is_and_how_many_at_a_time(app: FastAPI) -> None:
    services: Services = app.state.services
    with TestClient(app, base_url=BASE_URL, headers={"Authorization": f"Bearer {TOKEN}"}) as client:
        check_launch(client, services, Reports(client, services))


def check_launch(client: TestClient, services: Services, reports: Reports) -> None:
    lab = Lab(services)
    project = lab.project("Here")
    ann = lab.person("ann", {project: "editor"})
    client.get("/api/status")
    token = lab.token(ann, "launch")
    body = {"name": "Mine", "project_id": project, "seeds": [1, 2], "parallel_runs": 1}
    mine = client.post("/api/experiments", json=body, headers=token).json()
    assert mine["parallel_runs"] == 1
    with services.database.read() as session:
        assert session.get_one(tables.Experiment, mine["id"]).launched_by == ann
    owners = reports.experiment("By the owner")
    with services.database.read() as session:
        assert session.get_one(tables.Experiment, owners["id"]).launched_by is None

    assert len(claim_at_once(services, mine["runs"][0]["id"], 4)) == 2
    waits = {item["id"]: item["waits_for"] for item in client.get("/api/queue").json()["items"]}
    assert list(waits.values()) == ["experiment limit"]
    path = f"/api/experiments/{mine['id']}"
    assert client.patch(path, json={"name": "Still limited"}).json()["parallel_runs"] == 1
    assert client.patch(path, json={"parallel_runs": 0}).json()["parallel_runs"] is None
    assert [item["waits_for"] for item in client.get("/api/queue").json()["items"]] == ["worker"]
    assert client.patch(path, json={"parallel_runs": -1}).status_code == 422
