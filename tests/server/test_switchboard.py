"""The way to a route: the same as the framework's own, found at once."""

import pytest
from fastapi import APIRouter, FastAPI, WebSocket
from fastapi.testclient import TestClient
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.types import Receive, Scope, Send

from server.http.switchboard import Switchboard


async def _mounted(scope: Scope, receive: Receive, send: Send) -> None:
    await PlainTextResponse(f"mounted {scope['path']}")(scope, receive, send)


async def _rest(request: Request) -> Response:
    return PlainTextResponse(f"rest {request.path_params['path']}")


def _app() -> FastAPI:
    """Routes that stand in one another's way: words where others have parameters, one path with two methods."""
    app = FastAPI(openapi_url=None)
    things = APIRouter(prefix="/api/things")

    @things.get("/all")
    async def everything() -> str:
        return "all"

    @things.get("/{thing}")
    async def one(thing: str) -> str:
        return f"one {thing}"

    @things.post("/{thing}")
    async def change(thing: str) -> str:
        return f"changed {thing}"

    @things.get("/{thing}/parts/{part:path}")
    async def part(thing: str, part: str) -> str:
        return f"part {part} of {thing}"

    @things.websocket("/{thing}/live")
    async def live(websocket: WebSocket, thing: str) -> None:
        await websocket.accept()
        await websocket.send_text(f"live {thing}")
        await websocket.close()

    @things.post("/told")
    async def never(thing: str) -> str:
        return "behind the route with a parameter"

    app.include_router(things)
    app.router.routes.append(Mount("/files", app=_mounted))
    app.router.routes.append(Route("/{path:path}", _rest, methods=["GET"]))
    return app


_ASKED = (
    ("GET", "/"),
    ("GET", "/api/things/all"),
    ("GET", "/api/things/all/"),
    ("GET", "/api/things/live"),
    ("GET", "/api/things/one%20or%20two"),
    ("GET", "/api/things/a%2Fb"),
    ("GET", "/api/things"),
    ("GET", "/api/things/"),
    ("GET", "/api/things//parts/x"),
    ("GET", "/api/things/x/parts/"),
    ("GET", "/api/things/x/parts/y/parts/z"),
    ("GET", "/api/things/x/parts"),
    ("GET", "/api/things/x/live"),
    ("GET", "/files"),
    ("GET", "/files/"),
    ("GET", "/files/a/b"),
    ("GET", "/files/all/parts/live/things/x/y/z"),
    ("GET", "/filesystem"),
    ("GET", "/x/y/z"),
    ("POST", "/api/things/all"),
    ("POST", "/api/things/told"),
    ("DELETE", "/api/things/all"),
    ("POST", "/x"),
    ("PUT", "/api/things"),
)


@pytest.mark.parametrize(("method", "path"), _ASKED)
def test_every_address_is_answered_as_by_the_router(method: str, path: str) -> None:
    plain, quick = _app(), _app()
    quick.router.middleware_stack = Switchboard(quick.router)
    expected = TestClient(plain).request(method, path, follow_redirects=False)
    for _ in range(2):  # found for the first time, and remembered
        got = TestClient(quick).request(method, path, follow_redirects=False)
        assert (got.status_code, got.text, got.headers.get("location")) == (
            expected.status_code,
            expected.text,
            expected.headers.get("location"),
        )
        assert got.headers.get("allow") == expected.headers.get("allow")


def test_sockets_too() -> None:
    app = _app()
    app.router.middleware_stack = Switchboard(app.router)
    with TestClient(app).websocket_connect("/api/things/x/live") as socket:
        assert socket.receive_text() == "live x"


def test_where_nothing_takes_every_address_the_router_itself_answers() -> None:
    app = _app()
    del app.router.routes[-1]
    app.router.middleware_stack = Switchboard(app.router)
    client = TestClient(app)
    assert client.get("/nowhere").status_code == 404
    assert client.get("/api/things/all/", follow_redirects=False).headers["location"].endswith("/api/things/all")


def test_a_route_that_is_added_later_is_found() -> None:
    app = _app()
    app.router.middleware_stack = Switchboard(app.router)
    client = TestClient(app)
    assert client.get("/api/later").text == "rest api/later"

    app.router.routes.insert(0, Route("/api/later", _later))

    assert client.get("/api/later").text == "later"
    assert client.get("/api/things/all").json() == "all"


async def _later(_request: Request) -> Response:
    return PlainTextResponse("later")
