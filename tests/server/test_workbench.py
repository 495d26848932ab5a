"""The list of experiments: found by any setting or figure, sorted, read in parts, grouped; on both databases."""

import time
from fnmatch import fnmatch
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.database import tables
from server.http.paging import MAX_PAGE
from server.services import Services
from server.settings import Settings
from server.workbench.indexing import index_some
from tests.server.harness import Reports
from workers.config import TrainingConfig


@pytest.fixture
def settings(settings: Settings, database_url: str) -> Settings:
    return settings.model_copy(update={"database_url": database_url})


def names(client: TestClient, query: str = "", **parameters: Any) -> list[str]:
    response = client.get("/api/experiments", params={"query": query, **parameters})
    assert response.status_code == 200, response.text
    return [experiment["name"] for experiment in response.json()["items"]]


def fault(client: TestClient, query: str) -> tuple[str, int]:
    response = client.get("/api/experiments", params={"query": query})
    assert response.status_code == 422, response.text
    (problem,) = response.json()["detail"]
    assert problem["loc"] == ["query", "query"]
    return problem["msg"], problem["ctx"]["position"]


@pytest.fixture
def three(client: TestClient, reports: Reports, services: Services) -> dict[str, Any]:
    """Alpha: PPO, 0.99, evaluated at 70 and 90 %. Beta: PPO, 0.9, failed. Gamma: SAC, starred, tagged, one running."""
    alpha = reports.experiment("Alpha", (0, 1), algorithm={"name": "ppo", "gamma": 0.99})
    beta = reports.experiment("Beta", algorithm={"name": "ppo", "gamma": 0.9})
    gamma = reports.experiment("Gamma élan", algorithm={"name": "sac", "gamma": 0.999}, steps=5_000)
    for run, arrivals, value in zip(alpha["runs"], (7, 9), (10.0, 20.0), strict=True):
        reports.checkpoint(run, 100, reports.evaluation(2))
        reports.checkpoint(run, 200, reports.evaluation(arrivals))
        reports.metrics(run, "train/return", {100: 1.0, 200: value})
        reports.state(run, "completed")
    reports.metrics(gamma["runs"][0], "train/return", {100: 40.0})
    reports.state(beta["runs"][0], "failed")
    reports.state(gamma["runs"][0], "running", worker="w1@host/0")
    with services.database.write() as session:
        session.get_one(tables.Experiment, gamma["id"]).starred_at = 1.0
        session.get_one(tables.Experiment, gamma["id"]).notes = "Too *quick*"
        session.add(tables.ExperimentTag(experiment_id=gamma["id"], tag="Draft"))
        for days, name in ((10, alpha["id"]), (3, beta["id"])):
            session.get_one(tables.Experiment, name).created_at = time.time() - days * 86_400
    return {"alpha": alpha, "beta": beta, "gamma": gamma}


FOUND = {
    "": "Gamma Beta Alpha",
    "alph": "Alpha",
    "ÉLAN": "Gamma",
    "algorithm = ppo": "Beta Alpha",
    "algorithm.name = PPO": "Beta Alpha",
    "algorithm != ppo": "Gamma",
    "algorithm.gamma > 0.9": "Gamma Alpha",
    "algorithm = ppo gamma = 0.99": "Alpha",
    "gae_lambda = *": "Beta Alpha",
    "-gae_lambda = *": "Gamma",
    "state = failed, running": "Gamma Beta",
    "not state = failed": "Gamma Alpha",
    "tag = draft": "Gamma",
    "tag != draft": "Beta Alpha",
    "tag = *": "Gamma",
    "starred = yes": "Gamma",
    "starred = no": "Beta Alpha",
    "notes ~ QUICK": "Gamma",
    "seeds > 1": "Alpha",
    "success >= 80%": "Alpha",
    "success > 0.8": "",
    "success = *": "Alpha",
    "train/return > 14": "Gamma Alpha",
    "train/return < 16": "Alpha",
    "worker ~ w1@": "Gamma",
    "project = default": "Gamma Beta Alpha",
    "project = other": "",
    "created > 4d": "Gamma Beta",
    "created < 1w": "Alpha",
    "created > 2020-01-01 created < 2020-01-02": "",
    'hidden_sizes = "64, 64"': "Beta Alpha",
    "task.reward.terms.arrival.weight = 120": "Gamma Beta Alpha",
    "alpha or (algorithm = sac state = running)": "Gamma Alpha",
    "reward = basic": "Gamma Beta Alpha",
    'name = "100% _"': "",
}


