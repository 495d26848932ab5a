"""The queue: whose turn it is, when it comes, who may change it; and the workers, with what they are and did."""

import time
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import given
from hypothesis import strategies as st

from server.database import tables
from server.queueing.activity import BLOCK_SECONDS, BLOCKS, strip, with_work
from server.queueing.forecast import Place, Turn, forecast
from server.queueing.placing import Standing, placed
from server.runs.repository import RunRepository
from server.services import Services
from server.system.repository import WorkerRepository
from server.worker_api.service import WorkerService
from tests.server.harness import Reports
from tests.server.people import Lab
from workers.protocol import ClaimRequest, Gpu, Heartbeat, Machine

AB = frozenset({"a", "b"})


def test_whoever_waits_goes_to_the_first_worker_that_is_free() -> None:
    """a is free in 10 s and b in 15; 1,000 steps take 100 s: a 10..110, b 15..115, a from 110."""
    places = [Place("a", "cpu", 10.0), Place("b", "cpu", 15.0)]

    assert forecast(places, [Turn(1_000, AB)] * 3, {"cpu": 10.0}) == [10.0, 15.0, 110.0]


def test_what_is_not_known_is_not_said() -> None:
    idle, silent, nobody = Place("a", "cpu", 0.0), Place("b", "cpu", None), frozenset[str]()

    assert forecast([idle, silent], [Turn(1, AB)], {}) == [0.0], "an idle worker begins now, whatever others do"
    assert forecast([silent], [Turn(1, AB)], {"cpu": 1.0}) == [None]
    assert forecast([Place("a", "cpu", 5.0), silent], [Turn(1, AB)], {"cpu": 1.0}) == [None], "b may be free before"
    assert forecast([idle], [Turn(1, AB)] * 2, {}) == [0.0, None], "how long the first takes is not known"
    assert forecast([idle], [Turn(1, nobody), Turn(1, AB)], {"cpu": 1.0}) == [None, 0.0], "who can't begin holds up nobody"


@given(
    st.lists(st.floats(0.0, 1e4), min_size=1, max_size=4),
    st.lists(st.integers(0, 10**7), max_size=12),
)
def test_nobody_begins_before_who_came_first(free: list[float], steps: list[int]) -> None:
    places = [Place(str(index), "cpu", seconds) for index, seconds in enumerate(free)]
    names = frozenset(place.name for place in places)
    begins = forecast(places, [Turn(each, names) for each in steps], {"cpu": 1_000.0})

    known = [begin for begin in begins if begin is not None]
    assert len(known) == len(steps)
    assert known == sorted(known)


def test_work_is_kept_by_six_hours_for_a_week() -> None:
    now = 1_000 * BLOCK_SECONDS + 3_600.0
    activity = with_work({str(1_000 - BLOCKS): 9.0, "999": 5_400.0}, now, 1_800.0)

    assert activity == {"999": 5_400.0, "1000": 1_800.0}, "what is older than a week is forgotten"
    assert strip(activity, now) == [*[0.0] * (BLOCKS - 2), 0.25, 0.5], "half of the hour that has begun"


def claim(services: Services, run: dict[str, Any], worker: str = "w@a/0", **request: Any) -> str | None:
    asked = ClaimRequest(worker=worker, published_attempt=0, any_run=True, **request)
    return WorkerService(services).claim(run["id"], asked).run_id


def beat(services: Services, worker: str, queue: Any = "cpu") -> None:
    WorkerService(services).heartbeat(Heartbeat(worker=worker, queue=queue))


def test_the_highest_priority_is_claimed_first_then_the_oldest(
    client: TestClient, services: Services, reports: Reports
) -> None:
    runs = [reports.experiment(name)["runs"][0] for name in ("first", "second", "third", "urgent")]
    assert client.put(f"/api/runs/{runs[3]['id']}/priority", json={"priority": 5}).status_code == 204
    assert client.put(f"/api/runs/{runs[0]['id']}/priority", json={"priority": -1}).status_code == 204

    # Each message is about the first one; who comes gets whose turn it is.
    claimed = [claim(services, runs[0]) for _ in runs]

    assert claimed == [runs[index]["id"] for index in (3, 1, 2, 0)]


def test_a_claim_whose_answer_got_lost_is_the_same_run_again(services: Services, reports: Reports) -> None:
    runs = [reports.experiment(name)["runs"][0] for name in ("first", "second")]
    again = [claim(services, runs[1], claim_id="c" * 32) for _ in range(3)]

    assert again == [runs[0]["id"]] * 3


