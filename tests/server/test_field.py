"""Families by policies: what ships, beside baselines of equal sight, and what people had measured themselves."""

from typing import Any

from fastapi.testclient import TestClient

from server.services import Services
from sim.config import TaskConfig
from tests.server.harness import Reports
from tests.server.people import Lab
from workers.shipped.field import field
from workers.shipped.library import shipped_policies


def test_what_ships_stands_beside_baselines_that_see_as_much_the_hardest_family_first(client: TestClient) -> None:
    found = client.get("/api/field").json()
    best = [max(row.success for row in field().rows if row.policy and row.suite == family) for family in found["families"]]
    assert best == sorted(best)
    assert found["families"][0] == "maze"
    assert found["asked"] == []
    policies: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {}
    for sight in found["sights"]:
        assert {driver["title"] for driver in sight["drivers"] if not driver["trained"]} >= {"VFH+"}
        trained = [driver["trained"] for driver in sight["drivers"]]
        assert trained == sorted(trained, reverse=True)
        policies |= {driver["policy"]: (sight, driver) for driver in sight["drivers"] if driver["trained"]}
    # Another robot than the default one, which the baselines drive, would stand beside them on other terms.
    usual = [each for each in shipped_policies() if each.card.training.task.robot == TaskConfig().robot]
    assert set(policies) == {each.card.name for each in usual}
    for each in usual:
        sight, driver = policies[each.card.name]
        lidar = each.card.training.task.lidar
        assert (sight["rays"], sight["field_of_view"]) == (lidar.rays, lidar.field_of_view)
        for family, cell in zip(found["families"], driver["cells"], strict=True):
            rows = [row for row in field().rows if row.policy == each.card.name and row.suite == family]
            assert cell["success"]["seeds"] == len(rows)
            assert cell["success"]["episodes"] == sum(row.episodes for row in rows)
            assert cell["success"]["low"] <= cell["success"]["value"] <= cell["success"]["high"]
            assert cell["evaluation"] is None


def test_evaluations_at_difficulty_one_stand_below_for_who_may_see_them(
    client: TestClient, services: Services, reports: Reports
) -> None:
    lab = Lab(services)
    here = lab.project("Here")
    member, stranger = lab.person("member", {here: "viewer"}), lab.person("stranger", {lab.project("There"): "admin"})
    experiment = reports.experiment("Mine")
    client.patch(f"/api/experiments/{experiment['id']}", json={"project_id": here})
    checkpoint = reports.checkpoint(experiment["runs"][0], 1, Reports.evaluation(7))
    suites = [{"by": "arena", "arena": {"name": family, "difficulty": 1.0}} for family in ("maze", "rooms", "clutter")]
    asked = client.post(
        "/api/evaluations", json={"policies": [{"source": "checkpoint", "id": checkpoint}], "suites": suites}
    ).json()
    # One on maps that are less hard, one that is not done yet.
    reports.measured(asked[0], "maze-1-200")
    reports.measured(asked[1], "rooms-0.5-200")
    found = client.get("/api/field").json()
    (driver,) = found["asked"]
    assert (driver["title"], driver["policy"], driver["trained"]) == (asked[0]["title"], None, True)
    cells = dict(zip(found["families"], driver["cells"], strict=True))
    assert cells.pop("maze")["evaluation"] == asked[0]["id"]
    assert not any(cells.values())
    del client.headers["Authorization"]
    assert len(client.get("/api/field", headers=lab.browser(member)).json()["asked"]) == 1
    assert client.get("/api/field", headers=lab.browser(stranger)).json()["asked"] == []


def test_seeds_of_a_training_are_one_row_and_the_best_come_first(client: TestClient, reports: Reports) -> None:
    def asked(policies: list[dict[str, str]]) -> list[dict[str, Any]]:
        suites = [{"by": "arena", "arena": {"name": "maze", "difficulty": 1.0}}]
        found: list[dict[str, Any]] = client.post("/api/evaluations", json={"policies": policies, "suites": suites}).json()
        return found

    experiment = reports.experiment("base", seeds=(0, 1, 2))
    checkpoints = [reports.checkpoint(run, 1, Reports.evaluation(7)) for run in experiment["runs"]]
    seeds = asked([{"source": "checkpoint", "id": each} for each in checkpoints])
    for number, each in enumerate(seeds):
        reports.measured(each, "maze-1-200", arrivals=5 + number)
    (baseline,) = asked([{"source": "baseline", "name": "VFH+"}])
    reports.measured(baseline, "maze-1-200", arrivals=3)
    found = client.get("/api/field").json()
    mine, untrained = found["asked"]
    assert (mine["title"], mine["trained"]) == ("base", True)
    assert (untrained["title"], untrained["trained"]) == ("VFH+", False)
    cell = mine["cells"][found["families"].index("maze")]
    assert cell["success"]["per_seed"] == [0.5, 0.6, 0.7]
    assert (cell["success"]["unit"], cell["evaluation"]) == ("seeds", seeds[0]["id"])
    assert cell["suite_hash"] == "hash-a"
