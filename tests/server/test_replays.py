"""Replays: an episode of a recorded evaluation is driven again, and its page plays it with nothing else."""

import asyncio
import base64
import io
import math
import os
import re
import shutil
import time
from collections import defaultdict
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zstandard
from fastapi.testclient import TestClient
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from server.app import create_app
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.experiments.service import ExperimentService
from server.jobs.results import ResultStore
from server.policies.service import shipped_hash
from server.replays.ahead import make_ahead
from server.replays.simulator import simulator
from server.services import Services
from server.settings import Settings
from server.worker_api.ingest import Report
from server.worker_api.service import WorkerService
from sim.scan import scan
from sim.suites import load_suite
from tests.server.harness import BASE_URL, TOKEN
from workers.protocol import Batch, Final, Orders
from workers.reporting import EpisodeResult, EvaluationResult
from workers.shipped.library import shipped_policy

POLICY = shipped_policy("complex")
RECORDED = POLICY.evaluation("complex-200")


def store_checkpoint(client: TestClient, services: Services, archive: bytes, recorded: EvaluationResult | None) -> str:
    """The archive as a checkpoint of a new run; its id."""
    training = POLICY.card.training.model_dump(mode="json")
    created = client.post("/api/experiments", json={"name": "Tür <b>", "seeds": [4], "training": training})
    assert created.status_code == 201, created.text

    async def blocks() -> AsyncIterator[bytes]:
        yield archive

    file = asyncio.run(services.files.write(os.urandom(8).hex(), blocks()))
    with services.database.write() as session:
        CheckpointRepository(session).add(created.json()["runs"][0]["id"], 81_920, file, recorded)
    return file.id


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all of these tests keep their recordings, so that each is made once."""
    return tmp_path_factory.mktemp("replays")


@pytest.fixture(autouse=True)
def _keep(services: Services, kept: Path, job_worker: None) -> None:
    services.results = ResultStore(kept, max_bytes=2**30)


@pytest.fixture
def checkpoint(client: TestClient, services: Services) -> str:
    return store_checkpoint(client, services, POLICY.archive.read_bytes(), RECORDED)


def recording_in(page: str) -> dict[str, object]:
    """The `.viser` file inside a page, unpacked."""
    (data,) = re.findall(r'__VISER_EMBED_DATA__="([A-Za-z0-9+/=]+)"', page)
    packed = base64.b64decode(data)
    unpacked = zstandard.ZstdDecompressor().decompress(packed[8:], max_output_size=int.from_bytes(packed[:8], "little"))
    length = int.from_bytes(unpacked[:8], "little")
    content: dict[str, object] = msgspec.msgpack.decode(unpacked[8 : 8 + length])
    return content


def test_an_episode_is_replayed_as_it_was_recorded(client: TestClient, checkpoint: str) -> None:
    replay = client.get(f"/api/checkpoints/{checkpoint}/replays/7").json()
    recorded = RECORDED.episodes[7]
    assert (replay["outcome"], replay["steps"], replay["faithful"]) == (recorded.outcome, recorded.steps, True)
    assert replay["seconds"] == pytest.approx(0.2 * recorded.steps)

    page = client.get(f"{replay['page']}dark/")

    assert page.status_code == 200
    assert "darkMode:true" in page.text
    assert f"after {recorded.steps} steps" in page.text
    # Names are people's own.
    assert "Tür &lt;b&gt;, seed 4, step 81\u202f920" in page.text
    content = recording_in(page.text)
    assert content["durationSeconds"] == pytest.approx(0.2 * recorded.steps + 1.5)
    times = [time for time, _ in content["messages"]]  # type: ignore[attr-defined]
    assert times == sorted(times)
    # From the second picture on, everything moves twenty times a second.
    assert len(set(times)) == pytest.approx(20 * 0.2 * recorded.steps, rel=0.02)


def test_all_episodes_after_the_first_come_at_once(client: TestClient, checkpoint: str, kept: Path) -> None:
    assert client.get(f"/api/checkpoints/{checkpoint}/replays/0").status_code == 200
    files = {path: path.stat().st_ino for path in kept.iterdir()}
    started = time.monotonic()
    for episode in range(1, 200, 10):
        replay = client.get(f"/api/checkpoints/{checkpoint}/replays/{episode}").json()
        assert (replay["outcome"], replay["steps"]) == (RECORDED.episodes[episode].outcome, RECORDED.episodes[episode].steps)
    assert time.monotonic() - started < 10.0
    assert {path: path.stat().st_ino for path in kept.iterdir()} == files


def test_a_shipped_policy_is_replayed_too(client: TestClient) -> None:
    replay = client.get("/api/policies/complex/suites/complex-200/replays/199").json()
    assert replay["suite"] == "complex-200"
    assert replay["steps"] == RECORDED.episodes[199].steps
    download = client.get(f"{replay['page']}light/?download")
    assert download.headers["content-disposition"] == 'attachment; filename="mapless-complex-episode199.html"'
    assert "darkMode:false" in download.text
    assert 'data-theme="light"' in download.text


def test_what_another_simulator_drove_is_driven_again(
    client: TestClient, kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert client.get("/api/policies/complex/suites/complex-200/replays/0").status_code == 200
    jobs = client.get("/api/jobs").json()["total"]
    monkeypatch.setattr("server.replays.recordings.simulator", lambda: "another")
    assert client.get("/api/policies/complex/suites/complex-200/replays/0").status_code == 200
    assert client.get("/api/jobs").json()["total"] == jobs + 1
    assert any("another" in path.name for path in kept.iterdir())


def test_what_ended_otherwise_than_recorded_says_so(client: TestClient, services: Services) -> None:
    first = EpisodeResult(outcome="collision", steps=3, reward=-100.0, path_length=0.1, shortest_path=3.0, min_clearance=0.0)
    recorded = RECORDED.model_copy(update={"episodes": (first, *RECORDED.episodes[1:])})
    checkpoint = store_checkpoint(client, services, POLICY.archive.read_bytes(), recorded)
    assert client.get(f"/api/checkpoints/{checkpoint}/replays/1").json()["faithful"]
    replay = client.get(f"/api/checkpoints/{checkpoint}/replays/0").json()
    assert not replay["faithful"]
    assert "ended otherwise than recorded" in client.get(f"{replay['page']}light/").text


SHIPPED = "policy:complex:complex-200"


def test_two_policies_drive_one_scenario_side_by_side(client: TestClient, services: Services, kept: Path) -> None:
    other = store_checkpoint(client, services, POLICY.archive.read_bytes(), RECORDED)
    both = f"{SHIPPED},checkpoint:{other}"
    replay = client.get(f"/api/replays/{both}/7").json()
    assert [each["of"] for each in replay["policies"]] == both.split(",")
    assert [each["colour"] for each in replay["policies"]] == ["#339af0", "#ff922b"]
    assert {(each["steps"], each["outcome"], each["faithful"]) for each in replay["policies"]} == {
        (RECORDED.episodes[7].steps, RECORDED.episodes[7].outcome, True)
    }
    # One archive on one suite is driven once, whoever asks for it.
    assert client.get(f"/api/replays/{both}/progress").json() == {"ready": 2, "policies": 2, "share": 1.0}
    page = client.get(f"{replay['page']}light/")
    assert page.status_code == 200
    names = {name for _, message in recording_in(page.text)["messages"] if (name := message.get("name"))}  # type: ignore[attr-defined]
    assert {"/world/chassis", "/world/beside1/chassis", "/world/ends/0", "/world/ends/1"} <= names
    assert "Tür &lt;b&gt;, seed 4, step 81\u202f920" in page.text
    download = client.get(f"{replay['page']}light/?download")
    assert download.headers["content-disposition"] == 'attachment; filename="mapless-complex-and-1-more-episode7.html"'


def test_who_drove_the_same_scenarios_is_offered(client: TestClient, services: Services) -> None:
    mine = store_checkpoint(client, services, POLICY.archive.read_bytes(), RECORDED)
    offered = client.get(f"/api/replays/checkpoint:{mine}/beside").json()
    assert offered["suite"] == "complex-200"
    rates = {each["of"]: each["success"] for each in offered["items"]}
    arrived = sum(episode.outcome == "arrival" for episode in RECORDED.episodes)
    assert rates[SHIPPED] == arrived / len(RECORDED.episodes)
    assert f"checkpoint:{mine}" not in rates
    (evaluation,) = client.post(
        "/api/evaluations",
        json={"policies": [{"source": "baseline", "name": "go-to-goal"}], "suites": [{"by": "name", "name": "complex-200"}]},
    ).json()
    while client.get(f"/api/evaluations/{evaluation['id']}").json()["figures"] is None:
        time.sleep(0.2)
    offered = client.get(f"/api/replays/checkpoint:{mine}/beside").json()["items"]
    (baseline,) = (each for each in offered if each["of"] == f"evaluation:{evaluation['id']}")
    assert baseline["title"] == "go-to-goal"
    # A baseline has no archive, and is driven again like any other.
    replay = client.get(f"/api/replays/checkpoint:{mine},{baseline['of']}/3").json()
    assert [each["faithful"] for each in replay["policies"]] == [True, True]


def test_series_are_those_of_the_episode(client: TestClient, checkpoint: str) -> None:
    (series,) = client.get(f"/api/replays/checkpoint:{checkpoint}/7/series").json()["policies"]
    steps = RECORDED.episodes[7].steps
    assert series["times"] == pytest.approx([0.2 * moment for moment in range(steps + 1)])
    by_name = {(each["chart"], each["name"]): each["values"] for each in series["series"]}
    assert all(len(values) == steps + 1 for values in by_name.values())
    assert by_name["linear", "asked for"][1:] == pytest.approx(by_name["linear", "driven"][1:], abs=1e-3)
    terms = [values for (chart, name), values in by_name.items() if chart == "reward" and name != "all"]
    assert {name for chart, name in by_name if chart == "reward"} == {"all"} | {
        term.name for term in POLICY.card.training.task.reward.terms
    }
    assert sum(map(sum, terms)) == pytest.approx(RECORDED.episodes[7].reward, rel=1e-3)
    assert max(by_name["ahead", "range ahead"]) <= 3.5
    assert by_name["value", "return to come"][-1] == 0.0


def test_an_episode_is_read_back_from_its_mcap_by_the_public_reader(client: TestClient, checkpoint: str) -> None:
    """As Foxglove and ROS read it: by the schemas in the file."""
    response = client.get(f"/api/replays/checkpoint:{checkpoint}/7/mcap")
    assert response.headers["content-disposition"].endswith('-episode7.mcap"')
    by_topic: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    schemas = {}
    reader = make_reader(io.BytesIO(response.content), decoder_factories=[DecoderFactory()])
    assert reader.get_header().profile == "ros2"
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        assert schema is not None
        schemas[channel.topic] = schema.name
        by_topic[channel.topic].append((message.log_time, decoded))
    assert schemas == {
        "/scan": "sensor_msgs/msg/LaserScan",
        "/odom": "nav_msgs/msg/Odometry",
        "/cmd_vel": "geometry_msgs/msg/TwistStamped",
        "/goal_pose": "geometry_msgs/msg/PoseStamped",
        "/tf": "tf2_msgs/msg/TFMessage",
    }
    steps = RECORDED.episodes[7].steps
    assert {topic: len(messages) for topic, messages in by_topic.items()} == {
        "/scan": steps + 1,
        "/odom": steps + 1,
        "/cmd_vel": steps,
        "/goal_pose": 1,
        "/tf": steps + 1,
    }
    suite = load_suite("complex-200")
    lidar = POLICY.card.training.task.lidar
    stamp, odometry = by_topic["/odom"][5]
    assert stamp == 2 * 10**9
    assert (odometry.header.stamp.sec, odometry.header.stamp.nanosec) == (2, 0)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")
    start = by_topic["/odom"][0][1].pose.pose
    assert (start.position.x, start.position.y) == pytest.approx(suite.starts[7, :2], abs=1e-5)
    assert 2.0 * math.atan2(start.orientation.z, start.orientation.w) == pytest.approx(suite.starts[7, 2], abs=1e-5)
    goal = by_topic["/goal_pose"][0][1].pose.position
    assert (goal.x, goal.y) == pytest.approx(suite.targets[7], abs=1e-5)
    # The command of a moment is what the robot does until the next one.
    assert by_topic["/cmd_vel"][4][1].twist.linear.x == pytest.approx(odometry.twist.twist.linear.x, abs=1e-3)
    assert by_topic["/cmd_vel"][4][1].twist.angular.z == pytest.approx(odometry.twist.twist.angular.z, abs=1e-3)
    scanned = by_topic["/scan"][0][1]
    assert len(scanned.ranges) == lidar.rays
    assert scanned.angle_max == pytest.approx(scanned.angle_min + (lidar.rays - 1) * scanned.angle_increment)
    true = scan(suite.arenas[suite.arena_indices[7]], suite.starts[7:8], lidar)[0]
    assert [min(each, 3.5) for each in scanned.ranges] == pytest.approx(true, abs=2e-3)
    assert {each.child_frame_id for each in by_topic["/tf"][0][1].transforms} == {"base_link", "base_scan"}


def test_what_was_not_measured_on_one_suite_is_not_shown_together(client: TestClient) -> None:
    response = client.get("/api/replays/policy:complex:complex-200,policy:simple:simple-200/0")
    assert response.status_code == 409
    assert "different suites" in response.json()["detail"]


@pytest.mark.parametrize(
    "path",
    [
        "/api/replays/nothing/0",
        "/api/replays/checkpoint:0123456789abcdef/0",
        "/api/replays/policy:complex/0",
        "/api/replays/policy:complex:simple-200/0/series",
        f"/api/replays/{SHIPPED}/200/mcap",
        f"/api/replays/{SHIPPED},{','.join(f'checkpoint:{number}' for number in range(6))}/0",
        "/api/checkpoints/0123456789abcdef/replays/0",
        "/api/policies/nobody/suites/simple-200/replays/0",
        "/api/policies/simple/suites/clutter-500/replays/0",
        "/api/policies/simple/suites/simple-200/replays/200",
        "/api/policies/simple/suites/simple-200/replays/-1",
        "/replays/policy:simple:simple-200/200/dark/",
    ],
)
def test_there_is_no_other_replay(client: TestClient, path: str) -> None:
    assert client.get(path).status_code == 404


def test_without_an_evaluation_there_is_nothing_to_replay(client: TestClient, services: Services) -> None:
    checkpoint = store_checkpoint(client, services, b"archive", None)
    response = client.get(f"/api/checkpoints/{checkpoint}/replays/0")
    assert response.status_code == 404
    assert "has not been evaluated" in response.json()["detail"]


def test_a_damaged_archive_says_why_it_is_not_replayed(client: TestClient, services: Services, kept: Path) -> None:
    before = sorted(kept.iterdir())
    checkpoint = store_checkpoint(client, services, b"not an archive", RECORDED)
    response = client.get(f"/api/checkpoints/{checkpoint}/replays/0")
    assert response.status_code == 500
    assert "is not a readable archive" in response.json()["detail"]
    assert sorted(kept.iterdir()) == before


def test_a_suite_that_has_changed_is_not_passed_off_as_the_old_one(
    client: TestClient, services: Services, kept: Path, tmp_path: Path
) -> None:
    # What driving it again would give is there already.
    assert client.get("/api/policies/complex/suites/complex-200/replays/0").status_code == 200
    whose = f"{shipped_hash('complex')[:32]}-{RECORDED.suite_hash[:16]}-{simulator()}"
    (made,) = (path for path in kept.iterdir() if path.name.startswith(whose))
    shutil.copy(made, tmp_path / made.name.replace(RECORDED.suite_hash[:16], "0" * 16))
    services.results = ResultStore(tmp_path, max_bytes=2**30)
    changed = RECORDED.model_copy(update={"suite_hash": "0" * 64})
    checkpoint = store_checkpoint(client, services, POLICY.archive.read_bytes(), changed)
    response = client.get(f"/api/checkpoints/{checkpoint}/replays/0")
    assert response.status_code == 500
    assert "has changed since" in response.json()["detail"]


def test_players_need_a_login(settings: Settings) -> None:
    with TestClient(create_app(settings), base_url=BASE_URL) as stranger:
        assert stranger.get("/replays/policy:simple:simple-200/0/dark/").status_code == 401
        stranger.headers["Authorization"] = f"Bearer {TOKEN}"
        # viser's client would play any file that its address names.
        redirected = stranger.get(
            "/replays/policy:simple:simple-200/0/dark/?playbackPath=//evil.example/x.viser", follow_redirects=False
        )
        assert redirected.headers["location"] == "/replays/policy:simple:simple-200/0/dark/"


def test_recordings_that_nobody_looked_at_go_first(
    client: TestClient, services: Services, checkpoint: str, tmp_path: Path
) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "old.npz").write_bytes(b"x" * 1000)
    os.utime(kept / "old.npz", (1.0, 1.0))
    services.results = ResultStore(kept, max_bytes=1)
    assert client.get(f"/api/checkpoints/{checkpoint}/replays/0").status_code == 200
    # The bound is a byte: only the newest stays, whatever its size.
    assert not (kept / "old.npz").exists()
    assert len(list(kept.iterdir())) == 1


def test_what_was_made_ahead_goes_before_what_somebody_looked_at(tmp_path: Path) -> None:
    store = ResultStore(tmp_path / "kept", max_bytes=1_000)

    def keep(name: str, size: int, *, ahead: bool = False) -> None:
        torn = store.begin()
        torn.write_bytes(b"x" * size)
        store.keep(torn, name, ahead=ahead)

    def kept() -> set[str]:
        return {path.name for path in (tmp_path / "kept").iterdir()}

    keep("seen", 600)
    keep("a-ahead", 100, ahead=True)
    os.utime(tmp_path / "kept" / "a-ahead", (1.0, 1.0))
    keep("b-ahead", 200, ahead=True)
    # A quarter of the bound is for what nobody has looked at: the oldest of it went.
    assert kept() == {"seen", "b-ahead"}
    keep("more", 350)
    assert kept() == {"seen", "more"}
    # It pushes nothing out that somebody has looked at.
    keep("c-ahead", 60, ahead=True)
    assert kept() == {"seen", "more"}
    keep("d-ahead", 50, ahead=True)
    assert store.find("d-ahead") is not None
    os.utime(tmp_path / "kept" / "seen", (time.time() - 60.0,) * 2)
    # Looked at, it is like all others.
    keep("new", 100)
    assert kept() == {"more", "d-ahead", "new"}
    store.forget("d-")
    assert kept() == {"more", "new"}


def run_of(services: Services, checkpoint_id: str) -> str:
    with services.database.read() as session:
        return CheckpointRepository(session).get(checkpoint_id).run_id


def complete(services: Services, run_id: str) -> None:
    """A worker says that the run is complete."""
    with services.database.write() as session:
        run = session.get_one(tables.Run, run_id)
        run.state, run.attempt = "running", 1
    (outcome,) = WorkerService(services).receive([Report(run_id, 1, Batch(final=Final(outcome="completed")))])
    assert isinstance(outcome, Orders), outcome


def test_the_episodes_of_a_run_that_is_complete_are_there_before_anybody_looks(
    client: TestClient, services: Services, checkpoint: str, tmp_path: Path
) -> None:
    services.results = ResultStore(tmp_path / "ahead", max_bytes=2**30)
    run_id = run_of(services, checkpoint)
    complete(services, run_id)
    worst, best = (
        rank(enumerate(RECORDED.episodes), key=lambda each: (each[1].outcome == "arrival", each[1].min_clearance))[0]
        for rank in (min, max)
    )
    assert worst != best
    deadline = time.monotonic() + 100.0
    # The recording, and two episodes in two themes.
    while len(made := [path for path in (tmp_path / "ahead").glob("*") if path.suffix != ".part"]) < 5:
        assert time.monotonic() < deadline, made
        time.sleep(0.1)
    # Nobody has looked at any of it, so that it goes before all that somebody has.
    assert max(path.stat().st_mtime for path in made) < time.time() - 1e8
    while any(job["state"] != "done" for job in client.get("/api/jobs").json()["items"]):
        time.sleep(0.05)
    # The first look asks nobody for anything.
    assert client.get(f"/api/checkpoints/{checkpoint}/replays/{worst}").json()["faithful"]
    for episode in (worst, best):
        for theme in ("light", "dark"):
            assert client.get(f"/replays/checkpoint:{checkpoint}/{episode}/{theme}/").status_code == 200
    assert client.get("/api/jobs").json()["total"] == 5
    # Nor is it made twice.
    make_ahead(services, run_id)
    assert client.get("/api/jobs").json()["total"] == 5
    # The recording goes with its run.
    (recording,) = (tmp_path / "ahead").glob("*.npz")
    experiment_id = client.get(f"/api/runs/{run_id}").json()["experiment_id"]
    assert client.delete(f"/api/experiments/{experiment_id}").status_code == 204
    assert recording.exists()
    ExperimentService(services).remove(experiment_id)
    assert not recording.exists()


def test_nothing_is_made_ahead_of_a_trial_or_of_what_was_not_measured(
    client: TestClient, services: Services, checkpoint: str
) -> None:
    bare = store_checkpoint(client, services, POLICY.archive.read_bytes(), None)
    make_ahead(services, run_of(services, bare))
    run_id = run_of(services, checkpoint)
    services.results = ResultStore(services.settings.replays_dir / "empty", max_bytes=2**30)
    with services.database.write() as session:
        experiment = session.get_one(tables.Run, run_id).experiment
        session.add(tables.Study(id="study", project_id=experiment.project_id, name="A study", spec={}, budget=1))
        session.flush()
        experiment.study_id = "study"
    make_ahead(services, run_id)
    make_ahead(services, "gone")
    assert client.get("/api/jobs").json()["total"] == 0


def test_a_time_lapse_shows_the_same_scenarios_at_every_checkpoint(
    client: TestClient, services: Services, kept: Path
) -> None:
    first = store_checkpoint(client, services, POLICY.archive.read_bytes(), RECORDED)
    with services.database.write() as session:
        run_id = CheckpointRepository(session).get(first).run_id
        for number in range(1, 12):

            async def blocks() -> AsyncIterator[bytes]:
                yield POLICY.archive.read_bytes()

            file = asyncio.run(services.files.write(os.urandom(8).hex(), blocks()))
            CheckpointRepository(session).add(run_id, 81_920 + 1_000 * number, file, RECORDED)
    lapse = client.get(f"/api/runs/{run_id}/lapse").json()
    steps = [chapter["step"] for chapter in lapse["chapters"]]
    assert (len(steps), steps[0], steps[-1], lapse["scenarios"]) == (8, 81_920, 92_920, 8)
    assert client.get(f"/api/runs/{run_id}/lapse/progress").json() == {"ready": 8, "policies": 8, "share": 1.0}
    page = client.get(f"{lapse['page']}light/")
    assert page.status_code == 200
    assert "Step 92\\u202f920: " in page.text
    content = recording_in(page.text)
    last = lapse["chapters"][-1]["begins"]
    assert last < content["durationSeconds"] <= last + 8.0
    messages = content["messages"]
    marked = {message["name"]: at for at, message in messages if message.get("name", "").startswith("/world/ends/7-")}  # type: ignore[attr-defined]
    assert len(marked) == 8
    assert min(marked.values()) >= last
    removed = [at for at, message in messages if message["type"] == "RemoveSceneNodeMessage"]  # type: ignore[attr-defined]
    assert len(removed) == 7 * 8


def test_a_run_without_a_measured_checkpoint_has_no_time_lapse(client: TestClient, services: Services) -> None:
    checkpoint = store_checkpoint(client, services, b"archive", None)
    with services.database.read() as session:
        run_id = CheckpointRepository(session).get(checkpoint).run_id
    response = client.get(f"/api/runs/{run_id}/lapse")
    assert response.status_code == 404
    assert "nothing to look back at" in response.json()["detail"]
