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
