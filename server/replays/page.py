"""A replay as one HTML file: viser's own client and player with the episode inside, for a frame or to take away."""

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from server.live.page import asset, viser_page
from workers.reporting import EpisodeResult
from workers.scene.themes import Theme, css_colour
from workers.wording import counted

_DIRECTORY = Path(__file__).parent / "assets"
_OUTCOMES = {"arrival": "Arrived", "collision": "Collided", "timeout": "Timed out"}
_UNFAITHFUL = "Driven again, it ended otherwise than recorded: this processor rounds otherwise."


def replay_page(theme: Theme, recording: Path, caption: "Caption | LapseCaption") -> str:
    """The page.

    Args:
        theme: light or dark, as the recording is.
        recording: a `.viser` file.
        caption: what it shows.
    """
    data = base64.b64encode(recording.read_bytes()).decode("ascii")
    dark = str(theme == "dark").lower()
    head = (
        f"<style>{asset('display.css')}{_asset('replay.css')}</style><script>{_asset('replay.js')}</script>"
        # By these names viser's client finds a recording that comes along with its page.
        f'<script>window.__VISER_EMBED_DATA__="{data}";window.__VISER_EMBED_CONFIG__={{darkMode:{dark}}};</script>'
    )
    return viser_page(theme, head, caption.html())


def failed_page(theme: Theme, message: str) -> str:
    """In the place of a replay that can't be shown: why, and a way to ask for it once more.

    Args:
        theme: light or dark.
        message: what has happened, and what to do about it.
    """
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>No replay</title>'
        f'<style>{_asset("failed.css")}</style></head><body data-theme="{theme}"><main><h1>This can\'t be shown now</h1>'
        f'<p>{html.escape(message)}</p><p><a href="">Try again</a></p></main></body></html>'
    )


@dataclass(frozen=True)
class Driver:
    """Who drove.

    Attributes:
        title: of the policy.
        result: how it ended now.
        seconds: of simulated time.
        faithful: whether it ended as recorded.
    """

    title: str
    result: EpisodeResult
    seconds: float
    faithful: bool


@dataclass(frozen=True)
class Caption:
    """What a replay shows.

    Attributes:
        suite: its name.
        episode: its place in the suite, from 0.
        drivers: who drove it, in the order of their colours.
    """

    suite: str
    episode: int
    drivers: Sequence[Driver]

    def html(self) -> str:
        """The caption over the picture."""
        lines = [
            f'<div class="title"><span class="mode">Episode {self.episode + 1}</span>',
            f"<span>of {html.escape(self.suite)}</span></div>",
        ]
        for number, driver in enumerate(self.drivers):
            outcome = driver.result.outcome
            lasted = f"{counted(driver.result.steps)} steps, {driver.seconds:.1f} s"
            dot = f'<i style="background:{css_colour(number)}"></i>' if len(self.drivers) > 1 else ""
            lines += [
                f'<div class="step">{dot}{html.escape(driver.title)}</div>',
                f'<div class="outcome {outcome}">{_OUTCOMES[outcome]} after {lasted}</div>',
                "" if driver.faithful else f'<div class="note">{_UNFAITHFUL}</div>',
            ]
        return f'<div id="display">{"".join(lines)}</div>'


@dataclass(frozen=True)
class LapseCaption:
    """What a time lapse shows.

    Attributes:
        title: of the run.
        suite: its name.
        scenarios: robots in the picture.
        chapters: when each begins, seconds, and what it shows.
    """

    title: str
    suite: str
    scenarios: int
    chapters: Sequence[tuple[float, str]]

    def html(self) -> str:
        """The caption over the picture; its last line follows the time."""
        chapters = html.escape(json.dumps(self.chapters))
        lines = (
            '<div class="title"><span class="mode">Time lapse</span>',
            f"<span>{self.scenarios} scenarios of {html.escape(self.suite)}</span></div>",
            f'<div class="step">{html.escape(self.title)}</div>',
            f'<div class="chapter" data-chapters="{chapters}">{html.escape(self.chapters[0][1])}</div>',
        )
        return f'<div id="display">{"".join(lines)}</div>'


def _asset(name: str) -> str:
    return (_DIRECTORY / name).read_text(encoding="utf-8")
