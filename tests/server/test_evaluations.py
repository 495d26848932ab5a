"""Any policy on any suite: asked for over the API, done by a worker, kept with every episode."""

import csv
import json
import math
import time
import zlib
from itertools import pairwise
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError

from server.database import tables
from server.evaluations.figures import figures_of
from server.services import Services
from sim.config import ArenaFile, TaskConfig
from tests.server.harness import Reports
from tests.server.people import Lab
from workers.job_protocol import MAX_WAY_POINTS, Measurement
from workers.shipped.library import shipped_policy

POLICY = shipped_policy("simple")
RECORDED = POLICY.evaluation("simple-200")


def ask(client: TestClient, policy: dict[str, Any], **more: Any) -> dict[str, Any]:
    suites = {"suites": [more["suite"]]} if "suite" in more else {}
    response = client.post("/api/evaluations", json={"policies": [policy], **suites})
    assert response.status_code == 202, response.text
    asked: dict[str, Any]
    (asked,) = response.json()
    return asked


def ended(client: TestClient, asked: dict[str, Any]) -> dict[str, Any]:
    deadline = time.monotonic() + 60.0
    while asked["state"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
        asked = client.get(f"/api/evaluations/{asked['id']}").json()
    return asked


def test_a_policy_on_a_suite_does_as_it_did(client: TestClient, job_worker: None) -> None:
    asked = ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "simple-200"})
    assert asked["title"] == POLICY.card.title
    done = ended(client, asked)
    assert (done["state"], done["error"], done["seconds_left"], done["progress"]) == ("done", None, None, 1.0)
    assert done["suite_hash"] == RECORDED.suite_hash
    assert done["figures"]["success"]["value"] == RECORDED.success_rate
    assert done["figures"]["success"]["low"] < RECORDED.success_rate <= done["figures"]["success"]["high"]
    episodes = client.get(f"/api/evaluations/{done['id']}/episodes").json()["episodes"]
    then = [(episode.outcome, episode.steps) for episode in RECORDED.episodes]
    assert [(episode["outcome"], episode["steps"]) for episode in episodes] == then
    # What its reward's terms came to is its return.
    names = [term.name for term in POLICY.card.training.task.reward.terms]
    assert [term["name"] for term in done["figures"]["terms"]] == names
    assert sum(term["value"] for term in done["figures"]["terms"]) == pytest.approx(done["figures"]["reward"], rel=1e-3)
    for row in client.get(f"/api/evaluations/{done['id']}/export?format=json").json()["episodes"]:
        assert sum(row["terms"].values()) == pytest.approx(row["reward"], rel=1e-3, abs=0.01)
    # Asked again, it is there; the job is to be seen in the queue.
    assert (
        ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "simple-200"})["id"] == done["id"]
    )
    (job,) = client.get("/api/jobs").json()["items"]
    assert (job["kind"], job["state"], job["title"]) == ("evaluate", "done", f"{POLICY.card.title} on simple-200")
    assert client.delete(f"/api/evaluations/{done['id']}").status_code == 204
    assert client.get("/api/evaluations").json() == {"items": [], "total": 0}


def test_a_baseline_in_an_imported_arena(client: TestClient, services: Services, job_worker: None) -> None:
    room = ArenaFile(name="room", width=6.0, height=6.0)
    sha256 = services.arenas.add(room)
    suite = {"by": "arena", "arena": {"name": "imported", "sha256": sha256}}
    done = ended(client, ask(client, {"source": "baseline", "name": "go-to-goal"}, suite=suite))
    assert (done["state"], done["suite"]) == ("done", "room-200")
    # Nothing stands in its way.
    assert done["figures"]["success"]["value"] > 0.9
    gone = {"by": "arena", "arena": {"name": "imported", "sha256": "0" * 64}}
    refused = client.post(
        "/api/evaluations", json={"policies": [{"source": "baseline", "name": "random"}], "suites": [gone]}
    )
    assert refused.status_code == 422


def test_what_cannot_be_done_says_why(client: TestClient, job_worker: None) -> None:
    failed = ended(client, ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "nowhere-9"}))
    assert failed["state"] == "failed"
    assert "there is no suite 'nowhere-9'" in failed["error"]
    assert client.post("/api/evaluations", json={"policies": [{"source": "shipped", "name": "nobody"}]}).status_code == 404
    # It may be asked for once more.
    again = ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "nowhere-9"})
    assert again["id"] != failed["id"]


