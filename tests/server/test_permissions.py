"""Every route and socket, asked by everybody: the table says what each takes, and a new one without an entry fails."""

import base64
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from fastapi.testclient import TestClient
from starlette.responses import Response
from starlette.routing import Mount, Route
from starlette.websockets import WebSocketDisconnect

from server.app import ROUTERS, create_app
from server.database import tables
from server.database.tables import Role
from server.security.access import OPEN_PATHS
from server.security.declared import check_permissions, declared
from server.security.permissions import OPEN
from server.services import Services
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN, Reports
from tests.server.people import Lab, launch
from tests.workers.test_onnx_policy import graph

# What each route takes. Parameters stand for things of the project "here".
TABLE = {
    "open": """
        POST /api/login
        GET /api/sign-in
        POST /api/sign-in
        POST /api/sign-in/provider
        GET /api/sign-in/provider/callback
        POST /api/invitations/look
        POST /api/invitations/accept
        GET /healthz
        GET /readyz
    """,
    "signed in": """
        GET /api/version
        GET /api/status
        GET /api/storage
        GET /api/account
        GET /api/sign-in/provider/end
        POST /api/sign-out
        GET /api/projects
        GET /api/training/form
        GET /api/training/pace
        GET /api/training/starts
        GET /api/experiments
        GET /api/studies
        GET /api/workbench/groups
        GET /api/queue
        GET /api/workers
        GET /api/workbench/ids
        GET /api/workbench/keys
        GET /api/workbench/values
        GET /api/workbench/views
        GET /api/events
        GET /api/arenas
        GET /api/arenas/fixed
        GET /api/arenas/generated
        GET /api/arenas/imported/{sha256}
        GET /api/evaluations
        GET /api/uploads
        GET /api/recordings
        GET /api/suites
        GET /api/field
        GET /api/leaderboards
        GET /api/leaderboards/{suite_hash}
        GET /api/policies
        GET /api/policies/{name}
        GET /api/policies/{name}/suites/{suite}/episodes
        GET /api/policies/{name}/download
        GET /api/policies/{name}/bundle
        GET /api/policies/{name}/live
        PUT /api/policies/{name}/live
        POST /api/playgrounds
        GET /api/policies/{name}/suites/{suite}/replays/{episode}
    """,
    "launch": """
        POST /api/workbench/actions
        PUT /api/workbench/views
        DELETE /api/workbench/views/{view_id}
        POST /api/experiments
        POST /api/evaluations
        POST /api/playgrounds/{playground_id}/arena
        POST /api/uploads
        POST /api/uploads/shapes
        POST /api/recordings
        POST /api/reproduction
        POST /api/studies
        POST /api/arenas/imported
        POST /api/arenas/reviews
        POST /api/suites
        POST /api/suites/{suite_id}/scenarios
        DELETE /api/suites/{suite_id}/scenarios/{sha256}
    """,
    "invite": """
        GET /api/invitations
        POST /api/invitations
        DELETE /api/invitations/{invitation_id}
    """,
    "view": """
        GET /api/experiments/{experiment_id}
        GET /api/experiments/{experiment_id}/marks
        GET /api/experiments/{experiment_id}/thinning
        GET /api/experiments/{experiment_id}/curve-thinning
        GET /api/runs/{run_id}
        GET /api/runs/{run_id}/events
        GET /api/runs/{run_id}/log
        GET /api/runs/{run_id}/log/text
        GET /api/runs/{run_id}/metrics
        GET /api/runs/{run_id}/diagnoses
        GET /api/runs/{run_id}/checkpoints
        GET /api/runs/{run_id}/checkpoints/steps
        GET /api/runs/{run_id}/lapse
        GET /api/runs/{run_id}/lapse/progress
        GET /replays/lapses/{run_id}/{theme}/
        GET /api/checkpoints/{checkpoint_id}/live
        PUT /api/checkpoints/{checkpoint_id}/live
        GET /api/runs/{run_id}/lineage
        GET /api/experiments/{experiment_id}/lineage
        GET /api/runs/{run_id}/live
        PUT /api/runs/{run_id}/live
        GET /api/checkpoints/{checkpoint_id}/download
        GET /api/checkpoints/{checkpoint_id}/start
        GET /api/checkpoints/{checkpoint_id}/episodes
        GET /api/checkpoints/{checkpoint_id}/bundle
        GET /api/checkpoints/{checkpoint_id}/replays/{episode}
        GET /api/recordings/{recording_id}
        GET /api/recordings/{recording_id}/reading
        GET /api/recordings/{recording_id}/beside
        GET /api/evaluations/{evaluation_id}
        GET /api/evaluations/{evaluation_id}/episodes
        GET /api/evaluations/{evaluation_id}/export
        GET /api/evaluations/{evaluation_id}/ways
        GET /api/evaluations/{evaluation_id}/replays/{episode}
        GET /api/replays/{subjects}/progress
        GET /api/replays/{subjects}/beside
        GET /api/replays/{subjects}/{episode}
        GET /api/replays/{subjects}/{episode}/series
        GET /api/replays/{subjects}/{episode}/mcap
        GET /api/replays/{subjects}/{episode}/mp4
        GET /api/replays/{subjects}/{episode}/gif
        GET /api/replays/{subjects}/{episode}/progress
        GET /replays/{subjects}/{episode}/{theme}/
        GET /api/runs/{run_id}/export
        GET /api/projects/{project_id}/export
        GET /api/experiments/{experiment_id}/export
        GET /api/compare/export
        GET /api/compare
        GET /api/compare/curves
        GET /api/compare/metrics
        GET /api/compare/profiles
        GET /api/compare/table
        GET /api/compare/report
        GET /api/reproduction
        GET /api/studies/{study_id}
        GET /live/{run_id}/
        GET /live/{run_id}/{theme}/
        SOCKET /live/{run_id}
        SOCKET /live/{run_id}/{theme}
        SOCKET /live/{run_id}/{theme}/display
    """,
    "edit": """
        PATCH /api/experiments/{experiment_id}
        POST /api/projects/{project_id}/import
        DELETE /api/experiments/{experiment_id}
        PUT /api/experiments/{experiment_id}/thinning
        POST /api/experiments/{experiment_id}/thinning/free
        PUT /api/experiments/{experiment_id}/curve-thinning
        POST /api/experiments/{experiment_id}/curve-thinning/now
        POST /api/experiments/{experiment_id}/stop
        POST /api/experiments/{experiment_id}/resume
        PUT /api/experiments/{experiment_id}/notes
        POST /api/experiments/{experiment_id}/seeds
        POST /api/runs/{run_id}/stop
        POST /api/runs/{run_id}/resume
        POST /api/evaluations/{evaluation_id}/cancel
        DELETE /api/evaluations/{evaluation_id}
        DELETE /api/uploads/{upload_id}
        DELETE /api/recordings/{recording_id}
        PUT /api/runs/{run_id}/place
        PUT /api/runs/{run_id}/priority
        POST /api/runs/{run_id}/front
        DELETE /api/reproduction/{campaign_id}
        POST /api/reproduction/{campaign_id}/stop
        POST /api/reproduction/{campaign_id}/resume
        POST /api/reproduction/{campaign_id}/seeds
        POST /api/studies/{study_id}/stop
        POST /api/studies/{study_id}/resume
        POST /api/studies/{study_id}/extend
        DELETE /api/studies/{study_id}
    """,
    "manage": """
        PATCH /api/projects/{project_id}
        GET /api/projects/{project_id}/members
        PUT /api/projects/{project_id}/members/{user_id}
        DELETE /api/projects/{project_id}/members/{user_id}
    """,
    "administrate": """
        POST /api/projects
        DELETE /api/arenas/imported/{sha256}
        DELETE /api/suites/{suite_id}
        POST /api/workers/drain
        POST /api/workers/remove
        GET /api/jobs
        GET /api/jobs/{job_id}
        POST /api/jobs/{job_id}/cancel
        GET /api/people
        PATCH /api/people/{user_id}
        POST /api/people/{user_id}/password-link
        GET /api/worker-tokens
        POST /api/worker-tokens
        DELETE /api/worker-tokens/{token_id}
        GET /api/audit
        GET /api/audit/csv
    """,
    "own playground": """
        GET /api/playgrounds/{playground_id}
        DELETE /api/playgrounds/{playground_id}
        PUT /api/playgrounds/{playground_id}/settings
        POST /api/playgrounds/{playground_id}/changes
    """,
    "own account": """
        PUT /api/account/password
        GET /api/account/sessions
        DELETE /api/account/sessions/{session_id}
        GET /api/account/tokens
        POST /api/account/tokens
        DELETE /api/account/tokens/{token_id}
    """,
    "own alerts": """
        GET /api/alerts
        GET /api/alerts/news
        GET /api/alerts/channels
        GET /api/alerts/rules
        POST /api/alerts/rules
        PATCH /api/alerts/rules/{rule_id}
        DELETE /api/alerts/rules/{rule_id}
        POST /api/alerts/rules/{rule_id}/test
    """,
    "work": """
        POST /api/worker/heartbeat
        POST /api/worker/runs/{run_id}/claim
        POST /api/worker/runs/{run_id}/log
        PUT /api/worker/runs/{run_id}/checkpoints/{step}
        GET /api/worker/runs/{run_id}/start
        GET /api/worker/checkpoints/{checkpoint_id}
        SOCKET /api/worker/runs/{run_id}/link
        POST /api/worker/jobs/claim
        GET /api/worker/jobs/{job_id}/archive
        GET /api/worker/jobs/{job_id}/recordings/{number}
        GET /api/worker/jobs/{job_id}/bag
        POST /api/worker/jobs/{job_id}/report
        POST /api/worker/jobs/{job_id}/frames
        POST /api/worker/jobs/{job_id}/seen
        PUT /api/worker/jobs/{job_id}/result
        PUT /api/worker/jobs/{job_id}/recording
        POST /api/worker/jobs/{job_id}/end
    """,
    "scrape": """
        GET /metrics
    """,
}

