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
    # A baseline has no seed that could have failed; a policy is one.
    failed = {entry["kind"]: entry["success"]["failed"] for entry in found["entries"]}
    assert failed["baseline"] is None
    assert failed["shipped"]["seeds"] == 1
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


def test_episodes_of_several_seeds_are_never_counted_as_if_they_were_independent() -> None:
    five = Candidate("training", "five", "five", [196, 192, 100, 190, 194], [200] * 5)
    two = Candidate("training", "two", "two", [120, 130], [200] * 2)
    baseline = Candidate("baseline", "VFH+", "VFH+", [160], [200])
    weak = Candidate("baseline", "random", "random", [2], [200])
    board = ranked("s", "h", [weak, five, two, baseline])
    assert [(entry.title, entry.tied, entry.told_by) for entry in board.entries] == [
        ("five", True, "best"),
        ("VFH+", True, "seeds"),
        ("two", True, "nothing"),
        ("random", False, "seeds"),
    ]
    # 872 of 1,000 and 160 of 200 would be told apart, though one seed in five is worse than the baseline by far.
    assert fisher_exact((872, 1000), (160, 200)) < 0.02
    assert board.comparisons == 2
    assert [entry.p is None for entry in board.entries] == [True, False, True, False]


def test_of_many_comparisons_each_counts_for_less() -> None:
    def candidate(name: str, arrivals: int) -> Candidate:
        return Candidate("uploaded", name, name, [arrivals], [200])

    # Alone 190 and 178 of 200 differ, as the first of five such pairs they do not (Holm 1979).
    best, other = candidate("best", 190), candidate("0", 178)
    assert not ranked("s", "h", [best, other]).entries[1].tied
    many = ranked("s", "h", [best, *(candidate(str(number), 178) for number in range(5))])
    assert [entry.tied for entry in many.entries] == [True] * 6
    assert many.entries[1].p == min(1.0, 5 * fisher_exact((190, 200), (178, 200)))


def test_the_seeds_of_a_training_are_one_entry(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("base", seeds=(0, 1, 2))
    checkpoints = [
        reports.checkpoint(run, step, Reports.evaluation(7 + run["seed"])) for run in experiment["runs"] for step in (1, 2)
    ]
    request = {"policies": [{"source": "checkpoint", "id": each} for each in checkpoints]}
    asked = client.post("/api/evaluations", json=request).json()
    for number, each in enumerate(asked):
        reports.measured(each, arrivals=4 + number)
    (entry,) = [each for each in client.get("/api/leaderboards/hash-a").json()["entries"] if each["kind"] == "evaluation"]
    assert (entry["title"], entry["experiment_id"]) == ("base", experiment["id"])
    # Of each run the checkpoint that was asked for last.
    assert entry["evaluations"] == [asked[number]["id"] for number in (1, 3, 5)]
    success = entry["success"]
    assert success["per_seed"] == [0.5, 0.7, 0.9]
    assert (success["unit"], success["seeds"], success["episodes"]) == ("seeds", 3, 30)
    # SPL and steps are known of the training's own evaluations too.
    (training,) = [each for each in client.get("/api/leaderboards/hash-a").json()["entries"] if each["kind"] == "training"]
    assert 0.0 < training["spl"] <= training["success"]["value"]
    assert training["steps"] == 80.0


def test_what_was_asked_for_is_called_by_what_it_is(client: TestClient, reports: Reports) -> None:
    (asked,) = client.post("/api/evaluations", json={"policies": [{"source": "baseline", "name": "VFH+"}]}).json()
    reports.measured(asked)
    (entry,) = client.get("/api/leaderboards/hash-a").json()["entries"]
    assert (entry["kind"], entry["title"], entry["id"]) == ("baseline", "VFH+", asked["id"])
    assert entry["evaluations"] == [asked["id"]]
    # No seed of it could have failed.
    assert entry["success"]["failed"] is None


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
