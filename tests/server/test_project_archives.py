"""A project leaves one server whole and comes to another one with the same ids, run by run."""

import asyncio
import base64
import hashlib
import io
import json
import shutil
import tarfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import mapless_client
from server.app import create_app
from server.bags.schemas import MAX_BAG_BYTES
from server.checkpoints.repository import CheckpointRepository
from server.curve_thinning.rule import CurveRule
from server.curve_thinning.service import CurveThinningService
from server.database import tables
from server.errors import ConflictError, DatabaseAwayError
from server.files import StoredFile
from server.ids import new_id
from server.metrics.buckets import Buckets
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.project_archives.arriving import ProjectArrival
from server.project_archives.others import take_evaluation
from server.project_archives.schemas import ArchivedAskedEvaluation
from server.run_log.repository import LogRepository
from server.services import Services
from server.settings import Settings
from server.studies.schemas import StudySpec
from sim.config import ArenaFile
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN, Reports
from tests.server.job_worker import working
from tests.server.test_evaluations import ended
from tests.server.test_own_suites import add, made, scenario
from tests.workers.robot_bags import as_mcap, messages, simulated
from tests.workers.test_bags import task
from tests.workers.test_onnx_policy import graph
from workers.export.bundle import bundle, export_checkpoint
from workers.protocol import LogBatch, LogLine
from workers.shipped.library import shipped_policy

SEARCHED = StudySpec.model_validate(
    {"training": {}, "settings": [{"kind": "range", "path": "algorithm.gamma", "low": 0.9, "high": 0.99}]}
).model_dump(mode="json")
SHIPPED = Path(__file__).parents[2] / "workers" / "shipped" / "policies" / "simple" / "policy.zip"


class Server:
    """A service of its own, and a client that speaks to it."""

    def __init__(self, http: TestClient, services: Services) -> None:
        self.http = http
        self.services = services
        self.client = mapless_client.Client(BASE_URL, http=http)
        self.reports = Reports(http, services)


@pytest.fixture
def servers(request: pytest.FixtureRequest, tmp_path: Path, new_database: Path) -> Iterator[tuple[Server, Server]]:
    """Two that know nothing of one another; on SQLite, unless a test says which of them is on PostgreSQL."""
    on_postgres = getattr(request, "param", None)
    with ExitStack() as stack:

        def server(name: str) -> Server:
            folder = tmp_path / name
            folder.mkdir()
            shutil.copy(new_database, folder)
            settings = Settings.model_validate(
                {
                    "data_dir": folder,
                    "token": TOKEN,
                    "worker_token": WORKER_TOKEN,
                    "web_dist": folder / "dist",
                    "database_url": request.getfixturevalue("postgres_url") if name == on_postgres else None,
                }
            )
            app = create_app(settings)
            headers = {"Authorization": f"Bearer {TOKEN}"}
            return Server(stack.enter_context(TestClient(app, base_url=BASE_URL, headers=headers)), app.state.services)

        yield server("here"), server("there")


def checkpoint(server: Server, run: dict[str, Any], step: int, arrivals: int | None) -> str:
    """A real archive: that of a policy that ships."""
    content = SHIPPED.read_bytes()

    async def archive() -> Any:
        yield content

    file: StoredFile = asyncio.run(server.services.files.write(new_id(), archive()))
    with server.services.database.write() as session:
        evaluation = None if arrivals is None else Reports.evaluation(arrivals)
        CheckpointRepository(session).add(run["id"], step, file, evaluation)
    return file.id


