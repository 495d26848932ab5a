"""A replay plays in a real browser, with the service and without: it moves, stops, and shows any moment asked for."""

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Page, expect

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000
# An episode of a shipped policy: nothing has to be trained.
EPISODE = "policies/complex/complex-200/7"


def prepare(context: BrowserContext) -> dict[str, Any]:
    """What the service says of the episode, once it was driven again."""
    response = context.request.get("/api/policies/complex/suites/complex-200/replays/7", timeout=SOON)
    replay: dict[str, Any] = response.json()
    return replay


def seek(player: Page, seconds: float) -> None:
    """Shows one moment; the player pauses there."""
    field = player.get_by_label("Seconds", exact=True)
    field.fill(f"{seconds:.1f}")
    expect(field).to_have_value(f"{seconds:.1f}")


def picture(page: Page) -> bytes:
    """The canvas, once it has been drawn for this moment."""
    page.wait_for_timeout(1_500)
    return page.locator("canvas").first.screenshot(timeout=SOON)


def test_it_plays_in_its_frame_and_talks_to_nobody(context: BrowserContext) -> None:
    assert prepare(context)["faithful"]
    asked: list[str] = []
    page = context.new_page()
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.goto(f"/replays/{EPISODE}/light/?playbackPath=/api/status&websocket=ws://evil.example")
    expect(page.locator("#display")).to_contain_text("after")
    seconds = page.get_by_label("Seconds", exact=True)
    expect(seconds).to_be_visible(timeout=SOON)
    expect(seconds).not_to_have_value(seconds.input_value(), timeout=SOON)
    page.get_by_role("button", name="Play or pause").click()
    paused = seconds.input_value()
    page.wait_for_timeout(500)
    expect(seconds).to_have_value(paused)
    # The address was cleaned, and all that is shown came with the page.
    own = f"/replays/{EPISODE}/light/"
    assert page.url.endswith(own)
    assert [url for url in asked if not url.startswith(("data:", "blob:")) and own not in url] == []


def test_what_is_taken_away_shows_any_moment_without_mapless(context: BrowserContext, tmp_path: Path) -> None:
    response = context.request.get(f"/replays/{EPISODE}/dark/?download", timeout=SOON)
    assert re.search(r'filename="mapless-complex-episode7\.html"', response.headers["content-disposition"])
    file = tmp_path / "episode.html"
    file.write_bytes(response.body())
    page = context.new_page()
    # viser makes its picture coarser where a machine is slow: pictures that are compared must not be.
    page.goto(f"{file.as_uri()}?fixedDpr=1")
    play = page.get_by_role("button", name="Play or pause")
    expect(play).to_be_visible(timeout=SOON)
    first = picture(page)
    assert picture(page) != first
    play.click()
    still = picture(page)
    assert picture(page) == still
    seconds = prepare(context)["seconds"]
    seek(page, 0.3 * seconds)
    early = picture(page)
    seek(page, 0.8 * seconds)
    assert picture(page) != early
    seek(page, 0.3 * seconds)
    assert picture(page) == early
