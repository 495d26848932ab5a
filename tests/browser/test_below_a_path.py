"""Behind Caddy and nginx, below a path: a browser launches, watches, downloads, signs in by a provider and out."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Response, expect

from tests.browser.conftest import PATIENCE, running
from tests.browser.test_provider_sign_in import at_the_provider
from tests.oidc_provider import OidcProvider, oidc_provider, settings_for
from tests.services.proxies import Way, certificate, proxy, settings_behind
from tests.services.stack import free_port
from workers.checkpoints import read_policy

pytestmark = pytest.mark.browser

SOON = 90_000


@dataclass
class Below:
    """A service below a path, as a browser reaches it."""

    url: str
    path: str
    token: str
    direct: str
    provider: OidcProvider


# One proxy passes the path on, as docs/proxies shows it; the other takes it off.
@pytest.fixture(scope="module", params=[Way("nginx", "/mapless"), Way("caddy", "/tools/mapless", keeps=False)], ids=str)
def below(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Below]:
    way: Way = request.param
    directory = tmp_path_factory.mktemp("below")
    own, port, behind = certificate(directory), free_port(), free_port()
    url = f"https://localhost:{port}{way.path}"
    with oidc_provider(directory, url) as provider:
        provider.knows(ada={"preferred_username": "Ada"})
        given = {f"MAPLESS_{name.upper()}": str(value) for name, value in settings_for(provider, strangers="true").items()}
        environment = {**os.environ, **settings_behind(way, port), **given}
        with (
            running([sys.executable, "-m", "server"], directory / "data", 1, port=behind, env=environment) as address,
            proxy(directory, way, port, behind, own, environment),
        ):
            yield Below(url, way.path, address.partition("token=")[2], f"http://127.0.0.1:{behind}", provider)


@contextmanager
def strict_page(browser: Browser, below: Below) -> Iterator[Page]:
    """A page of a new profile; whatever it asks of the host outside of the path, or is not given, is told in the end."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, ignore_https_errors=True, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    host = below.url.removesuffix(below.path)
    strayed: list[str] = []
    refused: list[str] = []

    def look(url: str) -> None:
        if url.startswith(host) and not f"{url}/".startswith(f"{below.url}/"):
            strayed.append(url)

    def heard(response: Response) -> None:
        # Nobody is signed in at first.
        if response.url.startswith(host) and response.status >= 400 and response.status != 401:
            refused.append(f"{response.status} {response.url}")

    context.on("request", lambda request: look(request.url))
    context.on("response", heard)
    page.on("websocket", lambda socket: look(socket.url.replace("ws", "http", 1)))
    yield page
    context.close()
    assert (strayed, refused) == ([], [])


def test_a_training_is_launched_watched_and_taken_home(browser: Browser, below: Below, tmp_path: Path) -> None:
    with strict_page(browser, below) as page:
        page.goto(f"{below.url}/queue")
        page.get_by_role("button", name="use its token").click()
        page.get_by_label("Token").fill(below.token)
        page.get_by_role("button", name="Log in").click()
        page.get_by_role("navigation").get_by_role("link", name="New training").click()
        expect(page).to_have_url(f"{below.url}/new")
        page.get_by_label("Name", exact=True).fill("Below a path")
        page.get_by_role("textbox", name=re.compile("^Steps")).fill("40000")
        page.get_by_role("button", name="Launch").click()
        page.wait_for_url(f"{below.url}/runs/*", timeout=SOON)

        # Robots move in the frame: its page, viser's socket and the display's are all below the path.
        expect(page.get_by_test_id("live-view")).to_have_attribute("data-receiving", "true", timeout=SOON)
        frame = page.frame_locator("[data-testid=live-frame]")
        expect(frame.locator("canvas").first).to_be_visible(timeout=SOON)
        expect(frame.locator("#display")).to_contain_text("real time", timeout=SOON)

        # Told by the stream of events.
        expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "completed", timeout=SOON)
        with page.expect_download(timeout=SOON) as download:
            page.get_by_test_id("checkpoint").first.get_by_role("link", name=re.compile("Download")).click()
        manifest, _ = read_policy(download.value.path())
        assert manifest.step > 0

        # A replay is a page of its own in a frame.
        page.get_by_role("button", name=re.compile("^Replay episode")).first.click()
        replay = page.frame_locator("[data-testid=replay-frame]")
        expect(replay.get_by_label("Seconds", exact=True)).to_be_visible(timeout=SOON)

        # A deep link opens as it was left, reloaded or sent to somebody.
        deep = page.url
        assert "replay=" in deep
        page.reload()
        expect(page).to_have_url(deep)
        expect(page.get_by_role("dialog")).to_be_visible(timeout=SOON)
        page.goto(below.url)
        expect(page.get_by_role("link", name="Below a path")).to_be_visible()
        page.get_by_role("link", name="Policies", exact=True).click()
        expect(page).to_have_url(f"{below.url}/policies")


def test_people_sign_in_with_the_provider_and_sign_out_there(browser: Browser, below: Below) -> None:
    with strict_page(browser, below) as page:
        page.goto(f"{below.url}/queue")
        page.get_by_role("button", name="Sign in with the university").click()
        at_the_provider(page, "ada", below.provider)
        expect(page).to_have_url(f"{below.url}/queue")
        names = {cookie["name"]: cookie["path"] for cookie in page.context.cookies(f"{below.url}/") if "name" in cookie}
        kept = {name: path for name, path in names.items() if name.startswith("mapless-")}
        assert len(kept) == 1
        assert set(kept.values()) == {below.path}
        assert page.context.cookies(below.url.removesuffix(below.path)) == []

        page.get_by_role("button", name="Account of ada").click()
        page.get_by_role("menuitem", name="Sign out of the university, too").click()
        page.wait_for_url(f"{below.provider.issuer}/**")
        page.get_by_role("button", name="Yes, sign me out").click()
        expect(page).to_have_url(f"{below.url}/")
        expect(page.get_by_role("button", name="Sign in with the university")).to_be_visible()


def test_links_that_are_made_lead_below_the_path(browser: Browser, below: Below) -> None:
    with strict_page(browser, below) as page:
        page.goto(f"{below.url}/people?token={below.token}")
        expect(page).to_have_url(f"{below.url}/people")
        page.get_by_role("button", name="Make a link").click()
        link = page.get_by_text(re.compile(r"^https://localhost"))
        expect(link).to_have_text(re.compile(re.escape(f"{below.url}/join#")))
        # The address that the service prints at its start is its own, and leads there too.
        page.goto(f"{below.direct}/?token={below.token}")
        expect(page).to_have_url(f"{below.direct}{below.path}/")
        expect(page.get_by_role("navigation").get_by_role("link", name="New training")).to_be_visible()