def test_a_query_finds(client: TestClient, three: dict[str, Any]) -> None:
    found = {query: " ".join(name.split()[0] for name in names(client, query)) for query in FOUND}
    assert found == FOUND


def test_a_query_that_makes_no_sense_is_refused_at_its_place(client: TestClient, three: dict[str, Any]) -> None:
    assert fault(client, "alpha gamme = 1") == ("No training has a setting, a metric or a property gamme.", 6)
    assert fault(client, "alpha weight = 0") == (
        "weight may be task.reward.terms.arrival.weight or task.reward.terms.collision.weight: write more of it.",
        6,
    )
    assert fault(client, "name > 3")[1] == 7
    assert fault(client, "state = happy") == (
        "A state is one of queued, running, stopping, stopped, completed, failed, mixed.",
        8,
    )
    assert fault(client, "gamma > much")[1] == 8
    assert fault(client, "created > tomorrow")[1] == 10
    assert fault(client, "starred = maybe")[1] == 10
    assert fault(client, "train/return ~ 3")[1] == 15


SORTED = {
    "-created": "Gamma Beta Alpha",
    "created": "Alpha Beta Gamma",
    "name": "Alpha Beta Gamma",
    "algorithm.gamma": "Beta Alpha Gamma",
    "train/return": "Alpha Gamma Beta",
    "-train/return": "Gamma Alpha Beta",
    "state": "Alpha Beta Gamma",
    # Of equal ones, which stand in the order of their ids, the first or the last.
    "-success": "Alpha ...",
    "-seeds": "Alpha ...",
    "-tag": "Gamma ...",
    "-starred": "Gamma ...",
    "algorithm": "... Gamma",
}


def test_sorted_with_what_has_no_value_at_the_end(client: TestClient, three: dict[str, Any]) -> None:
    for sort, order in SORTED.items():
        shown = " ".join(name.split()[0] for name in names(client, sort=sort))
        assert fnmatch(shown, order.replace("...", "*")), sort


def test_the_parts_of_a_list_are_the_list(client: TestClient, three: dict[str, Any], reports: Reports) -> None:
    for index in range(4):
        reports.experiment(f"More {index}")
    for sort in ("-created", "name", "-success", "train/return", "algorithm.gamma", "-state", "-starred"):
        in_parts(client, sort)
    assert client.get("/api/experiments", params={"after": "nonsense"}).status_code == 400


def in_parts(client: TestClient, sort: str) -> None:
    whole = names(client, sort=sort)
    parts: list[str] = []
    after = None
    while True:
        page = client.get(
            "/api/experiments", params={"sort": sort, "limit": 2, **({"after": after} if after else {})}
        ).json()
        assert page["total"] == 7
        parts += [item["name"] for item in page["items"]]
        after = page["next"]
        if after is None:
            break
    assert parts == whole


def test_rows_carry_the_settings_and_metrics_that_are_asked_for(client: TestClient, three: dict[str, Any]) -> None:
    columns = ["gamma", "task.reward.terms.arrival.weight", "train/return", "algorithm"]
    page = client.get("/api/experiments", params={"column": columns, "sort": "name"}).json()
    alpha, beta, _ = page["items"]

    assert alpha["settings"] == {
        "algorithm.gamma": 0.99,
        "task.reward.terms.arrival.weight": 120.0,
        "algorithm.name": "ppo",
    }
    # Student's t of 10 and 20 with one degree of freedom: 15 +- 12.706 x 5.
    assert alpha["metrics"]["train/return"] == {
        "value": 15.0,
        "low": pytest.approx(15.0 - 63.53, abs=0.01),
        "high": pytest.approx(15.0 + 63.53, abs=0.01),
        "runs": 2,
    }
    assert alpha["success"]["value"] == pytest.approx(0.8)
    assert beta["metrics"] == {}
    # A thousand configurations would be megabytes.
    assert "training" not in alpha


