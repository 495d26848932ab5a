"""Everything that was measured on a suite, side by side: shipped policies, baselines, trainings, evaluations."""

from fastapi.testclient import TestClient

from server.leaderboards.service import Candidate, ranked
from server.services import Services
from tests.server.harness import Reports
from tests.server.people import Lab
from workers.shipped.library import baselines, shipped_policy
from workers.statistics.differences import fisher_exact

CARD = shipped_policy("simple").card
HASH = CARD.results[0].suite_hash


def test_what_ships_is_on_the_boards_of_its_suites(client: TestClient) -> None:
    boards = client.get("/api/leaderboards").json()["suites"]
    (board,) = [each for each in boards if each["suite_hash"] == HASH]
    found = client.get(f"/api/leaderboards/{HASH}").json()
    assert found["suite"] == board["suite"] == CARD.results[0].suite
    assert len(found["entries"]) == board["entries"] == found["comparisons"] + 1
    rates = [entry["success"]["value"] for entry in found["entries"]]
    assert rates == sorted(rates, reverse=True)
    titles = {(entry["kind"], entry["title"]) for entry in found["entries"]}
    assert ("shipped", CARD.title) in titles
    assert {
        ("baseline", each.name) for each in baselines().baselines if HASH in [r.suite_hash for r in each.results]
    } < titles
    assert client.get("/api/leaderboards/nothing").status_code == 404


def test_what_cannot_be_told_from_the_best_is_tied_with_it() -> None:
    def candidate(name: str, arrivals: list[int], episodes: int = 200) -> Candidate:
        return Candidate("training", name, name, arrivals, [episodes] * len(arrivals))

    best, near, far = candidate("best", [190]), candidate("near", [184]), candidate("far", [150])
    board = ranked("s", "h", [far, near, best])
    assert [(entry.title, entry.rank, entry.tied, entry.told_by) for entry in board.entries] == [
        ("best", 1, True, "best"),
        ("near", 2, True, "episodes"),
        ("far", 3, False, "episodes"),
    ]
    # By hand: 190 and 184 of 200 differ as much by chance in three of ten such pairs, 190 and 150 in none of a million.
    assert 0.25 < fisher_exact((190, 200), (184, 200)) < 0.35
    assert fisher_exact((190, 200), (150, 200)) < 1e-6
    # Five seeds each: it is the seeds that are asked, not a thousand episodes that would tell 93 from 90 %.
    steady, spread = candidate("steady", [186, 187, 185, 186, 186]), candidate("spread", [200, 199, 198, 200, 103])
    (first, second) = ranked("s", "h", [spread, steady]).entries
    assert (first.title, second.tied, second.told_by) == ("steady", True, "seeds")
    assert fisher_exact((930, 1000), (900, 1000)) < 0.05
    # Equal rates share a rank.
    assert [entry.rank for entry in ranked("s", "h", [near, candidate("also", [184]), best]).entries] == [1, 2, 2]


def test_trainings_and_evaluations_join_and_each_sees_their_own(
    client: TestClient, services: Services, reports: Reports
) -> None:
    lab = Lab(services)
    here = lab.project("Here")
    member, stranger = lab.person("member", {here: "viewer"}), lab.person("stranger", {lab.project("There"): "admin"})
    experiment = reports.experiment("Mine", seeds=(0, 1))
    client.patch(f"/api/experiments/{experiment['id']}", json={"project_id": here})
    checkpoints = [reports.checkpoint(run, 1, Reports.evaluation(7 + run["seed"])) for run in experiment["runs"]]
    (asked,) = client.post("/api/evaluations", json={"policies": [{"source": "checkpoint", "id": checkpoints[0]}]}).json()
    reports.measured(asked)
    found = client.get("/api/leaderboards/hash-a").json()
    # The evaluation's 8 of 10 come before the training's mean of 7 and 8.
    assert [(entry["kind"], entry["id"], entry["success"]["per_seed"]) for entry in found["entries"]] == [
        ("evaluation", asked["id"], [0.8]),
        ("training", experiment["id"], [0.7, 0.8]),
    ]
    del client.headers["Authorization"]
    assert len(client.get("/api/leaderboards/hash-a", headers=lab.browser(member)).json()["entries"]) == 2
    assert client.get("/api/leaderboards/hash-a", headers=lab.browser(stranger)).status_code == 404
    hashes = [each["suite_hash"] for each in client.get("/api/leaderboards", headers=lab.browser(stranger)).json()["suites"]]
    assert HASH in hashes
    assert "hash-a" not in hashes
