"""Whatever dies in mid-training, the run goes on by itself, and its curve has no gap and no double point."""

import signal
import time
from itertools import pairwise

import psutil

from server.doorbell import CeleryDoorbell
from tests.services.stack import LEASE_SECONDS, REPORT, ROLLOUT, Service, assert_one_unbroken_curve, trainers, tree, until

# So many steps that no test sees their end.
ENDLESS = 50_000_000


def until_checkpoint(service: Service, run_id: str, beyond: int = 0) -> int:
    """The step of the first checkpoint beyond a step, once the curve has gone past it, as the run goes on."""

    def passed() -> int | None:
        assert service.run(run_id)["state"] != "completed", "it ended before anybody looked"
        newest = max(service.checkpoints(run_id), default=0)
        return newest if newest > beyond and max(service.steps(run_id)) > newest else None

    step = until(passed)
    assert step is not None
    return step


def until_resumed(service: Service, run_id: str, attempt: int) -> int:
    """The step from which this attempt went on, once its curve has grown beyond."""
    until(lambda: service.run(run_id)["attempt"] >= attempt)
    until(lambda: len(service.resumed_from(run_id)) >= attempt - 1)
    step = service.resumed_from(run_id)[attempt - 2]
    until(lambda: max(service.steps(run_id), default=0) > step)
    return step


def test_duplicate_messages_train_once_and_a_stop_keeps_everything(running: Service) -> None:
    (run_id,) = running.launch(ENDLESS)
    doorbell = CeleryDoorbell(running.environment["MAPLESS_BROKER_URL"], "mapless.")
    for attempt in (0, 0, 0, 1, 1):
        doorbell.ring(run_id, attempt, "cpu")
    doorbell.close()
    until_checkpoint(running, run_id)
    stopped = running.stop(run_id)
    assert running.run(run_id)["attempt"] == 1
    running.api.post(f"/api/runs/{run_id}/resume").raise_for_status()
    assert until_resumed(running, run_id, attempt=2) == stopped
    running.stop(run_id)
    assert_one_unbroken_curve(running, run_id)


def test_a_short_training_runs_to_its_end(running: Service) -> None:
    (run_id,) = running.launch(2 * ROLLOUT, save_every=ROLLOUT)
    completed = running.until_state(run_id, "completed")
    assert completed["step"] == 2 * ROLLOUT
    assert running.checkpoints(run_id) == running.steps(run_id) == [ROLLOUT, 2 * ROLLOUT]
    assert completed["error"] is None
    # The worker's log says what happens to runs, and nothing of the messages that wake it.
    said = running.directory / "w.log"
    until(lambda: f"run {run_id}: attempt 1 ended: completed" in said.read_text())
    log = said.read_text()
    assert not any(noise in log for noise in ("[tasks]", "[queues]", "succeeded in", "received"))


def test_a_server_that_dies_and_comes_back_loses_nothing(running: Service) -> None:
    (run_id,) = running.launch(ENDLESS)
    until_checkpoint(running, run_id)
    seen = running.steps(run_id)
    assert running.server is not None
    running.server.kill()
    running.server.wait()
    time.sleep(LEASE_SECONDS + 1)  # away for longer than a lease
    running.start_server()
    until(lambda: running.steps(run_id)[-1] > seen[-1])
    running.stop(run_id)
    steps = running.steps(run_id)
    assert steps[: len(seen)] == seen
    # What was reported while the server was away is there too: one point for every report, five a second.
    assert max(after - before for before, after in pairwise(steps)) <= REPORT
    assert running.run(run_id)["attempt"] == 1


def test_a_trainer_that_dies_is_replaced_and_the_event_log_says_why(running: Service) -> None:
    (run_id,) = running.launch(ENDLESS)
    checkpoint = until_checkpoint(running, run_id)
    (trainer,) = trainers(running.workers["w"].pid)
    trainer.kill()
    assert until_resumed(running, run_id, attempt=2) >= checkpoint
    assert any("SIGKILL" in message for message in running.events(run_id))
    running.stop(run_id)
    assert_one_unbroken_curve(running, run_id)


def test_a_run_that_began_with_a_policy_goes_on_from_its_own_checkpoints_whatever_became_of_the_parent(
    running: Service,
) -> None:
    (parent,) = running.launch(2 * ROLLOUT, save_every=ROLLOUT)
    experiment = running.until_state(parent, "completed")["experiment_id"]
    begun = running.api.get(f"/api/runs/{parent}/checkpoints").json()["items"][0]
    (run_id,) = running.launch(ENDLESS, start_from={"source": "checkpoint", "name": begun["id"]})
    until_checkpoint(running, run_id)
    first = running.api.get(f"/api/runs/{run_id}/checkpoints", params={"step": 0}).json()["items"][0]
    assert first["evaluation"] == begun["evaluation"]
    for action in ("delete", "remove"):
        body = {"action": action, "experiments": [experiment]}
        assert running.api.post("/api/workbench/actions", json=body).json()["done"] == [experiment]
    (trainer,) = trainers(running.workers["w"].pid)
    trainer.kill()
    until_resumed(running, run_id, attempt=2)
    running.stop(run_id)
    assert_one_unbroken_curve(running, run_id)
    lineage = running.api.get(f"/api/runs/{run_id}/lineage").json()["parent"]
    assert (lineage["state"], lineage["start_from"]["name"]) == ("gone", begun["id"])
    assert sum("Starts from tiny, seed 0" in message for message in running.events(run_id)) == 1


def test_a_zombie_is_fenced_out(service: Service) -> None:
    service.start_server()
    worker = service.start_worker("first")
    (run_id,) = service.launch(ENDLESS)
    until_checkpoint(service, run_id)
    frozen = tree(worker.pid)
    for process in frozen:
        process.suspend()
    service.start_worker("second")
    until_resumed(service, run_id, attempt=2)
    for process in frozen:
        process.resume()
    # It wakes up in the belief that the run is its own, is told otherwise, and its trainer ends.
    until(lambda: "was fenced out" in (service.directory / "first.log").read_text())
    assert service.run(run_id)["worker"].startswith("second@")
    service.stop(run_id)
    assert_one_unbroken_curve(service, run_id)


def test_a_worker_killed_under_the_supervisor_comes_back_and_goes_on(service: Service) -> None:
    del service.environment["MAPLESS_LEASE_SECONDS"]  # 30 s are promised for the lease that is shipped
    supervisor = service.start("up", "server", "up", "--workers", "1")
    until(lambda: service.api.get("/healthz").status_code == 200)
    (run_id,) = service.launch(ENDLESS)
    checkpoint = until_checkpoint(service, run_id)
    worker = next(child for child in psutil.Process(supervisor.pid).children() if "workers" in child.cmdline())
    victims, orphans = tree(worker.pid), trainers(worker.pid)
    killed_at = time.monotonic()
    for victim in victims:
        if victim not in orphans:
            victim.kill()
    assert until_resumed(service, run_id, attempt=2) >= checkpoint
    assert time.monotonic() - killed_at < 30
    assert not any(victim.is_running() and victim.status() != psutil.STATUS_ZOMBIE for victim in victims)

    # Ctrl-C: the training is handed back with a checkpoint, and goes on at the next start.
    supervisor.send_signal(signal.SIGINT)
    assert supervisor.wait(10) == 0
    service.start("up", "server", "up", "--workers", "1")
    until(lambda: service.api.get("/healthz").status_code == 200)
    until_resumed(service, run_id, attempt=3)
    service.stop(run_id)
    assert_one_unbroken_curve(service, run_id)