OK = 299
# What each answers to whom. The last column of every line holds for all who are not named.
ANSWERS: dict[str, dict[str, int]] = {
    "open": {},
    "signed in": {"anonymous": 401, "closed": 401, "ended": 401, "worker": 403, "workers": 403},
    "launch": {"viewer": 403, "read token": 403},
    "invite": {"viewer": 403, "editor": 403, "read token": 403, "launch token": 403},
    "view": {"foreigner": 404, "foreign token": 404},
    "edit": {"foreigner": 404, "foreign token": 404, "viewer": 403, "read token": 403},
    "manage": {
        "foreigner": 404,
        "foreign token": 404,
        "viewer": 403,
        "read token": 403,
        "editor": 403,
        "launch token": 403,
    },
    "administrate": {"administrator": OK, "owner": OK, "administrator's token": OK},
    # The one in these tests was opened with the owner's token.
    "own playground": {"owner": OK},
    "own account": {
        "owner": 403,
        "read token": 403,
        "launch token": 403,
        "admin token": 403,
        "foreign token": 403,
        "administrator's token": 403,
    },
    "own alerts": {
        "read token": 403,
        "launch token": 403,
        "admin token": 403,
        "foreign token": 403,
        "administrator's token": 403,
    },
    "work": {"worker": OK, "workers": OK},
    "scrape": {"administrator": OK, "owner": OK, "administrator's token": OK},
}
ROLES = (
    "anonymous",
    "viewer",
    "editor",
    "admin",
    "foreigner",
    "administrator",
    "owner",
    "read token",
    "launch token",
    "admin token",
    "foreign token",
    "administrator's token",
    "worker",
    "workers",
    "closed",
    "ended",
)