def test_a_policy_on_a_suite_for_another_robot_is_refused_at_once_in_words(client: TestClient, reports: Reports) -> None:
    def refused(policies: list[dict[str, Any]], *suites: str) -> str:
        wanted = {"policies": policies, "suites": [{"by": "name", "name": name} for name in suites]}
        answer = client.post("/api/evaluations", json=wanted)
        assert answer.status_code == 400
        assert "Config(" not in answer.text
        detail: str = answer.json()["detail"]
        return detail

    run = reports.experiment("Mine", seeds=(3,))["runs"][0]
    burger = {"source": "checkpoint", "id": reports.checkpoint(run, 1, Reports.evaluation(8))}
    assert refused([burger], "barn-jackal-300") == (
        "Mine, seed 3, step 1: suite 'barn-jackal-300' is for the robot Jackal-like, and this policy drives TurtleBot3 "
        "Burger: measure it on a suite for any robot, or a policy that was trained for that one here."
    )
    # All or none, and how many more there are.
    simple = {"source": "shipped", "name": "simple"}
    assert refused([burger, simple], "simple-200", "people-500").endswith("1 more of these pairs can't be measured either.")
    assert client.get("/api/evaluations").json()["total"] == 0
    # A baseline takes the robot that the suite asks for, and any robot may drive where none is asked for.
    ask(client, {"source": "baseline", "name": "VFH+"}, suite={"by": "name", "name": "barn-jackal-300"})
    ask(client, burger, suite={"by": "name", "name": "barn-20"})