def test_a_group_carries_the_interval_over_all_of_its_runs(client: TestClient, three: dict[str, Any]) -> None:
    answer = client.get("/api/workbench/groups", params={"by": "algorithm", "column": "train/return"}).json()

    assert (answer["by"], answer["total"]) == ("algorithm.name", 2)
    ppo, sac = answer["items"]
    assert (ppo["value"], ppo["experiments"], ppo["runs"]) == ("ppo", 2, 3)
    assert ppo["states"] == {"completed": 2, "failed": 1}
    assert ppo["success"]["value"] == pytest.approx(0.8)
    assert ppo["success"]["runs"] == 2
    assert ppo["metrics"]["train/return"]["runs"] == 2
    # One run has no interval over seeds.
    assert sac["metrics"]["train/return"] == {"value": 40.0, "low": None, "high": None, "runs": 1}
    for group in answer["items"]:
        assert len(names(client, group["query"])) == group["experiments"]
    elsewhere = {"by": "algorithm", "project": "none"}
    assert client.get("/api/workbench/groups", params=elsewhere).json()["items"] == []
    assert client.get("/api/workbench/ids", params={"project": "none"}).json()["ids"] == []
    by_gae = client.get("/api/workbench/groups", params={"by": "gae_lambda", "query": "algorithm = *"}).json()["items"]
    assert [(group["value"], names(client, group["query"])) for group in by_gae] == [
        (0.95, ["Beta", "Alpha"]),
        (None, ["Gamma élan"]),
    ]


def test_keys_and_values_complete_a_query(client: TestClient, three: dict[str, Any]) -> None:
    keys = {item["key"]: item for item in client.get("/api/workbench/keys").json()["items"]}
    assert keys["algorithm.gamma"]["kind"] == "number"
    assert keys["state"]["values"][0] == "queued"
    assert keys["train/return"]["of"] == "metric"
    assert keys["algorithm"]["meaning"] == "algorithm.name"
    assert client.get("/api/workbench/values", params={"key": "algorithm"}).json() == ["ppo", "sac"]
    assert client.get("/api/workbench/values", params={"key": "algorithm", "part": "S"}).json() == ["sac"]
    assert client.get("/api/workbench/values", params={"key": "tag", "part": "dr"}).json() == ["Draft"]
    assert client.get("/api/workbench/values", params={"key": "nothing"}).status_code == 422
    assert client.get("/api/workbench/ids", params={"query": "algorithm = sac"}).json() == {
        "ids": [three["gamma"]["id"]],
        "total": 1,
    }


def test_what_an_older_version_stored_is_found_once_it_is_written_down(
    client: TestClient, three: dict[str, Any], services: Services
) -> None:
    with services.database.write() as session:
        session.query(tables.ExperimentKey).delete()
        session.query(tables.Experiment).update({"indexed_as": None})
    # Shown as they are even so.
    (gamma, *_) = client.get("/api/experiments").json()["items"]
    assert (gamma["algorithm"], gamma["arena"]) == ("sac", "simple")

    assert index_some(services) == 3
    assert index_some(services) == 0
    assert names(client, "algorithm = sac") == ["Gamma élan"]


@pytest.mark.parametrize("sort", ["-created", "name", "-train/return", "seeds"])
def test_a_list_of_hundreds_goes_on_to_its_end_with_each_once(client: TestClient, services: Services, sort: str) -> None:
    count = 2 * MAX_PAGE + 50
    training = TrainingConfig().model_dump(mode="json")
    with services.database.write() as session:
        session.add_all(
            # Many are alike in what they are sorted by.
            tables.Experiment(id=f"e{number:03}", name=f"Märkte {number // 7}", training=training, created_at=number // 9)
            for number in range(count)
        )

    def part(**parameters: Any) -> dict[str, Any]:
        response = client.get("/api/experiments", params={"sort": sort, "limit": MAX_PAGE, **parameters})
        assert response.status_code == 200, response.text
        page: dict[str, Any] = response.json()
        return page

    pages = [part()]
    while (following := pages[-1]["next"]) is not None:
        pages.append(part(after=following))
    by_ends = [item["id"] for page in pages for item in page["items"]]
    by_places = [item["id"] for start in range(0, count, MAX_PAGE) for item in part(offset=start)["items"]]

    assert [page["total"] for page in pages] == [count] * 3
    assert len(by_ends) == len(set(by_ends)) == count
    assert by_places == by_ends


@pytest.mark.parametrize("name", ["Märkte", "ÉCOLE supérieure", "Жук", "Ωμέγα", "straße", "ığdır"])
def test_a_name_is_found_whatever_its_letters_and_their_case(client: TestClient, reports: Reports, name: str) -> None:
    reports.experiment("Other")
    reports.experiment(f"The {name} run")

    assert names(client, f'"{name}"') == [f"The {name} run"]
    assert names(client, f'"{name.lower()}"') == [f"The {name} run"]
    upper = name.upper()
    # What has no capital of its own, or shares one, is another word in capitals.
    assert names(client, f'"{upper}"') == ([f"The {name} run"] if upper.lower() == name.lower() else [])
