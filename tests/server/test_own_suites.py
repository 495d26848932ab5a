"""Suites that people put together: arenas with a start and a target, measured on as built-in ones are."""

from typing import Any

from fastapi.testclient import TestClient

from server.services import Services
from sim.config import ArenaFile
from tests.server.test_evaluations import ask, ended


def scenario(services: Services, name: str, **more: Any) -> str:
    """An arena of the gallery with a start and a target, 3 m apart, and whatever else."""
    ends = {"start": {"x": -1.5, "y": 0.0}, "target": {"x": 1.5, "y": 0.0}}
    return services.arenas.add(ArenaFile.model_validate({"name": name, "width": 6.0, "height": 6.0, **ends, **more}))


def made(client: TestClient, name: str = "My lab") -> str:
    answer = client.post("/api/suites", json={"name": name})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def add(client: TestClient, suite: str, sha256: str) -> Any:
    return client.post(f"/api/suites/{suite}/scenarios", json={"sha256": sha256})


def names(client: TestClient) -> dict[str, list[str]]:
    return {suite["name"]: [one["name"] for one in suite["scenarios"]] for suite in client.get("/api/suites").json()}


def test_a_suite_is_put_together_scenario_by_scenario(client: TestClient, services: Services) -> None:
    suite = made(client)
    empty, walled = scenario(services, "empty"), scenario(services, "walled", circles=[{"x": 0.0, "y": 0.0, "radius": 0.5}])
    for sha256 in (empty, walled, empty):
        assert add(client, suite, sha256).status_code == 200
    assert names(client) == {"My lab": ["empty", "walled"]}
    assert client.post("/api/suites", json={"name": "My lab"}).status_code == 409
    # Its arenas stay as long as it has them.
    refused = client.delete(f"/api/arenas/imported/{empty}")
    assert (refused.status_code, "My lab" in refused.json()["detail"]) == (409, True)
    assert client.delete(f"/api/suites/{suite}/scenarios/{empty}").status_code == 200
    assert names(client) == {"My lab": ["walled"]}
    assert client.delete(f"/api/arenas/imported/{empty}").status_code == 204
    assert client.delete(f"/api/suites/{suite}").status_code == 204
    assert names(client) == {}
    assert client.get(f"/api/arenas/imported/{walled}").status_code == 200


def test_only_what_can_be_driven_is_a_scenario(client: TestClient, services: Services) -> None:
    suite = made(client)
    for more, reason in (
        ({"target": None}, "comes without a start and a target"),
        ({"circles": [{"x": 1.5, "y": 0.0, "radius": 0.5}]}, "a robot needs 0.2 m"),
        ({"boxes": [{"x": 0.0, "y": 0.0, "length": 0.2, "width": 6.0}]}, "There is no way from the start to the target"),
    ):
        refused = add(client, suite, scenario(services, "no", **more))
        assert (refused.status_code, reason in refused.json()["detail"]) == (422, True), refused.text
    assert add(client, suite, "0" * 64).status_code == 404
    assert add(client, "nowhere", scenario(services, "yes")).status_code == 404
    answer = client.post(
        "/api/evaluations",
        json={"policies": [{"source": "baseline", "name": "random"}], "suites": [{"by": "scenarios", "id": suite}]},
    )
    assert (answer.status_code, "has no scenario yet" in answer.json()["detail"]) == (400, True)


def test_it_is_measured_on_and_has_a_leaderboard_of_its_scenarios(
    client: TestClient, services: Services, job_worker: None
) -> None:
    suite = made(client)
    add(client, suite, scenario(services, "empty"))
    choice = {"by": "scenarios", "id": suite}
    first = ended(client, ask(client, {"source": "baseline", "name": "go-to-goal"}, suite=choice))
    assert (first["state"], first["suite"], first["figures"]["episodes"]) == ("done", "My lab (1)", 1), first["error"]
    assert first["figures"]["success"]["value"] == 1.0
    # With one scenario more it is another suite, and what was measured before stays where it was.
    add(client, suite, scenario(services, "walled", circles=[{"x": 0.0, "y": 0.0, "radius": 0.5}]))
    second = ended(client, ask(client, {"source": "baseline", "name": "go-to-goal"}, suite=choice))
    third = ended(client, ask(client, {"source": "baseline", "name": "dynamic window"}, suite=choice))
    assert second["suite"] == third["suite"] == "My lab (2)"
    assert second["suite_hash"] == third["suite_hash"] != first["suite_hash"]
    board = client.get(f"/api/leaderboards/{second['suite_hash']}").json()
    assert [(entry["title"], entry["success"]["value"]) for entry in board["entries"]] == [
        (third["title"], 1.0),
        (second["title"], 0.5),
    ]
    assert len(client.get(f"/api/leaderboards/{first['suite_hash']}").json()["entries"]) == 1
    # It is driven again from the arenas that it had then.
    ways = client.get(f"/api/evaluations/{second['id']}/ways").json()
    assert [place["name"] for place in ways["places"]] == ["walled", "empty"]