def test_who_can_not_train_the_first_takes_the_next(services: Services, reports: Reports) -> None:
    on_gpu = reports.experiment("On a card", device="cuda")["runs"][0]
    anywhere = reports.experiment("Anywhere")["runs"][0]

    assert claim(services, on_gpu) == anywhere["id"]
    assert claim(services, anywhere, worker="w@b/0", queue="gpu") == on_gpu["id"]


def test_the_queue_says_what_each_waits_for(client: TestClient, services: Services, reports: Reports) -> None:
    runs = [reports.experiment("Anywhere", seeds=(1, 2))["runs"], reports.experiment("On a card", device="cuda")["runs"]]
    queue = client.get("/api/queue").json()
    assert [item["waits_for"] for item in queue["items"]] == ["worker", "worker", "gpu"]
    assert [item["starts_in"] for item in queue["items"]] == [None] * 3

    beat(services, "w@a/0")
    queue = client.get("/api/queue").json()

    assert [item["id"] for item in queue["items"]] == [run["id"] for each in runs for run in each]
    assert [item["position"] for item in queue["items"]] == [1, 2, 3]
    assert [item["waits_for"] for item in queue["items"]] == ["turn", "turn", "gpu"]
    assert [item["starts_in"] for item in queue["items"]] == [0.0, None, None]
    assert (queue["total"], queue["hidden"]) == (3, 0)
    assert client.get("/api/queue", params={"offset": 2, "limit": 1}).json()["items"][0]["position"] == 3


def test_the_forecast_goes_by_what_runs(client: TestClient, services: Services, reports: Reports) -> None:
    first, second, third = reports.experiment(seeds=(1, 2, 3), steps=100_000)["runs"]
    beat(services, "w@a/0")
    claim(services, first)
    with services.database.write() as session:
        session.get_one(tables.Run, first["id"]).step = 60_000
        session.add(tables.LatestMetric(run_id=first["id"], name="time/steps_per_second", step=60_000, value=1_000.0))

    items = client.get("/api/queue").json()["items"]

    assert [item["id"] for item in items] == [second["id"], third["id"]]
    assert [item["starts_in"] for item in items] == [40.0, 140.0]


def test_moving_to_the_front_overtakes_all_and_no_more(client: TestClient, reports: Reports) -> None:
    first, second, third = (reports.experiment(name)["runs"][0]["id"] for name in ("first", "second", "third"))
    client.put(f"/api/runs/{second}/priority", json={"priority": 7})

    for _ in range(2):
        assert client.post(f"/api/runs/{third}/front").status_code == 204
        items = client.get("/api/queue").json()["items"]
        assert [(item["id"], item["priority"]) for item in items] == [(third, 8), (second, 7), (first, 0)]


def order(client: TestClient) -> list[str]:
    return [item["id"] for item in client.get("/api/queue").json()["items"]]


@pytest.mark.parametrize("side", ["before", "after"])
@pytest.mark.parametrize("priorities", [(0, 0, 0, 0), (9, 5, 5, 1), (3, 2, 1, 0), (100, 100, 100, 100)])
def test_a_run_is_put_right_beside_another(
    client: TestClient, reports: Reports, priorities: tuple[int, ...], side: str
) -> None:
    runs = [reports.experiment(f"Number {number}")["runs"][0]["id"] for number in range(4)]
    for run_id, priority in zip(runs, priorities, strict=True):
        client.put(f"/api/runs/{run_id}/priority", json={"priority": priority})
    for moved in runs:
        for beside in runs:
            if moved == beside:
                continue
            expected = [each for each in order(client) if each != moved]
            expected.insert(expected.index(beside) + (side == "after"), moved)
            place = {"beside": beside, "side": side}
            assert client.put(f"/api/runs/{moved}/place", json=place).status_code == 204
            assert order(client) == expected


def test_where_there_is_room_between_two_nobody_else_is_moved() -> None:
    queue = [Standing("a", 9), Standing("b", 5), Standing("c", 5), Standing("d", 1)]
    anything = lambda *_: True  # noqa: E731

    assert placed(queue, "d", 1, anything) == {"d": 6}
    assert placed(queue, "a", 2, anything) == {"a": 2}
    assert placed(queue, "b", 1, anything) == {}
    assert placed(queue, "d", 0, anything) == {"d": 10}
    assert placed(queue, "a", 3, anything) == {"a": 0}
    # Between two of one priority those above rise, or those below fall: whichever are fewer.
    assert placed(queue, "d", 2, anything) == {"d": 6, "b": 7}


def test_who_may_not_move_those_on_one_side_moves_the_others_or_is_refused() -> None:
    queue = [Standing("a", 0), Standing("b", 0), Standing("c", 0), Standing("mine", 0)]

    assert placed(queue, "mine", 1, lambda *_: True) == {"mine": 1, "a": 2}
    assert placed(queue, "mine", 1, lambda run_id, _: run_id != "a") == {"mine": -1, "b": -2, "c": -2}
    assert placed(queue, "mine", 1, lambda run_id, _: run_id == "mine") is None