def expected(permission: str, role: str) -> int:
    """What a route answers, OK where it lets the request in."""
    if permission == "open":
        return OK
    if permission == "work":
        return ANSWERS["work"].get(role, 401)
    if role in ANSWERS["signed in"]:
        return ANSWERS["signed in"][role]
    if permission == "own playground":
        return ANSWERS[permission].get(role, 404)
    return ANSWERS[permission].get(role, 403 if permission in ("administrate", "scrape") else OK)


def rows() -> dict[tuple[str, str], str]:
    """What each route takes, by method and path."""
    return {
        (method, path): permission
        for permission, lines in TABLE.items()
        for method, path in (line.split() for line in lines.strip().splitlines())
    }


def routes() -> dict[tuple[str, str], str]:
    """What each route of the application says that it takes, without the parameter that it looks at."""
    found: dict[tuple[str, str], str] = {}
    for router in ROUTERS:
        for route, permission in declared(router):
            assert permission is not None
            name = (
                permission.name.rsplit(" ", 1)[0] if permission.name.endswith(("_id", "ment", "aign")) else permission.name
            )
            methods = (route.methods or set()) - {"HEAD"} if isinstance(route, APIRoute) else {"SOCKET"}
            found |= {(method, route.path): name for method in methods}
    return found


def test_every_route_has_an_entry_and_says_the_same() -> None:
    assert routes() == rows()


