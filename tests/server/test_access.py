"""Who may come in: tokens, cookies, hosts, origins, and the brake on guessing."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI, WebSocket
from fastapi.testclient import TestClient
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect

from server.app import create_app
from server.people.oidc.endpoints import CALLBACK
from server.security.access import OPEN_PATHS
from server.security.secrets import load_secrets
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN


@pytest.fixture
def stranger(app: FastAPI) -> Iterator[TestClient]:
    """A browser that has not logged in."""

    @app.websocket("/live/echo")
    async def echo(websocket: WebSocket) -> None:
        await websocket.accept()
        await websocket.close()

    @app.get("/api/worker/ping")
    def ping() -> str:
        return "pong"

    # The pages answer whatever is left, so what is added later has to stand before them.
    app.router.routes[:] = app.router.routes[-2:] + app.router.routes[:-2]
    with TestClient(app, base_url=BASE_URL, follow_redirects=False) as client:
        yield client


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def test_every_route_of_the_api_needs_a_login(stranger: TestClient, app: FastAPI) -> None:
    paths = app.openapi()["paths"]
    assert len(paths) > 15
    for path, operations in paths.items():
        for method in operations:
            response = stranger.request(method, path)
            # The ways to log in are open: they say what was missing. Every route and role: test_permissions.py.
            opened = 404 if path == CALLBACK else 200 if method == "get" else 422  # no provider of identities is set
            assert response.status_code == (opened if path in OPEN_PATHS else 401), (method, path)
    assert stranger.get("/api/openapi.json").status_code == 401
    assert stranger.get("/api/nothing").status_code == 401
    assert stranger.get("/live/x/").status_code == 401


def test_health_and_pages_are_open(stranger: TestClient) -> None:
    assert stranger.get("/healthz").json() == {"status": "ok"}
    assert stranger.get("/").status_code == 503  # not built in this test, but not refused


def test_the_printed_url_logs_in_and_hides_its_token(stranger: TestClient) -> None:
    response = stranger.get(f"/experiments?tab=all&token={TOKEN}")

    assert response.status_code == 303
    assert response.headers["location"] == "/experiments?tab=all"
    cookie = response.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    # The cookie is not the token: a stolen one opens pages until the token changes, and tells nobody the token.
    assert TOKEN not in cookie
    assert stranger.get("/api/status").status_code == 200


def test_the_redirect_after_login_never_leaves_this_server(stranger: TestClient) -> None:
    response = stranger.get(f"{BASE_URL}//evil.example/?token={TOKEN}")

    assert response.headers["location"] == "/evil.example/"


@pytest.mark.parametrize("path", ["/?token=wrong", "/?token="])
def test_a_wrong_token_in_the_url(stranger: TestClient, path: str) -> None:
    response = stranger.get(path)

    assert response.status_code == 401
    assert "set-cookie" not in response.headers


def test_login_by_form(stranger: TestClient) -> None:
    assert stranger.post("/api/login", json={"token": "wrong"}).status_code == 401
    assert stranger.get("/api/status").status_code == 401
    assert stranger.post("/api/login", json={"token": TOKEN}).status_code == 204
    assert stranger.get("/api/status").status_code == 200


def test_a_refused_login_does_not_repeat_what_was_typed(stranger: TestClient) -> None:
    response = stranger.post("/api/login", json={"token": ["my secret"]})

    assert response.status_code == 422
    assert "my secret" not in response.text


def test_programs_log_in_by_header(stranger: TestClient) -> None:
    assert stranger.get("/api/status", headers=bearer(TOKEN)).status_code == 200
    assert stranger.get("/api/status", headers={"Authorization": f"bearer {TOKEN}"}).status_code == 200
    assert stranger.get("/api/status", headers=bearer("wrong")).status_code == 401
    assert stranger.get("/api/status", headers={"Authorization": "Bearer ünïcode".encode()}).status_code == 401
    assert stranger.get("/api/status", headers={"Authorization": f"Basic {TOKEN}"}).status_code == 401


def test_each_token_opens_its_own_door_only(stranger: TestClient) -> None:
    assert stranger.get("/api/worker/ping", headers=bearer(WORKER_TOKEN)).json() == "pong"
    assert stranger.get("/api/worker/ping", headers=bearer(TOKEN)).status_code == 401
    assert stranger.get("/api/worker/ping").status_code == 401
    assert stranger.get("/api/status", headers=bearer(WORKER_TOKEN)).status_code == 403


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8400", 200),
        ("localhost:8400", 200),
        ("LOCALHOST", 200),
        ("[::1]:8400", 200),
        # A machine in the network is reached by its address; no foreign name can pose as one.
        ("192.168.1.7:8400", 200),
        ("lab.example:8400", 200),
        ("evil.example", 400),
        ("localhost.evil.example", 400),
        ("127.0.0.1.evil.example", 400),
        ("", 400),
        ("[", 400),
    ],
)
def test_only_our_own_names_are_answered(settings: Settings, app: FastAPI, host: str, status: int) -> None:
    named = create_app(settings.model_copy(update={"allowed_hosts": ("lab.example",)}))
    with TestClient(named, base_url=BASE_URL) as client:
        assert client.get("/healthz", headers={"Host": host}).status_code == status


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        (None, 201),
        (BASE_URL, 201),
        ("http://127.0.0.1:9999", 403),
        ("http://evil.example", 403),
        ("http://127.0.0.1:8400.evil.example", 403),
        ("null", 403),
        ("http://[", 403),
    ],
)
def test_another_sites_page_changes_nothing(stranger: TestClient, origin: str | None, status: int) -> None:
    stranger.post("/api/login", json={"token": TOKEN})
    headers = {"Origin": origin} if origin else {}

    assert stranger.post("/api/experiments", json={}, headers=headers).status_code == status


def test_web_sockets_need_the_same(stranger: TestClient) -> None:
    def refusal(**headers: str) -> str | None:
        try:
            with stranger.websocket_connect("/live/echo", headers={"Host": "127.0.0.1:8400"} | headers):
                return None
        except WebSocketDisconnect as refused:
            return refused.reason

    assert "Log in first" in (refusal() or "")
    stranger.post("/api/login", json={"token": TOKEN})
    cookie = "; ".join(f"{name}={value}" for name, value in stranger.cookies.items())
    assert refusal(Cookie=cookie, Origin=BASE_URL) is None
    assert "another site's page" in (refusal(Cookie=cookie, Origin="http://evil.example") or "")
    assert "does not go by the name" in (refusal(Cookie=cookie, Host="evil.example") or "")


def test_pages_are_held_to_what_they_are_meant_to_do(stranger: TestClient) -> None:
    for path in ("/", "/healthz", "/api/status"):
        headers = stranger.get(path).headers
        assert "default-src 'self'" in headers["content-security-policy"]
        assert "script-src" not in headers["content-security-policy"], "default-src 'self' forbids inline scripts"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
    assert stranger.get("/api/status").headers["cache-control"] == "no-store"


def test_a_body_over_the_cap_is_refused(settings: Settings) -> None:
    app = create_app(settings.model_copy(update={"max_body_bytes": 1_000}))
    with TestClient(app, base_url=BASE_URL, headers=bearer(TOKEN)) as client:
        assert client.post("/api/experiments", json={"name": "x" * 2_000}).status_code == 413
        assert client.post("/api/experiments", content=iter([b"x" * 600] * 2)).status_code == 413
        # A checkpoint may be larger; this one is not described by its first line.
        upload = client.put(
            "/api/worker/runs/r/checkpoints/1?attempt=1",
            content=b"x" * 900 + b"\n" + b"x" * 9_000,
            headers=bearer(WORKER_TOKEN),
        )
        assert upload.status_code == 422
        assert "does not describe a checkpoint" in upload.json()["detail"]


@pytest.mark.parametrize("body", ["[" * 100_000, '{"seeds": [' + "9" * 5_000 + "]}", "{", '"\ud800"', b"\xff\xfe"])
def test_json_that_is_meant_to_do_harm(client: TestClient, body: str | bytes) -> None:
    content = body if isinstance(body, bytes) else body.encode(errors="surrogatepass")
    response = client.post("/api/experiments", content=content, headers={"Content-Type": "application/json"})

    assert response.status_code in (400, 422)


def test_the_network_needs_a_token_of_ones_own() -> None:
    with pytest.raises(ValidationError, match="without a login token"):
        Settings(host="0.0.0.0")
    with pytest.raises(ValidationError, match="at least 16 characters"):
        Settings.model_validate({"host": "192.168.1.7", "token": "short"})

    assert Settings.model_validate({"host": "0.0.0.0", "token": "x" * 16}).host == "0.0.0.0"
    for host in ("127.0.0.1", "127.8.8.8", "::1", "localhost"):
        assert Settings(host=host).token is None


def test_tokens_are_made_once_and_kept_for_their_owner_only(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path / "data")
    first, second = load_secrets(settings), load_secrets(settings)

    assert first == second
    assert first.token != first.worker_token
    assert len(first.token) == 48
    assert (tmp_path / "data" / "token").stat().st_mode & 0o777 == 0o600
    assert first.token not in repr(first)
    assert load_secrets(Settings(data_dir=tmp_path / "other")).token != first.token


@pytest.mark.parametrize(
    "address",
    ["/%00", "/api/experiments?query=%00", "/api/runs/%00", "/api/compare?experiment=a%00", "/assets/%00"],
)
def test_no_address_holds_a_nul(client: TestClient, address: str) -> None:
    response = client.get(address)
    assert (response.status_code, "NUL" in response.json()["detail"]) == (400, True)