def test_a_place_beside_what_does_not_wait_is_refused(client: TestClient, reports: Reports) -> None:
    run, other = (reports.experiment(name)["runs"][0] for name in ("one", "other"))
    reports.state(other, "running")
    path = f"/api/runs/{run['id']}/place"

    for beside, status in ((other["id"], 409), (run["id"], 409), ("nobody", 404)):
        assert client.put(path, json={"beside": beside, "side": "before"}).status_code == status


def test_only_what_waits_has_a_turn(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    reports.state(run, "running", worker="w")

    refused = client.post(f"/api/runs/{run['id']}/front")

    assert refused.status_code == 409
    assert refused.json()["detail"] == f"Run {run['id']} is running: only one that waits has a turn."


def test_editors_jump_no_further_than_their_share(client: TestClient, services: Services, reports: Reports) -> None:
    lab = Lab(services)
    here, elsewhere = lab.project("Here"), lab.project("Elsewhere")
    client.get("/api/status")
    mine = client.post("/api/experiments", json={"name": "Mine", "project_id": here}).json()["runs"][0]["id"]
    other = client.post("/api/experiments", json={"name": "Not mine", "project_id": elsewhere}).json()["runs"][0]["id"]
    editor = lab.token(lab.person("eve", {here: "editor"}), "launch")
    assert client.put(f"/api/runs/{other}/priority", json={"priority": 100}).status_code == 204

    assert client.put(f"/api/runs/{mine}/priority", json={"priority": 100}, headers=editor).status_code == 204
    assert client.put(f"/api/runs/{mine}/priority", json={"priority": 101}, headers=editor).status_code == 403
    assert client.post(f"/api/runs/{mine}/front", headers=editor).status_code == 204, "it waits longer at the same priority"
    queue = client.get("/api/queue", headers=editor).json()
    assert [(item["id"], item["position"]) for item in queue["items"]] == [(mine, 1)]
    assert queue["hidden"] == 1


def test_a_worker_says_what_it_is_and_what_it_did(client: TestClient, services: Services, reports: Reports) -> None:
    run = reports.experiment("Corridor", steps=100_000, device="auto")["runs"][0]
    machine = Machine(
        host="box", cores=8, load=1.5, memory_bytes=2**34, memory_used_bytes=2**32,
        gpu=Gpu(name="H100", memory_bytes=2**36, used_bytes=2**30, busy=0.4),
    )  # fmt: skip
    service = WorkerService(services)
    service.heartbeat(Heartbeat(worker="w@box/0", queue="gpu", machine=machine))
    claim(services, run, worker="w@box/0", queue="gpu")
    with services.database.write() as session:
        session.get_one(tables.Worker, "w@box/0").last_seen -= 6.0
    service.heartbeat(Heartbeat(worker="w@box/0", queue="gpu", machine=machine))

    (worker,) = client.get("/api/workers").json()["items"]

    assert worker["there"]
    assert worker["busy"]
    assert worker["machine"] == machine.model_dump()
    assert (worker["run"]["id"], worker["run"]["experiment_name"], worker["run"]["progress"]) == (run["id"], "Corridor", 0.0)
    assert len(worker["activity"]) == BLOCKS
    with services.database.read() as session:
        assert session.get_one(tables.Worker, "w@box/0").activity is not None
        (seconds,) = (session.get_one(tables.Worker, "w@box/0").activity or {}).values()
    assert seconds == pytest.approx(6.0, abs=1.0)


def test_a_worker_that_has_gone_leaves_its_last_words_and_can_be_removed(
    client: TestClient, services: Services, reports: Reports
) -> None:
    run = reports.experiment()["runs"][0]
    beat(services, "w@box/0")
    claim(services, run, worker="w@box/0")
    assert client.post("/api/workers/remove", json={"worker": "w@box"}).status_code == 409

    with services.database.write() as session:
        WorkerRepository(session).seen("w@box/0", "cpu", time.time() - 50)
        RunRepository(session).add_event(run["id"], "warning", "Attempt 1 was lost: it is silent.")
    (worker,) = client.get("/api/workers").json()["items"]
    assert not worker["there"]
    assert worker["last_words"] == "Attempt 1 was lost: it is silent."

    assert client.post("/api/workers/remove", json={"worker": "w@box"}).status_code == 204
    assert client.get("/api/workers").json()["items"] == []
    assert client.post("/api/workers/remove", json={"worker": "w@box"}).status_code == 404