def test_the_ways_in_are_what_is_open() -> None:
    assert {path for (_, path), permission in rows().items() if permission == "open"} == OPEN_PATHS | {"/healthz", "/readyz"}


def test_nothing_but_pages_stands_beside_the_routers(app: FastAPI) -> None:
    beside = {route.path for route in app.router.routes if isinstance(route, (Route, Mount))}
    assert beside == {"/api/openapi.json", "/assets", "/{path:path}"}


def test_a_route_that_names_no_permission_does_not_start() -> None:
    router = APIRouter()

    @router.get("/api/forgotten")
    def forgotten() -> None: ...

    with pytest.raises(ValueError, match="/api/forgotten names no permission"):
        check_permissions(router)
    both = APIRouter()
    both.add_api_route("/api/both", forgotten, dependencies=[OPEN, OPEN])
    with pytest.raises(ValueError, match="/api/both"):
        check_permissions(both)


@pytest.fixture(scope="module")
def everybody(
    tmp_path_factory: pytest.TempPathFactory, new_database: Path
) -> Iterator[tuple[TestClient, dict[str, dict[str, str]], dict[str, str]]]:
    """A service, the headers of everybody, and what the parameters of paths stand for."""
    folder: Path = tmp_path_factory.mktemp("lab")
    shutil.copy(new_database, folder)
    settings = Settings.model_validate(
        {"data_dir": folder, "token": TOKEN, "worker_token": WORKER_TOKEN, "web_dist": folder / "dist"}
    )
    app = create_app(settings)
    services: Services = app.state.services
    lab = Lab(services)
    with pytest.MonkeyPatch.context() as patch:
        # A right token at a wrong door is a guess there.
        patch.setattr("server.security.limits._MAX_FAILURES", 1_000_000)

        async def let_in(**_: Any) -> Response:
            return Response(status_code=OK)

        # Nothing is done: what lets a request in has been passed, and that is what is asked.
        with TestClient(app, base_url=BASE_URL, follow_redirects=False) as client:
            here, elsewhere = lab.project("Here"), lab.project("Elsewhere")
            headers = {"Authorization": f"Bearer {TOKEN}"}
            experiment = launch(client, here, **headers)
            campaign = client.post(f"/api/reproduction?project={here}", json={"seeds": 1, "effort": 1e-4}, headers=headers)
            client.headers.update(headers)
            checkpoint = Reports(client, services).checkpoint(experiment["runs"][0], 1, Reports.evaluation(8))
            policies = [{"source": "checkpoint", "id": checkpoint}]
            (evaluation,) = client.post("/api/evaluations", json={"policies": policies}).json()
            Reports(client, services).measured(evaluation)
            onnx = {"name": "Mine", "project_id": here, "content": base64.b64encode(graph()).decode(), "task": {}}
            upload = client.post("/api/uploads", json=onnx).json()
            recorded = f"/api/recordings?name=drive.mcap&project_id={here}"
            recording = client.post(recorded, content=b"not looked at").json()
            searched = {"kind": "range", "path": "algorithm.gamma", "low": 0.9, "high": 0.99}
            wanted = {"name": "Search", "project_id": here, "training": {}, "settings": [searched]}
            study = client.post("/api/studies", json=wanted).json()
            ground = client.post("/api/playgrounds", json={"policy": {"source": "shipped", "name": "simple"}}).json()
            del client.headers["Authorization"]
            people = {role: lab.person(role, {here: role}) for role in get_args(Role)}
            people["foreigner"] = lab.person("foreigner", {elsewhere: "admin"})
            people["administrator"] = lab.person("administrator", admin=True)
            people["closed"] = lab.person("closed", admin=True)
            people["ended"] = lab.person("ended", admin=True)
            credentials = {
                "anonymous": {},
                "owner": headers,
                "worker": lab.worker_token("gpu-box"),
                "workers": {"Authorization": f"Bearer {WORKER_TOKEN}"},
                "read token": lab.token(people["admin"], "read"),
                "launch token": lab.token(people["admin"], "launch"),
                "admin token": lab.token(people["admin"], "admin"),
                "foreign token": lab.token(people["administrator"], "admin", [elsewhere]),
                "administrator's token": lab.token(people["administrator"], "admin"),
            } | {role: lab.browser(user_id) for role, user_id in people.items()}
            with services.database.write() as session:
                session.get_one(tables.User, people["closed"]).disabled_at = 1.0
                session.query(tables.LoginSession).filter_by(user_id=people["ended"]).update({"expires_at": 1.0})
            parameters = {
                "project_id": here,
                "experiment_id": experiment["id"],
                "run_id": experiment["runs"][0]["id"],
                "checkpoint_id": checkpoint,
                "upload_id": upload["id"],
                "recording_id": recording["id"],
                "evaluation_id": evaluation["id"],
                "study_id": study["id"],
                "playground_id": ground["id"],
                "campaign_id": campaign.json()["campaign"]["id"],
                "subjects": f"policy:simple:simple-200,checkpoint:{checkpoint},evaluation:{evaluation['id']}",
                "theme": "light",
                "step": "1",
                "episode": "1",
                "name": "simple",
                "suite": "simple-200",
            }
            patch.setattr("fastapi.routing.run_endpoint_function", let_in)
            yield client, credentials, parameters


