"""A phone's screen, and the fingers on it, as the browser has them from a screen that is touched."""

from typing import Any

from playwright.sync_api import CDPSession, Locator, Page, ViewportSize

Place = tuple[float, float]

PHONE: ViewportSize = {"width": 390, "height": 844}
"""CSS pixels."""


class Hand:
    """Fingers on a page, as the browser has them from a screen."""

    def __init__(self, page: Page) -> None:
        page.set_viewport_size(PHONE)
        self._session: CDPSession = page.context.new_cdp_session(page)
        self._session.send("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})

    def drag(self, *ways: tuple[Place, Place], steps: int = 8) -> None:
        """Each finger comes down in turn, all go their way together, and all are lifted."""
        for down in range(1, len(ways) + 1):
            self._send("touchStart", [begin for begin, _ in ways[:down]])
        for step in range(1, steps + 1):
            share = step / steps
            self._send("touchMove", [tuple(a + (b - a) * share for a, b in zip(*way, strict=True)) for way in ways])
        self._send("touchEnd", [])

    def tap(self, where: Locator) -> None:
        """One finger comes down in the middle of something, and is lifted."""
        box = where.bounding_box()
        assert box is not None
        at = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.drag((at, at), steps=0)

    def _send(self, kind: str, places: list[Any]) -> None:
        points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
