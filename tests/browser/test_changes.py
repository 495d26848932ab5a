"""A page hears of what it shows: what others do appears without a reload, on the page that one is on."""

import re
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.server.test_serving import serving

pytestmark = pytest.mark.browser

SOON = 30_000


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A service without workers, with its token."""
    data: Path = tmp_path_factory.mktemp("changes")
    with serving(data) as (_, url):
        yield url


def until_followed(page: Page, streams: list[str], *parts: str) -> None:
    """Wait until the newest stream that the page has opened asks for all of these."""
    for _ in range(SOON // 100):
        if streams and all(part in streams[-1] for part in parts):
            return
        page.wait_for_timeout(100)
    pytest.fail(f"the page asks for {streams[-1:]}, not for {parts}")


def test_what_others_do_appears_where_it_is_shown(browser: Browser, url: str) -> None:
    base, _, token = url.partition("/?token=")
    others = httpx.Client(base_url=base, headers={"Authorization": f"Bearer {token}"}, timeout=30)
    context = browser.new_context(base_url=base)
    page: Page = context.new_page()
    streams: list[str] = []
    page.on("request", lambda request: streams.append(request.url) if "/api/events" in request.url else None)
    page.goto(url)
    expect(page.get_by_role("link", name="Trainings")).to_be_visible(timeout=SOON)

    experiment = others.post("/api/experiments", json={"name": "Launched elsewhere", "seeds": [0]}).json()
    row = page.get_by_role("link", name=re.compile("Launched elsewhere"))
    expect(row.first).to_be_visible(timeout=SOON)
    until_followed(page, streams, "follow=shown", "reports=true")

    row.first.click()
    expect(page.get_by_role("heading", name=re.compile("Launched elsewhere"))).to_be_visible(timeout=SOON)
    until_followed(page, streams, f"experiment={experiment['id']}", "since=")
    others.patch(f"/api/experiments/{experiment['id']}", json={"name": "Renamed elsewhere"}).raise_for_status()
    expect(page.get_by_role("heading", name=re.compile("Renamed elsewhere"))).to_be_visible(timeout=SOON)
    context.close()
    others.close()
