"""Two workers of a real stack take up what waits by priority, then by age."""

from tests.services.stack import ROLLOUT, Service


def test_two_workers_take_up_runs_in_the_order_of_the_queue(service: Service) -> None:
    service.start_server()
    runs = [service.launch(6 * ROLLOUT)[0] for _ in range(6)]
    for run_id, priority in ((runs[4], 10), (runs[5], 20), (runs[0], -5)):
        service.api.put(f"/api/runs/{run_id}/priority", json={"priority": priority}).raise_for_status()
    service.api.post(f"/api/runs/{runs[3]}/front").raise_for_status()
    expected = [runs[index] for index in (3, 5, 4, 1, 2, 0)]
    assert [item["id"] for item in service.api.get("/api/queue").json()["items"]] == expected

    for name in ("a", "b"):
        service.start("worker-" + name, "workers", "worker", "--concurrency=1", f"--name={name}", "--jobs=0")
    ended = [service.until_state(run_id, "completed") for run_id in runs]

    begun = sorted(ended, key=lambda run: run["started_at"])
    assert [run["id"] for run in begun] == expected
    takers = [message.rsplit(" on ", 1)[1] for run_id in runs for message in service.events(run_id)[:1]]
    assert {name.partition("@")[0] for name in takers} == {"a", "b"}
    assert service.api.get("/api/queue").json()["total"] == 0
    workers = service.api.get("/api/workers").json()["items"]
    assert all(worker["there"] and worker["machine"]["cores"] >= 1 for worker in workers)
