"""Finds the route of an address without trying two hundred of them one after another.

A router asks each of its routes in turn, twice where routers hold routers, which took longer than many an answer. Here the
routes that an address may lead to are found by its segments, and only these are asked, in their order and by the same rules.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from fastapi import APIRouter
from fastapi.routing import iter_route_contexts
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send

# Kinds of addresses whose routes are remembered: as many as there are routes, and some that lead nowhere.
_MAX_KNOWN = 2_000
_OPEN_ENDED = ":path}"


@dataclass(frozen=True, slots=True)
class _Pattern:
    """Segments of a path, None for one that is a parameter; whether anything may follow."""

    segments: tuple[str | None, ...]
    open_ended: bool

    def may_match(self, segments: tuple[str | None, ...]) -> bool:
        own = len(self.segments)
        if len(segments) < own or (len(segments) > own and not self.open_ended):
            return False
        return all(mine is None or mine == given for mine, given in zip(self.segments, segments, strict=False))


class Switchboard:
    """Answers as a router does.

    Args:
        router: that is asked where nothing here matches: it may redirect, or answer that there is no such address.
    """

    def __init__(self, router: APIRouter) -> None:
        self._router = router
        self._look()

    def _look(self) -> None:
        routes = self._router.routes
        self._count = len(routes)
        self._patterns = [(pattern, route) for route in routes for pattern in _patterns(route)]
        longest = max((len(pattern.segments) for pattern, _ in self._patterns), default=0)
        self._words: list[set[str]] = [set() for _ in range(longest)]
        for pattern, _ in self._patterns:
            for words, segment in zip(self._words, pattern.segments, strict=False):
                if segment is not None:
                    words.add(segment)
        self._known: dict[tuple[str | None, ...], ASGIApp] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on to the routes that the address may lead to."""
        if scope["type"] not in ("http", "websocket") or scope.get("root_path"):
            await self._router.app(scope, receive, send)
            return
        if len(self._router.routes) != self._count:
            self._look()
        kind = self._kind_of(scope["path"])
        answer = self._known.get(kind)
        if answer is None:
            answer = self._leading(kind)
            if len(self._known) < _MAX_KNOWN:
                self._known[kind] = answer
        await answer(scope, receive, send)

    def _kind_of(self, path: str) -> tuple[str | None, ...]:
        """The segments of an address that are words of some route's path, None for any others; none of what follows."""
        segments = path.split("/", len(self._words) + 1)[1:]
        kind = [segment if segment in words else None for segment, words in zip(segments, self._words, strict=False)]
        return tuple(kind + [None] * (len(segments) - len(kind)))

    def _leading(self, kind: tuple[str | None, ...]) -> ASGIApp:
        found = list({id(route): route for pattern, route in self._patterns if pattern.may_match(kind)}.values())
        if not found:
            return self._router.app
        return APIRouter(routes=found, redirect_slashes=False, default=self._router.default).app


def _patterns(route: BaseRoute) -> Iterator[_Pattern]:
    for context in iter_route_contexts([route]):
        path = getattr(context, "path", None)
        if path is None:
            yield _Pattern((), open_ended=True)
            continue
        # A mounted application has all below its path.
        open_ended = not isinstance(context.original_route, Route | WebSocketRoute)
        segments: list[str | None] = []
        for segment in path.split("/")[1:]:
            if _OPEN_ENDED in segment:
                open_ended = True
                break
            segments.append(None if "{" in segment else segment)
        yield _Pattern(tuple(segments), open_ended)
