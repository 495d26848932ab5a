"""A replay plays in a real browser, with the service and without: it moves, stops, and shows any moment asked for."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import av
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from playwright.sync_api import BrowserContext, Page, expect

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000
# An episode of a shipped policy: nothing has to be trained.
EPISODE = "policy:complex:complex-200/7"


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


def test_two_policies_drive_one_scenario_beside_their_charts_below_one_cursor(
    context: BrowserContext, tmp_path: Path
) -> None:
    asked = {"policies": [{"source": "baseline", "name": "go-to-goal"}], "suites": [{"by": "name", "name": "complex-200"}]}
    (evaluation,) = context.request.post("/api/evaluations", data=asked, timeout=SOON).json()
    page = context.new_page()
    page.goto("/policies/complex?suite=complex-200&replay=8")
    dialog = page.get_by_role("dialog", name="Episode 8")
    expect(dialog.get_by_test_id("chart").first).to_be_visible(timeout=SOON)
    other = f"evaluation:{evaluation['id']}"
    page.wait_for_function(
        "async (id) => (await (await fetch(`/api/evaluations/${id}`)).json()).figures !== null", arg=evaluation["id"]
    )
    # As a link that was passed on.
    page.goto(f"/policies/complex?suite=complex-200&replay=8&with={other}")
    expect(dialog.get_by_test_id("replay-ends").get_by_role("button")).to_have_count(2, timeout=SOON)
    charts = dialog.get_by_test_id("chart")
    expect(charts).to_have_count(5, timeout=SOON)
    frame = dialog.get_by_test_id("replay-frame")
    expect(frame).to_have_attribute("data-seconds", re.compile(r"[0-9.]+"), timeout=SOON)
    # The way it ended: a press shows the moment, in the picture and on every chart.
    ends = context.request.get(f"/api/replays/policy:complex:complex-200,{other}/7").json()["policies"]
    dialog.get_by_test_id("replay-ends").get_by_role("button").nth(1).click()
    seconds = ends[1]["seconds"]
    expect(frame).to_have_attribute("data-seconds", re.compile(rf"^{seconds:.1f}"))
    for chart in charts.all():
        expect(chart).to_contain_text(f"Seconds {seconds:.1f}")
    # A press on a chart seeks as well.
    plot = charts.first.locator(".u-over")
    plot.click(position={"x": 5, "y": 20})
    expect(page.frame_locator("[data-testid=replay-frame]").get_by_label("Seconds", exact=True)).not_to_have_value(
        f"{seconds:.1f}"
    )

    def taken_away(form: str) -> Path:
        dialog.get_by_role("button", name="Download").click()
        with page.expect_download(timeout=SOON) as download:
            page.get_by_role("menuitem", name=form).click()
        assert download.value.suggested_filename == f"mapless-complex-and-1-more-episode7.{form.lower()}"
        file = tmp_path / f"episode.{form.lower()}"
        download.value.save_as(file)
        return file

    with av.open(str(taken_away("MP4"))) as container:
        pictures = sum(1 for _ in container.decode(video=0))
    # Twenty a second, and a second and a half of the last one.
    assert pictures == round(20 * max(each["seconds"] for each in ends)) + 1 + 30
    with Image.open(taken_away("GIF")) as gif:
        assert (gif.format, max(gif.size) >= 400) == ("GIF", True)
    with taken_away("MCAP").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        scans = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
    assert [scans["/policy1/scan"], scans["/policy2/scan"]] == [each["steps"] + 1 for each in ends]
    page.reload()
    expect(dialog.get_by_test_id("replay-ends").get_by_role("button")).to_have_count(2, timeout=SOON)
    page.close()


def test_three_beside_leave_everything_in_the_window(context: BrowserContext) -> None:
    prepare(context)
    found = context.request.get("/api/replays/policy:complex:complex-200/beside", timeout=SOON).json()["items"]
    others = "".join(f"&with={each['of']}" for each in found[:3])
    assert others
    page = context.new_page()
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto(f"/policies/complex?suite=complex-200&replay=8{others}")
    ends = page.get_by_test_id("replay-ends")
    expect(ends).to_be_visible(timeout=SOON)
    dialog = page.get_by_role("dialog")
    for part in (page.get_by_test_id("replay"), ends, dialog.get_by_role("button", name="Next", exact=True)):
        box = part.bounding_box()
        assert box is not None
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= 800.0
    stage = page.get_by_test_id("replay").bounding_box()
    assert stage is not None
    assert stage["height"] > 350.0


def test_on_a_phone_nothing_stands_over_the_arena(context: BrowserContext) -> None:
    prepare(context)
    page = context.new_page()
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"/replays/{EPISODE}/light/")
    canvas, card = page.locator("canvas").first, page.locator("#display")
    expect(canvas).to_be_visible(timeout=SOON)
    picture, text = canvas.bounding_box(), card.bounding_box()
    assert picture is not None
    assert text is not None
    assert text["y"] + text["height"] <= picture["y"] + 1.0
    assert picture["y"] + picture["height"] <= 845.0
    assert picture["height"] > 500.0