def address(path: str, parameters: dict[str, str]) -> str:
    for name in path.split("{")[1:]:
        key = name.partition("}")[0]
        path = path.replace(f"{{{key}}}", parameters.get(key, "unknown"))
    if path.startswith("/api/compare"):
        return f"{path}?experiment={parameters['experiment_id']}"
    if path == "/api/reproduction":
        return f"{path}?campaign={parameters['campaign_id']}"
    return f"{path}?attempt=1" if path.startswith("/api/worker/") else path


def answer(client: TestClient, method: str, path: str, headers: dict[str, str]) -> int:
    if method == "SOCKET":
        try:
            with client.websocket_connect(path, headers={"Host": "127.0.0.1:8400"} | headers) as socket:
                socket.close()
                return OK
        except WebSocketDisconnect as refused:
            # The scene's socket closes what speaks no viser, and says nothing.
            for status, words in (
                (401, "Log in"),
                (401, "workers' token: set"),
                (404, "no run"),
                (403, "takes"),
                (403, "opens"),
            ):
                if words in refused.reason:
                    return status
            return OK
    status = client.request(method, path, headers=headers).status_code
    # What is let in may still lack a body, or name a policy or an arena that is not there.
    return OK if status == 422 else status


@pytest.mark.parametrize("role", ROLES)
def test_who_may_do_what(role: str, everybody: tuple[TestClient, dict[str, dict[str, str]], dict[str, str]]) -> None:
    client, credentials, parameters = everybody
    wrong = {}
    for (method, path), permission in rows().items():
        answered = answer(client, method, address(path, parameters), credentials[role])
        if permission == "signed in" and answered == 404:
            answered = OK
        if answered != expected(permission, role):
            wrong[f"{method} {path}"] = f"{answered}, not {expected(permission, role)}"
    assert not wrong, json.dumps(wrong, indent=1)


def test_what_is_not_there_and_what_may_not_be_seen_are_answered_alike(
    everybody: tuple[TestClient, dict[str, dict[str, str]], dict[str, str]],
) -> None:
    client, credentials, parameters = everybody
    foreign = credentials["foreigner"]
    for path, of in (("/api/runs/{}", "run_id"), ("/api/experiments/{}", "experiment_id")):
        hidden, absent = (client.get(path.format(each), headers=foreign).json() for each in (parameters[of], "nowhere"))
        assert hidden["detail"].replace(parameters[of], "nowhere") == absent["detail"]