@pytest.fixture
def trained(servers: tuple[Server, Server]) -> dict[str, Any]:
    """On the first server: two runs, one ended with points and checkpoints, one that goes on."""
    here, _ = servers
    experiment = here.reports.experiment("Corridor, once more", seeds=(3, 4), algorithm={"name": "ppo", "gamma": 0.97})
    first, second = experiment["runs"]
    points = Points.of(range(1, 9_001), [float(i) for i in range(9_000)], [i / 7 if i % 100 else None for i in range(9_000)])
    with here.services.database.write() as session:
        MetricRepository(session).add_series(first["id"], {"train/return": points, "loss/value": points[:10]})
        study = tables.Study(
            id="s", project_id="default", name="Search", spec=SEARCHED, state="done", budget=2, asked=1, created_at=5.0
        )
        session.add(study)
        session.flush()
        session.add(
            tables.StudyTrial(
                study_id="s",
                number=0,
                experiment_id=experiment["id"],
                values={"algorithm.gamma": 0.97},
                rungs={"3": [0.5, None]},
                created_at=6.0,
            )
        )
        kept = session.get_one(tables.Experiment, experiment["id"])
        kept.study_id, kept.campaign, kept.campaign_row = "s", "c1", "simple"
        for attempt, first_line in ((1, 1), (2, 1), (2, 400)):
            lines = [LogLine(at=1.0 + i, text=f"línea {i}") for i in range(2)]
            LogRepository(session).append(first["id"], attempt, LogBatch(first=first_line, lines=tuple(lines)))
        session.add(tables.ExperimentTag(experiment_id=experiment["id"], tag="baseline"))
        session.get_one(tables.Experiment, experiment["id"]).notes = "# It *works*"
    checkpoint(here, first, 1_000, 8)
    checkpoint(here, first, 2_000, None)
    here.reports.state(first, "completed", attempt=2, step=5_000, started_at=1.5, finished_at=9.5)
    here.reports.state(second, "running", attempt=1, worker="w")
    return experiment


def everything(server: Server, experiment: dict[str, Any]) -> list[Any]:
    """What the API says of an experiment, its runs, points, checkpoints, episodes and files."""
    get: Callable[[str], Any] = lambda path: server.http.get(path).raise_for_status().json()  # noqa: E731
    run = experiment["runs"][0]["id"]
    checkpoints = get(f"/api/runs/{run}/checkpoints")["items"]
    shown = get(f"/api/experiments/{experiment['id']}")
    return [
        shown | {"runs": shown["runs"][:1], "state": None},
        get(f"/api/experiments/{experiment['id']}/marks"),
        get(f"/api/runs/{run}/metrics?points=9000"),
        get(f"/api/runs/{run}/metrics?points=100"),
        get(f"/api/runs/{run}/log"),
        [{key: value for key, value in each.items() if key != "evaluation"} for each in checkpoints],
        [each["evaluation"] and each["evaluation"]["success"] for each in checkpoints],
        get(f"/api/checkpoints/{checkpoints[1]['id']}/episodes"),
        [server.http.get(f"/api/checkpoints/{each['id']}/download").content for each in checkpoints],
        [(event["at"], event["message"]) for event in get(f"/api/runs/{run}/events")],
    ]