def test_what_takes_for_ever_is_ended(client: TestClient, job_worker: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workers.runtime.jobs.place.MAX_SECONDS", 0.0)
    failed = ended(client, ask(client, {"source": "baseline", "name": "MPPI"}))
    assert failed["state"] == "failed"
    assert "It took longer than 0 minutes, and was ended." in failed["error"]


def test_one_that_waits_can_be_taken_back_and_not_deleted(client: TestClient) -> None:
    asked = ask(client, {"source": "baseline", "name": "random"})
    assert (asked["state"], asked["progress"], asked["figures"]) == ("queued", 0.0, None)
    assert client.delete(f"/api/evaluations/{asked['id']}").status_code == 409
    assert client.get("/api/jobs").json()["workers"] == 0
    assert client.post(f"/api/evaluations/{asked['id']}/cancel").json()["state"] == "cancelled"
    assert client.get(f"/api/jobs/{asked['job_id']}").json()["state"] == "cancelled"
    assert client.delete(f"/api/evaluations/{asked['id']}").status_code == 204
    assert client.get("/api/jobs/0123456789abcdef").status_code == 404


def test_many_policies_are_measured_on_many_suites_at_once(client: TestClient) -> None:
    policies = [{"source": "baseline", "name": "random"}, {"source": "shipped", "name": "simple"}]
    suites = [{"by": "name", "name": "simple-200"}, {"by": "arena", "arena": {"name": "maze", "difficulty": 0.5}}]
    asked = client.post("/api/evaluations", json={"policies": policies, "suites": suites}).json()
    assert [(each["title"], each["choice"]["by"]) for each in asked] == [
        ("random", "name"),
        ("random", "arena"),
        (POLICY.card.title, "name"),
        (POLICY.card.title, "arena"),
    ]
    # The newest first, a page at a time.
    page = client.get("/api/evaluations", params={"limit": 3}).json()
    assert (len(page["items"]), page["total"]) == (3, 4)
    # All or none: one policy that is not there, and nothing is asked for.
    policies.append({"source": "shipped", "name": "nobody"})
    assert client.post("/api/evaluations", json={"policies": policies, "suites": suites}).status_code == 404
    assert client.get("/api/evaluations").json()["total"] == 4
    too_many = {"policies": [policies[0]] * 51, "suites": suites}
    refused = client.post("/api/evaluations", json=too_many)
    assert refused.status_code == 422
    assert "at most 100 at once" in refused.text


def test_a_training_stands_for_the_best_checkpoint_of_each_run(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Two seeds", seeds=(0, 1))
    training = {"policies": [{"source": "training", "id": experiment["id"]}]}
    assert "no run" in client.post("/api/evaluations", json=training).json()["detail"].lower()
    best = [
        [reports.checkpoint(run, step, Reports.evaluation(arrivals)) for step, arrivals in ((1, 5), (2, 9), (3, 7))][1]
        for run in experiment["runs"]
    ]
    asked = client.post("/api/evaluations", json=training).json()
    assert [each["policy"]["id"] for each in asked] == best
    assert [each["run_id"] for each in asked] == [run["id"] for run in experiment["runs"]]
    # Of one run, as its page asks.
    first = experiment["runs"][0]["id"]
    assert [each["id"] for each in client.get(f"/api/evaluations?run={first}").json()["items"]] == [asked[0]["id"]]


def test_where_robots_drove_can_be_drawn_and_any_episode_replayed(
    client: TestClient, services: Services, job_worker: None
) -> None:
    wall = ArenaFile.model_validate(
        {"name": "wall", "width": 6.0, "height": 6.0, "boxes": [{"x": 0.0, "y": 0.0, "length": 3.0, "width": 0.2}]}
    )
    suite = {"by": "arena", "arena": {"name": "imported", "sha256": services.arenas.add(wall)}}
    done = ended(client, ask(client, {"source": "baseline", "name": "go-to-goal"}, suite=suite))
    found = client.get(f"/api/evaluations/{done['id']}/ways").json()
    assert found["geometry"]["boxes"][0]["length"] == 3.0
    episodes = client.get(f"/api/evaluations/{done['id']}/episodes").json()["episodes"]
    assert [way["outcome"] for way in found["ways"]] == [episode["outcome"] for episode in episodes]
    for way, episode in zip(found["ways"], episodes, strict=True):
        ends, points = way["points"][-1], way["points"]
        distance = math.dist(ends, way["target"])
        # Go-to-goal is blind: it arrives, or ends at the wall.
        if way["outcome"] == "arrival":
            assert distance <= 0.2 + 0.02
        else:
            assert abs(ends[0]) < 1.5 + 0.3
            assert abs(ends[1]) < 0.1 + 0.3
        # The line is the way that was driven, but for what lies between its points.
        assert len(points) <= MAX_WAY_POINTS
        length = sum(math.dist(one, other) for one, other in pairwise(points))
        assert length == pytest.approx(episode["path_length"], rel=0.1, abs=0.1)
    assert {place["episodes"] for place in found["places"]} == {200}
    assert client.get(f"/api/evaluations/{done['id']}/ways", params={"arena": 1}).status_code == 404
    collided = next(index for index, episode in enumerate(episodes) if episode["outcome"] == "collision")
    replay = client.get(f"/api/evaluations/{done['id']}/replays/{collided}").json()
    assert (replay["outcome"], replay["steps"], replay["faithful"]) == ("collision", episodes[collided]["steps"], True)
    assert client.get(f"{replay['page']}light/").status_code == 200
    # What the robots did came along with the figures: nobody waited for it to be driven again.
    assert "replay" not in {job["kind"] for job in client.get("/api/jobs").json()["items"]}
    assert client.get(f"/api/replays/evaluation:{done['id']}/progress").json()["share"] == 1.0


def test_figures_by_hand() -> None:
    def episode(outcome: str, steps: int, path: float) -> dict[str, Any]:
        return {
            "outcome": outcome,
            "steps": steps,
            "reward": 2.0,
            "path_length": path,
            "shortest_path": 2.2,
            "min_clearance": 0.3,
        }

    # Nine episodes arrive, on ways that are 2 m long without the arrival circle; one drives twice as far, one collides.
    episodes = [episode("arrival", 50, 2.0)] * 8 + [episode("arrival", 100, 4.0), episode("collision", 10, 0.5)]
    measurement = Measurement.model_validate(
        {
            "result": {"suite": "s", "suite_hash": "h", "episodes": episodes},
            "task": TaskConfig().model_dump(mode="json"),
            "arenas": [{"name": "room", "width": 6.0, "height": 6.0}],
            "arena_indices": [0] * 10,
            "targets": [[1.0, 1.0]] * 10,
            "ways": [[[0.0, 0.0], [1.0, 1.0]]] * 10,
            "jerks": [0.5] * 5 + [1.5] * 5,
        }
    )
    found = figures_of(measurement, trained=True)
    assert found.success.value == 0.9
    assert found.spl == pytest.approx((8 * 1.0 + 0.5) / 10)
    assert found.worst_tenth_spl == 0.0
    assert found.steps == pytest.approx(500 / 9)
    assert found.seconds == pytest.approx(500 / 9 * TaskConfig().control_period)
    assert found.path_length == pytest.approx(20.0 / 9)
    assert (found.jerk, found.reward, found.collision) == (1.0, 2.0, 0.1)
    with pytest.raises(ValidationError, match="one arena, one target"):
        Measurement.model_validate(measurement.model_dump() | {"jerks": (1.0,)})


def test_an_evaluation_leaves_as_data_and_as_a_table(client: TestClient, reports: Reports) -> None:
    asked = ask(client, {"source": "baseline", "name": "VFH+"}, suite={"by": "name", "name": "simple-200"})
    address = f"/api/evaluations/{asked['id']}/export"
    assert "not measured yet" in client.get(address).json()["detail"]
    reports.measured(asked)
    answer = client.get(address)
    assert answer.headers["content-disposition"] == 'attachment; filename="mapless-vfh-on-simple-200.csv"'
    assert answer.headers["content-type"].startswith("text/csv")
    heading, first, *_, last = csv.reader(answer.text.splitlines())
    assert heading == [
        *("scenario", "map", "outcome", "steps", "seconds (s)", "path_length (m)", "shortest_path (m)"),
        *("spl", "clearance (m)", "jerk (m/s3)", "reward", "reward/arrival", "reward/collision"),
    ]
    # Ways end at the arrival circle, 0.2 m before the target: of 3.5 m 3.3 count.
    arrived = dict(zip(heading, first, strict=True))
    assert float(arrived.pop("spl")) == pytest.approx(3.3 / 4.0)
    assert list(arrived.values())[:7] == ["1", "room", "arrival", "80", "16.0", "4.0", "3.5"]
    assert list(arrived.values())[7:] == ["0.3", "0.5", "100.0", "100.0", "0.0"]
    assert last[:3] == ["10", "room", "collision"]
    assert last[-2:] == ["0.0", "-100.0"]
    whole = client.get(address, params={"format": "json"}).json()
    assert (whole["suite"], whole["figures"]["reward"], len(whole["episodes"])) == ("simple-200", 60.0, 10)
    assert whole["episodes"][9]["terms"] == {"arrival": 0.0, "collision": -100.0}
    # Eight of ten, exact (Clopper and Pearson 1934): 44.4 to 97.5 %.
    table = client.get(address, params={"format": "markdown"}).text
    assert "| Success (%) | 80.0 [44.4, 97.5] | 10 |" in table
    assert "| Steps to target | 80.0 [80.0, 80.0] | 8 |" in table
    assert "| Return by collision | -20.0 [-50.2, 10.2] | 10 |" in table
    paper = client.get(address, params={"format": "latex"}).text
    assert r"\toprule" in paper
    assert r"Success (\%) & 80.0 [44.4, 97.5] & 10" in paper
    # Kept by who has it.
    assert client.get(address, headers={"If-None-Match": answer.headers["etag"]}).status_code == 304


def test_what_was_measured_before_terms_were_kept_leaves_without_them(
    client: TestClient, services: Services, reports: Reports
) -> None:
    asked = ask(client, {"source": "baseline", "name": "VFH+"})
    reports.measured(asked)
    with services.database.write() as session:
        row = session.get_one(tables.PolicyEvaluation, asked["id"])
        kept = json.loads(zlib.decompress(row.ways or b""))
        row.ways = zlib.compress(json.dumps({name: kept[name] for name in list(kept)[:4]}).encode())
        row.figures = {name: value for name, value in (row.figures or {}).items() if name != "terms"}
    assert client.get(f"/api/evaluations/{asked['id']}").json()["figures"]["terms"] is None
    address = f"/api/evaluations/{asked['id']}/export"
    first = next(csv.DictReader(client.get(address).text.splitlines()))
    assert (first["map"], first["jerk (m/s3)"], "reward/arrival" in first) == ("room", "", False)
    assert "| Jerk (m/s³) | 0.500 | 10 |" in client.get(address, params={"format": "markdown"}).text


def test_each_sees_what_was_measured_of_what_they_may_see(client: TestClient, services: Services, reports: Reports) -> None:
    lab = Lab(services)
    here = lab.project("Here")
    member, stranger = lab.person("member", {here: "editor"}), lab.person("stranger", {lab.project("There"): "admin"})
    experiment = reports.experiment()
    client.patch(f"/api/experiments/{experiment['id']}", json={"project_id": here})
    checkpoint = reports.checkpoint(experiment["runs"][0], 1, Reports.evaluation(8))
    of_run, of_all = {"source": "checkpoint", "id": checkpoint}, {"source": "baseline", "name": "random"}
    both = client.post("/api/evaluations", json={"policies": [of_run, of_all]}).json()
    del client.headers["Authorization"]
    for person, sees in ((member, 2), (stranger, 1)):
        headers = lab.browser(person)
        assert client.get("/api/evaluations", headers=headers).json()["total"] == sees
        assert client.get(f"/api/evaluations/{both[0]['id']}", headers=headers).status_code == (200 if sees == 2 else 404)
        assert client.get(f"/api/evaluations/{both[1]['id']}", headers=headers).status_code == 200
        asked = client.post("/api/evaluations", json={"policies": [of_run]}, headers=headers)
        assert asked.status_code == (202 if sees == 2 else 404)
