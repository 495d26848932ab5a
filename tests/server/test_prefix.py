"""Below a path: the same service, whether a proxy passes the path on or takes it off, and nobody else's cookies."""

import re
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect

from server.people.commands import PeopleCommands
from server.printing.service import PrintingService
from server.settings import Settings
from tests.server.harness import TOKEN, Reports

ROOT = Path(__file__).parents[2]
PUBLIC = "https://lab.example/mapless"
PAGE = """<!doctype html><html lang="en"><link rel="icon" href="/favicon.svg">
<script src="/frame.js" data-entry="/assets/a.js"></script>
<a href="/">Home</a><a href="/queue">Queue</a><a href="#main">Skip</a><a href="https://example.org/">Away</a></html>"""


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Pages below a path, built."""
    settings.web_dist.mkdir()
    (settings.web_dist / "index.html").write_text(PAGE)
    (settings.web_dist / "favicon.svg").write_text("<svg/>")
    return Settings.model_validate(settings.model_dump(exclude_unset=True) | {"public_url": f"{PUBLIC}/"})


@pytest.fixture
def behind(app: FastAPI, client: TestClient) -> TestClient:
    """A stranger's browser behind a proxy, by which the Host comes through."""
    return TestClient(app, base_url="http://lab.example", follow_redirects=False)


def bearer() -> dict[str, str]:
    return {"Authorization": f"Bearer {TOKEN}"}


def test_a_proxy_may_pass_the_path_on_or_take_it_off(behind: TestClient) -> None:
    for prefix in ("/mapless", ""):
        assert behind.get(f"{prefix}/healthz").json() == {"status": "ok"}
        assert behind.get(f"{prefix}/favicon.svg").text == "<svg/>"
        assert behind.get(f"{prefix}/api/status", headers=bearer()).status_code == 200
        assert "data-base" in behind.get(f"{prefix}/queue").text
    # The path itself, with no slash behind it.
    assert "data-base" in behind.get("/mapless").text


def test_what_needs_a_login_needs_it_below_the_path_too(behind: TestClient) -> None:
    for prefix in ("/mapless", "", "/mapless/mapless", "/maplessly"):
        for path in ("/api/status", "/live/x/", "/replays/x/1/light/", "/metrics"):
            response = behind.get(prefix + path)
            # Below another path is nothing but the page that says so.
            assert response.status_code == (401 if prefix in ("/mapless", "") else 200), prefix + path
            assert "workers" not in response.text
    with pytest.raises(WebSocketDisconnect), behind.websocket_connect("/mapless/live/x"):
        pass


def test_every_address_in_a_page_has_the_path(behind: TestClient) -> None:
    page = behind.get("/mapless/queue")

    assert page.headers["cache-control"] == "no-cache"
    assert '<html data-base="/mapless" lang="en">' in page.text
    assert re.findall(r'(?:href|src|data-entry)="([^"]+)"', page.text) == [
        "/mapless/favicon.svg",
        "/mapless/frame.js",
        "/mapless/assets/a.js",
        "/mapless/",
        "/mapless/queue",
        "#main",
        "https://example.org/",
    ]


def test_who_comes_to_the_server_itself_is_led_below_the_path(client: TestClient) -> None:
    """There a page without the path would look for itself where it is not."""
    response = client.get("/runs/abc?tab=log", follow_redirects=False)
    assert response.headers["location"] == "/mapless/runs/abc?tab=log"
    assert "data-base" in client.get("/mapless/runs/abc").text
    # Programs on this machine need not know of it.
    assert client.get("/api/status").status_code == 200


def test_redirects_lead_below_the_path_and_nowhere_else(behind: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]["id"]
    for prefix in ("/mapless", ""):
        live = behind.get(f"{prefix}/live/{run}/?darkMode", headers=bearer())
        assert live.headers["location"] == f"/mapless/live/{run}/dark/?darkMode"
        login = behind.get(f"http://lab.example{prefix}//evil.example/?token={TOKEN}")
        assert login.headers["location"] == "/mapless/evil.example/"


def test_the_live_views_own_socket_is_the_one_below_the_path(behind: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]["id"]
    page = f"/mapless/live/{run}/light/"
    own = behind.get(page, params={"websocket": f"ws://lab.example/mapless/live/{run}/light"}, headers=bearer())
    assert own.status_code == 200
    other = behind.get(page, params={"websocket": f"ws://lab.example/live/{run}/light"}, headers=bearer())
    assert other.headers["location"] == page


def test_cookies_stay_below_the_path(behind: TestClient) -> None:
    login = behind.get(f"/mapless/queue?token={TOKEN}")
    assert login.headers["location"] == "/mapless/queue"
    assert login.headers["set-cookie"].startswith("mapless-8400-mapless=")
    assert "Path=/mapless;" in login.headers["set-cookie"]
    assert behind.get("/mapless/api/status").status_code == 200
    # A browser takes it nowhere else on that host; without it nothing is seen.
    assert behind.get("/api/status").status_code == 401
    assert behind.post("/mapless/api/sign-out").status_code == 204
    assert behind.get("/mapless/api/status").status_code == 401


def test_the_name_in_the_address_is_one_of_ours(client: TestClient) -> None:
    assert client.get("/healthz", headers={"Host": "lab.example"}).status_code == 200
    assert client.get("/healthz", headers={"Host": "other.example"}).status_code == 400


def test_what_is_sent_out_names_the_whole_address(behind: TestClient, settings: Settings, monkeypatch: Any) -> None:
    link = PeopleCommands(settings).invite(None, "viewer", 1, admin=True)
    assert link.startswith(f"{PUBLIC}/join#")

    told: list[str] = []

    def report(_service: object, _wanted: object, _metrics: object, url: str) -> str:
        told.append(url)
        return ""

    monkeypatch.setattr(PrintingService, "report", report)
    behind.get("/mapless/api/compare/report", params={"experiment": "x"}, headers=bearer())
    assert told == ["http://lab.example/mapless"]


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("lab.example/mapless", "no address"),
        ("ftp://lab.example", "no address"),
        ("https://lab.example/mapless?a=1", "no address"),
        ("https://lab.example/a//b", "single slashes"),
        ("https://lab.example/a/../b", "single slashes"),
        ('https://lab.example/a"b', "single slashes"),
        ("https://lab.example/api", "the server's own"),
        ("https://lab.example/live/x", "the server's own"),
    ],
)
def test_addresses_that_can_not_be_meant(url: str, reason: str) -> None:
    with pytest.raises(ValidationError, match=reason):
        Settings.model_validate({"public_url": url})


@pytest.mark.parametrize("url", [None, "https://lab.example", "https://lab.example/", "http://127.0.0.1:8400"])
def test_where_pages_stand_at_the_root_nothing_is_rewritten(url: str | None, tmp_path: Path) -> None:
    assert Settings.model_validate({"public_url": url, "data_dir": tmp_path}).path_prefix == ""


def test_no_page_names_an_address_without_the_path() -> None:
    """React Router puts it before its own links; everything else goes through `at` of web/src/lib/base.ts."""
    named = [
        f"{path.relative_to(ROOT)}: {found}"
        for path in (ROOT / "web" / "src").rglob("*.ts*")
        if ".test." not in path.name and path.name != "frame.ts"
        for found in re.findall(
            r"""(?:href|src)=\{?["'`]/[^"'`]*|\((?:path|page|url), window\.location|EventSource\([`'"]/""", path.read_text()
        )
    ]
    assert named == []