@pytest.mark.parametrize(
    "servers",
    [
        "neither",
        pytest.param("here", marks=pytest.mark.services),
        pytest.param("there", marks=pytest.mark.services),
    ],
    indirect=True,
)
def test_a_project_comes_over_whole_with_the_same_ids(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers

    archive = here.client.export_project("default", tmp_path)
    came = there.client.import_project(archive, "default")

    assert [(run.outcome, run.why) for run in came.runs] == [("imported", None)] * 2
    assert came.checkpoints == 2
    assert everything(there, trained) == everything(here, trained)
    # To the bit, what was not finite included.
    with here.services.database.read() as mine, there.services.database.read() as theirs:
        run = trained["runs"][0]["id"]
        left, right = (MetricRepository(each).read(run)["train/return"] for each in (mine, theirs))
    assert np.array_equal(left.values, right.values, equal_nan=True)
    # A study comes with its trials, and does not go on by itself.
    with there.services.database.read() as session:
        study, trial = session.get_one(tables.Study, "s"), session.get_one(tables.StudyTrial, ("s", 0))
        assert (study.name, study.spec, study.state, study.created_at) == ("Search", SEARCHED, "done", 5.0)
        assert (trial.experiment_id, trial.state, trial.rungs) == (trained["id"], "stopped", {"3": [0.5, None]})
        kept = session.get_one(tables.Experiment, trained["id"])
        assert (kept.study_id, kept.campaign, kept.campaign_row) == ("s", "c1", "simple")
    # Who went on there waits here, to be resumed.
    second = there.http.get(f"/api/runs/{trained['runs'][1]['id']}").json()
    assert second["state"] == "stopped"
    assert there.http.post(f"/api/runs/{second['id']}/resume").status_code == 200
    # It is found by its settings.
    assert there.http.get("/api/experiments?query=algorithm.gamma%20%3D%200.97%20study%20%3D%20s").json()["total"] == 1
    actions = [each["action"] for each in here.http.get("/api/audit?action=project").json()["items"]]
    assert actions == ["project.exported"]
    (entry,) = there.http.get("/api/audit?action=project").json()["items"]
    assert (entry["action"], entry["details"]) == ("project.imported", "runs: 2 imported")

    again = there.client.import_project(archive, "default")
    assert [run.outcome for run in again.runs] == ["there", "there"]


LAB = {"name": "Lab", "width": 6.0, "height": 6.0, "circles": [{"x": 1.0, "y": 0.5, "radius": 0.3}]}


@pytest.fixture
def measured(client: TestClient, services: Services, job_worker: None) -> list[dict[str, Any]]:
    """A checkpoint on an imported arena, an uploaded policy on a suite of one's own, both driven; one that is refused."""
    here = Server(client, services)
    arena = {"name": "imported", "sha256": services.arenas.add(ArenaFile.model_validate(LAB))}
    task = shipped_policy("simple").card.training.task.model_dump(mode="json")
    run = here.reports.experiment("Measured", task={**task, "arena": arena})["runs"][0]
    policies: list[Any] = [{"source": "checkpoint", "id": checkpoint(here, run, 1_000, None)}]
    uploads: list[tuple[bytes, dict[str, Any]]] = [
        (bundle(export_checkpoint(SHIPPED)), {}),
        (graph(scale=float("nan")), {"task": {}}),
    ]
    for content, more in uploads:
        body = {"name": "From elsewhere", "content": base64.b64encode(content).decode(), **more}
        policies.append({"source": "uploaded", "id": client.post("/api/uploads", json=body).json()["id"]})
    suite = made(client)
    add(client, suite, scenario(services, "empty"))
    suites = [{"by": "arena", "arena": arena}, {"by": "scenarios", "id": suite}, {"by": "own"}]
    return [
        ended(client, client.post("/api/evaluations", json={"policies": [policy], "suites": [suite]}).json()[0])
        for policy, suite in zip(policies, suites, strict=True)
    ]


def others(http: TestClient, asked: list[dict[str, Any]]) -> list[Any]:
    """What the API says of uploads, arenas and evaluations."""
    get: Callable[[str], Any] = lambda path: http.get(path).raise_for_status().json()  # noqa: E731
    done = [each["id"] for each in asked if each["figures"]]
    return [
        get("/api/uploads"),
        [{**arena, "imported_at": None} for arena in get("/api/arenas")],
        # But for the job, which was the other server's.
        [{**get(f"/api/evaluations/{each['id']}"), "job_id": None} for each in asked],
        [get(f"/api/evaluations/{each}/episodes") for each in done],
        [get(f"/api/evaluations/{each}/ways") for each in done],
        [get(f"/api/leaderboards/{each['suite_hash']}") for each in asked if each["figures"]],
    ]


def test_what_was_measured_comes_along_and_back(
    client: TestClient, servers: tuple[Server, Server], measured: list[dict[str, Any]], tmp_path: Path
) -> None:
    assert [each["state"] for each in measured] == ["done", "done", "failed"]
    mine, (there, _) = mapless_client.Client(BASE_URL, http=client), servers

    came = there.client.import_project(mine.export_project("default", tmp_path), "default")

    kinds = [*[("arena", "imported")] * 2, *[("policy", "imported")] * 2, *[("evaluation", "imported")] * 3]
    assert [(each.kind, each.outcome) for each in came.others] == kinds
    before = others(client, measured)
    assert others(there.http, measured) == before
    # The files came to the bit, and a policy drives there: a new evaluation can be asked for, and is no old one.
    upload = before[0]["items"][0]["id"]
    with there.services.database.read() as theirs:
        file = theirs.get_one(tables.UploadedPolicy, upload).graph
    assert hashlib.sha256(file).hexdigest() == before[0]["items"][0]["sha256"]
    policy = {"source": "uploaded", "id": upload}
    (again,) = there.http.post("/api/evaluations", json={"policies": [policy]}).json()
    assert (again["state"], again["id"] in {each["id"] for each in measured}) == ("queued", False)

    # And back, where all of it was lost.
    archive = there.client.export_project("default", tmp_path / "back")
    for each in measured:
        assert client.delete(f"/api/evaluations/{each['id']}").status_code == 204
    for item in before[0]["items"]:
        assert client.delete(f"/api/uploads/{item['id']}").status_code == 204
    back = mine.import_project(archive, "default")
    assert [(each.kind, each.outcome) for each in back.others] == [("arena", "there")] * 2 + kinds[2:]
    assert others(client, measured) == before
    assert {each.outcome for each in mine.import_project(archive, "default").others} == {"there"}


def test_what_is_damaged_or_anothers_is_refused_beside_the_runs(
    client: TestClient, servers: tuple[Server, Server], measured: list[dict[str, Any]], tmp_path: Path
) -> None:
    there, _ = servers
    archive = mapless_client.Client(BASE_URL, http=client).export_project("default", tmp_path)

    def refused(change: Callable[[str, bytes], bytes | None]) -> dict[str, str]:
        answer = send(there, rewritten(archive, change)).json()
        return {each["kind"]: each["why"] for each in answer["others"] if each["outcome"] == "refused"}

    def damaged(name: str, content: bytes) -> bytes | None:
        if name.endswith(".onnx"):
            return content[:-1] + b"x"
        if name.startswith("arenas/"):
            return content.replace(b"0.3", b"0.4")
        return content if name.startswith(("policies/", "manifest", "evaluations/")) else None

    without_runs = refused(damaged)
    assert without_runs["arena"] == "it is not the arena of its hash"
    assert "SHA-256" in without_runs["policy"]
    assert "is not in this project" in without_runs["evaluation"]
    with there.services.database.read() as session:
        assert session.query(tables.UploadedPolicy).count() == session.query(tables.PolicyEvaluation).count() == 0
    # Nobody brings figures into another project by an archive: its policies are not theirs.
    other = there.http.post("/api/projects", json={"name": "Other"}).json()["id"]
    assert send(there, archive.read_bytes()).status_code == 200
    content = rewritten(archive, lambda name, content: content if name.startswith(("manifest", "evaluations/")) else None)
    for old in measured:
        content = content.replace(old["id"].encode(), old["id"][::-1].encode())
    answer = there.http.post(f"/api/projects/{other}/import", content=content).json()
    assert {each["outcome"] for each in answer["others"]} == {"refused"}


def test_what_is_everybodys_comes_along_where_an_administrator_brings_it(
    client: TestClient, servers: tuple[Server, Server], job_worker: None, tmp_path: Path
) -> None:
    policies = [{"source": "shipped", "name": "simple"}, {"source": "baseline", "name": "go-to-goal"}]
    body = {"policies": policies, "suites": [{"by": "name", "name": "simple-200"}]}
    asked = [ended(client, each) for each in client.post("/api/evaluations", json=body).json()]
    assert [each["state"] for each in asked] == ["done", "done"]
    there, _ = servers
    archive = mapless_client.Client(BASE_URL, http=client).export_project("default", tmp_path)

    # Nobody who may only edit a project puts figures onto everybody's leaderboards.
    with there.services.database.write() as session, pytest.raises(ConflictError, match="administrator"):
        take_evaluation(session, "default", archived(archive, asked[0]["id"]), of_everybodys=False)
    unknown = rewritten(
        archive, lambda _, content: content.replace(b'"shipped","name":"simple"', b'"shipped","name":"psychic"')
    )
    answer = send(there, unknown).json()["others"]
    assert {each["id"]: each["outcome"] for each in answer} == {asked[0]["id"]: "refused", asked[1]["id"]: "imported"}
    assert "psychic" in next(each["why"] for each in answer if each["why"])

    came = there.client.import_project(archive, "default")
    assert {each.id: each.outcome for each in came.others} == {asked[0]["id"]: "imported", asked[1]["id"]: "there"}
    assert others(there.http, asked) == others(client, asked)


@pytest.fixture(scope="module")
def drive() -> bytes:
    """What a robot recorded in the simulator."""
    return as_mcap(messages(simulated(seed=3, seconds=20.0, jitter=0.002, speed_noise=0.01, **task())))


def test_what_a_robot_recorded_comes_along_and_tells_the_same_there(
    client: TestClient,
    services: Services,
    servers: tuple[Server, Server],
    job_worker: None,
    drive: bytes,
    tmp_path: Path,
) -> None:
    recording = client.post("/api/recordings", params={"name": "corridor.mcap"}, content=drive).json()
    path = f"/api/recordings/{recording['id']}"
    beside = f"{path}/beside?shipped=complex"
    told = [client.get(path).json(), client.get(f"{path}/reading").json(), client.get(beside).json()]
    assert told[1]["fitted"]
    mine, (there, _) = mapless_client.Client(BASE_URL, http=client), servers
    archive = mine.export_project("default", tmp_path)

    came = there.client.import_project(archive, "default")

    assert [(each.kind, each.id, each.outcome) for each in came.others] == [("recording", recording["id"], "imported")]
    with there.services.database.read() as session:
        assert session.get_one(tables.Bag, recording["id"]).content == drive
    with working(there.http, there.services, tmp_path / "work"):
        assert [there.http.get(each).json() for each in (path, f"{path}/reading", beside)] == told
    assert [each.outcome for each in there.client.import_project(archive, "default").others] == ["there"]
    # And back, where it was lost.
    back = there.client.export_project("default", tmp_path / "back")
    assert client.delete(path).status_code == 204
    assert [each.outcome for each in mine.import_project(back, "default").others] == ["imported"]
    assert client.get(path).json() == recording


def test_a_recording_that_is_damaged_or_anothers_is_refused_by_name(
    servers: tuple[Server, Server], drive: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = servers
    recording, sound = (
        here.http.post("/api/recordings", params={"name": name}, content=drive).json()["id"] for name in ("a.mcap", "b.mcap")
    )
    archive = here.client.export_project("default", tmp_path)
    file = f"recordings/{recording}.bag"

    def sent(change: Callable[[str, bytes], bytes | None], project: str = "default") -> Any:
        return there.http.post(f"/api/projects/{project}/import", content=rewritten(archive, change))

    def others(answer: Any) -> dict[str, str | None]:
        return {each["id"]: each["why"] for each in answer.json()["others"]}

    def damaged(damage: Callable[[bytes], bytes], name: str, content: bytes) -> bytes:
        return damage(content) if name == file else content

    for damage in (lambda content: content[:-1] + b"x", lambda content: content[:-1], lambda _: b""):
        why = others(sent(partial(damaged, damage)))[recording]
        assert why == "a.mcap is damaged: its SHA-256 is not the one that was announced"
        with there.services.database.read() as session:
            assert session.get(tables.Bag, recording) is None
            assert session.get(tables.Bag, sound) is not None
    missing = sent(lambda name, content: None if name == file else content)
    assert (missing.status_code, f"the file of the recording {recording} is missing" in missing.text) == (400, True)
    large = sent(lambda name, content: bytes(MAX_BAG_BYTES + 1) if name == file else content)
    assert (large.status_code, "is larger than" in large.text) == (400, True)
    with monkeypatch.context() as patch:
        patch.setattr("server.project_archives.others.MAX_BAGS", 1)
        assert others(sent(lambda _, content: content)) == {
            recording: "There are 1 recordings already: delete some first.",
            sound: None,
        }
    # Of another project it is nobody's to bring in again.
    assert others(sent(lambda _, content: content)) == {recording: None, sound: None}
    other = there.http.post("/api/projects", json={"name": "Other"}).json()["id"]
    assert others(sent(lambda _, content: content, other)) == {
        each: f"This server has another recording of the id {each}." for each in (recording, sound)
    }


def archived(archive: Path, evaluation_id: str) -> ArchivedAskedEvaluation:
    """As it stands in an archive."""
    with tarfile.open(archive) as file:
        member = file.extractfile(f"evaluations/{evaluation_id}.json")
        assert member is not None
        return ArchivedAskedEvaluation.model_validate_json(member.read())


@pytest.mark.parametrize("number", [2, 3, 4, 5])
def test_an_archive_of_an_older_format_is_read(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path, number: int
) -> None:
    here, there = servers

    def older(name: str, content: bytes) -> bytes:
        if name == "manifest.json":
            assert b'"format":6' in content
            return content.replace(b'"format":6', b'"format":%d' % number)
        return content.replace(b'"thinned_at":null,', b"")

    archive = rewritten(here.client.export_project("default", tmp_path), older)
    assert [run["outcome"] for run in send(there, archive).json()["runs"]] == ["imported", "imported"]


@pytest.fixture
def thinned(servers: tuple[Server, Server], trained: dict[str, Any]) -> dict[str, Any]:
    """The first run's curves were thinned."""
    here, _ = servers
    run_id = trained["runs"][0]["id"]
    here.reports.state(trained["runs"][0], "completed", finished_at=1.0)
    with here.services.database.write() as session:
        session.get_one(tables.StudyTrial, ("s", 0)).state = "complete"
    service = CurveThinningService(here.services)
    service.change(trained["id"], CurveRule(points=100, after_days=0.0))
    service.mark_some(time.time(), 10)
    service.thin_some(time.time() + 8 * 86_400.0)
    shown: dict[str, Any] = here.http.get(f"/api/runs/{run_id}").json()
    assert shown["thinned"]["points"] == 9_000
    return shown


@pytest.mark.parametrize(
    "servers",
    [
        "neither",
        pytest.param("here", marks=pytest.mark.services),
        pytest.param("there", marks=pytest.mark.services),
    ],
    indirect=True,
)
def test_thinned_curves_come_over_with_their_mark(
    servers: tuple[Server, Server], trained: dict[str, Any], thinned: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers
    archive = here.client.export_project("default", tmp_path)
    assert [run.outcome for run in there.client.import_project(archive, "default").runs] == ["imported"] * 2

    path = f"/api/runs/{thinned['id']}"
    assert there.http.get(path).json()["thinned"] == thinned["thinned"]
    for points in (100_000, 1_000, 30):
        mine, theirs = (each.http.get(f"{path}/metrics?points={points}").json() for each in servers)
        assert theirs == mine
    # And it goes on from there: its buckets end where its checkpoint does.
    there.reports.cut(thinned, 2_000)
    there.reports.state(thinned, "stopped", step=2_000)
    (loss, back) = there.http.get(f"{path}/metrics?points=1000").json()["series"]
    assert (loss["steps"][-1], back["steps"][-1]) == (10, 2_000)
    assert there.http.get(path).json()["thinned"]["points"] == 2_000


def test_buckets_that_are_none_are_refused(servers: tuple[Server, Server], thinned: dict[str, Any], tmp_path: Path) -> None:
    here, there = servers
    archive = here.client.export_project("default", tmp_path)

    def refused(change: Callable[[Buckets], Buckets], *, without_points: bool = False) -> str:
        def changed(name: str, content: bytes) -> bytes | None:
            if name.endswith(".thinned"):
                head, _, data = content.partition(b"\n")
                count = json.loads(head)["count"]
                return head + b"\n" + change(Buckets.decode(data, count)).encode()
            return None if without_points and name.endswith(".points") else content

        answer = send(there, rewritten(archive, changed)).json()
        (run,) = [run for run in answer["runs"] if run["id"] == thinned["id"] and run["outcome"] == "refused"]
        with there.services.database.read() as session:
            assert session.get(tables.Run, thinned["id"]) is None
        why: str = run["why"]
        return why

    assert "is damaged" in refused(lambda all_: all_[:-1])
    assert "no buckets" in refused(lambda all_: replace(all_, sizes=-all_.sizes))
    assert "no buckets" in refused(lambda all_: replace(all_, finite=all_.sizes + 1))
    assert "no buckets" in refused(lambda all_: replace(all_, low=all_.high + 1.0))
    assert "no buckets" in refused(lambda all_: replace(all_, steps=all_.steps[::-1].copy()))
    assert "are missing" in refused(lambda all_: replace(all_, steps=all_.steps + 1_000_000))
    assert "are missing" in refused(lambda all_: all_, without_points=True)


def rewritten(archive: Path, change: Callable[[str, bytes], bytes | None]) -> bytes:
    """The archive with some of its files changed, or left out."""
    out = io.BytesIO()
    with tarfile.open(archive) as old, tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as new:
        for info in old:
            file = old.extractfile(info)
            assert file is not None
            content = change(info.name, file.read())
            if content is not None:
                info.size = len(content)
                new.addfile(info, io.BytesIO(content))
    return out.getvalue()


def send(server: Server, content: bytes) -> Any:
    return server.http.post("/api/projects/default/import", content=content)


def nothing_is_left(server: Server) -> None:
    with server.services.database.read() as session:
        for table in (tables.Run, tables.Checkpoint, tables.MetricChunk, tables.LooseArchive):
            assert session.query(table).count() == 0
    assert server.services.files.ids() == set()


def test_a_run_that_is_damaged_or_not_complete_is_not_taken_and_leaves_nothing(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers
    archive = here.client.export_project("default", tmp_path)
    first = trained["runs"][0]["id"]

    def damaged(kind: str, change: Callable[[bytes], bytes | None]) -> str:
        only_first = rewritten(
            archive,
            lambda name, content: (
                None
                if trained["runs"][1]["id"] in name
                else change(content)
                if name.endswith(kind) and first in name
                else content
            ),
        )
        (run,) = send(there, only_first).json()["runs"]
        assert run["outcome"] == "refused", kind
        nothing_is_left(there)
        why: str = run["why"]
        return why

    assert "SHA-256" in damaged(".zip", lambda content: content[:-1] + b"x")
    assert "is missing" in damaged(".zip", lambda _: None)
    assert "does not hold" in damaged("0.points", lambda content: content[:-40])

    # Cut off in the middle of the last run: what came before stays.
    whole = archive.read_bytes()
    response = send(there, whole[: len(whole) - 2 * 512 - 100])
    assert response.status_code == 400
    assert "ends too early" in response.json()["detail"]
    with there.services.database.read() as session:
        assert [run.id for run in session.query(tables.Run)] == [first]
    # Sent again, it goes on.
    assert [run["outcome"] for run in send(there, whole).json()["runs"]] == ["there", "imported"]


def test_a_run_whose_commit_was_never_answered_keeps_its_checkpoints(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = servers
    whole = here.client.export_project("default", tmp_path).read_bytes()
    register = ProjectArrival._register

    def unanswered(*arguments: Any) -> None:
        register(*arguments)
        raise DatabaseAwayError("The database can't be reached now.")

    with monkeypatch.context() as cut:
        cut.setattr(ProjectArrival, "_register", unanswered)
        assert send(there, whole).status_code == 503
    assert "there" in [run["outcome"] for run in send(there, whole).json()["runs"]]
    with there.services.database.read() as session:
        assert {checkpoint.id for checkpoint in session.query(tables.Checkpoint)} == there.services.files.ids() != set()


def test_what_is_here_already_is_refused_in_clear_words(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers
    archive = here.client.export_project("default", tmp_path)
    mine = there.reports.experiment("Mine")

    before = there.http.get(f"/api/experiments/{mine['id']}").json()
    answer = send(there, renamed(archive, trained["id"], mine["id"])).json()
    assert {run["why"] for run in answer["runs"]} == {f"This server has another training of the id {mine['id']}."}
    answer = send(there, renamed(archive, trained["runs"][0]["id"], mine["runs"][0]["id"])).json()
    assert [run["why"] for run in answer["runs"]] == ["This server has another run of that id.", None]
    assert there.http.get(f"/api/experiments/{mine['id']}").json() == before


def renamed(archive: Path, old: str, new: str) -> bytes:
    """The archive with another id of the same length everywhere."""
    out = io.BytesIO()
    with tarfile.open(archive) as source, tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as target:
        for info in source:
            file = source.extractfile(info)
            assert file is not None
            content = file.read()
            if info.name.endswith(".json"):
                content = content.replace(old.encode(), new.encode())
            info.name = info.name.replace(old, new)
            info.size = len(content)
            target.addfile(info, io.BytesIO(content))
    return out.getvalue()


def test_an_archive_of_the_first_format_is_read(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers

    def before(name: str, content: bytes) -> bytes | None:
        if name.startswith("studies/") or name.endswith(".log"):
            return None
        if name.endswith("experiment.json"):
            told = json.loads(content)
            return json.dumps({key: told[key] for key in told.keys() - {"campaign", "campaign_row", "study_id"}}).encode()
        return content.replace(b'"format":6', b'"format":1') if name == "manifest.json" else content

    archive = rewritten(here.client.export_project("default", tmp_path), before)
    assert [run["outcome"] for run in send(there, archive).json()["runs"]] == ["imported", "imported"]


def test_more_printed_lines_than_a_server_keeps_are_refused(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers
    flood = json.dumps({"attempt": 1, "first": 1, "lines": [[1.0, "x" * 60_000]] * 30}).encode()

    archive = rewritten(
        here.client.export_project("default", tmp_path), lambda name, content: flood if name.endswith(".log") else content
    )
    first, _ = send(there, archive).json()["runs"]
    assert (first["outcome"], "printed lines" in first["why"]) == ("refused", True)


@pytest.mark.parametrize("content", [b"", b"no archive at all", bytes(10_000), b"x" * 10_000])
def test_what_is_no_archive_is_refused(servers: tuple[Server, Server], content: bytes) -> None:
    assert send(servers[1], content).status_code == 400


def test_nothing_is_unpacked_beyond_what_was_promised(
    servers: tuple[Server, Server], trained: dict[str, Any], tmp_path: Path
) -> None:
    here, there = servers
    archive = here.client.export_project("default", tmp_path)
    bomb = b'{"name": "a", "count": 1}\n' + zlib.compress(bytes(50_000_000))

    answer = send(there, rewritten(archive, lambda name, content: bomb if name.endswith(".points") else content)).json()
    assert answer["runs"][0]["outcome"] == "refused"
    assert "does not hold 1 points" in answer["runs"][0]["why"]
