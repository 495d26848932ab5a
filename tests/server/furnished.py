"""A service with something of everything in it, asked over a real socket: what a stranger who knows its addresses finds."""

import base64
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import uvicorn
from fastapi import FastAPI

from server.database.tables import RunState
from server.services import Services
from sim.config import ArenaFile
from tests.server.harness import TOKEN, Reports
from tests.server.people import Lab
from tests.workers.test_onnx_policy import graph

SUITE = "simple-200"


@dataclass(frozen=True)
class Furnished:
    """A service that is served.

    Attributes:
        url: of it.
        owner, person: headers of its owner, and of somebody who administrates it in a browser.
        there: by the name of a parameter, what is there; some of each kind is for others to delete.
    """

    url: str
    owner: dict[str, str]
    person: dict[str, str]
    there: dict[str, list[str]]


@contextmanager
def served(app: FastAPI) -> Iterator[str]:
    """Serve an application to this machine; its URL."""
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="warning", access_log=False))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the server did not start"
        time.sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def furnished(app: FastAPI) -> Iterator[Furnished]:
    """Serve an application with something of everything in it."""
    services: Services = app.state.services
    owner = {"Authorization": f"Bearer {TOKEN}"}
    with served(app) as url, httpx.Client(base_url=url, headers=owner, timeout=60.0) as client:
        lab = Lab(services)
        ada, person = lab.person("ada"), lab.browser(lab.person("grace", admin=True))
        yield Furnished(url, owner, person, _furnish(client, services) | {"user_id": [ada]})


def _furnish(client: httpx.Client, services: Services) -> dict[str, list[str]]:
    reports = Reports(client, services)

    def made(address: str, **body: Any) -> Any:
        answer = client.post(address, json=body)
        assert answer.is_success, f"{address}: {answer.text}"
        return answer.json()

    finished, going, waiting = (reports.experiment(name, seeds=(0, 1)) for name in ("Finished", "Going on", "Waiting"))
    runs = [*finished["runs"], *going["runs"], *waiting["runs"]]
    checkpoints = []
    states: tuple[RunState, ...] = ("completed", "failed", "running", "stopped")
    for run, state in zip(finished["runs"] + going["runs"], states, strict=True):
        reports.rows(run, {step * 1_000: {"train/return": float(step), "eval/success_rate": 0.5} for step in range(1, 20)})
        checkpoints += [reports.checkpoint(run, step * 1_000, reports.evaluation(5 + step)) for step in (1, 2)]
        reports.state(run, state, attempt=1, worker="w@lab", step=19_000, error="It broke." if state == "failed" else None)
    reports.heard_of("w@lab", 1.0)
    arena = ArenaFile(name="room", width=6.0, height=6.0)
    hashes = [services.arenas.add(arena), services.arenas.add(arena.model_copy(update={"name": "hall", "width": 8.0}))]
    suite = made("/api/suites", name="Mine")
    study = made(
        "/api/studies",
        name="Which?",
        training={"steps": 50_000},
        settings=[{"kind": "range", "path": "algorithm.gamma", "low": 0.9, "high": 0.999}],
        trials=3,
    )
    measured, asked = (
        made("/api/evaluations", policies=[{"source": "shipped", "name": name}], suites=[{"by": "name", "name": SUITE}])[0]
        for name in ("simple", "complex")
    )
    reports.measured(measured, SUITE)
    upload = made("/api/uploads", name="Elsewhere", content=base64.b64encode(graph()).decode(), task={})
    campaign = made("/api/reproduction", seeds=1, effort=0.01)["campaign"]["id"]
    recording = client.post("/api/recordings", params={"name": "drive"}, content=b"no recording").json()["id"]
    playground = made("/api/playgrounds", policy={"source": "shipped", "name": "simple"}, arena={"name": "rooms"})
    view = client.put("/api/workbench/views", json={"name": "Good", "address": "sort=-success"}).json()["items"][0]["id"]
    invitation = made("/api/invitations", project_id="default", role="viewer")
    rule = made("/api/alerts/rules", event="success", threshold=0.9, channel="browser")
    one = checkpoints[0]
    return {
        "campaign_id": [campaign],
        "checkpoint_id": checkpoints,
        "evaluation_id": [measured["id"], asked["id"]],
        "experiment_id": [each["id"] for each in (finished, going, waiting)],
        "invitation_id": [invitation["id"]],
        "job_id": [job["id"] for job in client.get("/api/jobs").json()["items"]],
        "name": ["simple", "complex"],
        "playground_id": [playground["id"]],
        "project_id": ["default", made("/api/projects", name="Another")["id"]],
        "recording_id": [recording],
        "rule_id": [rule["id"]],
        "run_id": [run["id"] for run in runs],
        "sha256": hashes,
        "study_id": [study["id"]],
        "subjects": [f"checkpoint:{one}", f"policy:simple:{SUITE}", f"evaluation:{measured['id']},checkpoint:{one}"],
        "suite": [SUITE],
        "suite_hash": [board["suite_hash"] for board in client.get("/api/leaderboards").json()["suites"][:2]],
        "suite_id": [suite["id"]],
        "token_id": [made("/api/worker-tokens", name="w")["id"]],
        "upload_id": [upload["id"]],
        "view_id": [view],
    }
