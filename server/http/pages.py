"""The built pages: hashed assets that never change, and for every route of the application the HTML of its page.

A page asks for some seventy files at once. They are small and few enough to stay in memory, and go out as they are: assets
without a thread or a look at the disk, the rest with one look at whether they were built anew.
"""

import functools
import gzip
import hashlib
import json
import mimetypes
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.routing import Route
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send

from server.errors import NotFoundError
from server.http.prefix import is_at_home

_MISSING = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Mapless</title>
<body style="font: 1rem/1.5 system-ui; max-width: 40rem; margin: 4rem auto; padding: 0 1rem">
<h1>The pages have not been built</h1>
<p>The service is running, but <code>web/dist</code> is not there. Run <code>make pages</code> in the project's directory and
reload this page. The API works meanwhile.</p></body></html>"""

# Vite puts a hash of the content into the names below assets/.
_FOREVER = "public, max-age=31536000, immutable"
_ASK_EACH_TIME = "no-cache"

# Made by the build beside each asset, the smallest first (`web/plugins/compressed.ts`).
_ENCODINGS = {"br": ".br", "gzip": ".gz"}
# Below this, in bytes, a packet holds it anyway.
_COMPRESS_FROM = 1_000
# All that a build leaves has a quarter of that.
_MAX_KEPT_BYTES = 32 * 2**20


@dataclass(frozen=True, slots=True)
class _Kept:
    """A file as it is sent: its bytes, and the headers that go with them."""

    body: bytes
    tag: str
    headers: list[tuple[bytes, bytes]]

    @classmethod
    def of(cls, body: bytes, name: str, caching: str, encoding: str | None = None, *, varies: bool = False) -> "_Kept":
        tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
        response = Response(media_type=mimetypes.guess_type(name)[0] or "application/octet-stream")
        response.headers.update({"Content-Length": str(len(body)), "Cache-Control": caching, "ETag": tag})
        if encoding:
            response.headers["Content-Encoding"] = encoding
        if encoding or varies:
            response.headers["Vary"] = "Accept-Encoding"
        return cls(body, tag, response.raw_headers)

    async def send(self, scope: Scope, send: Send, *more: tuple[bytes, bytes]) -> None:
        """To whoever has not got it, with more headers."""
        tags = Headers(scope=scope).get("if-none-match")
        known = tags is not None and self.tag in tags
        headers = [each for each in self.headers if each[0] != b"content-length"] if known else list(self.headers)
        await send({"type": "http.response.start", "status": 304 if known else 200, "headers": [*headers, *more]})
        await send({"type": "http.response.body", "body": b"" if known or scope["method"] == "HEAD" else self.body})


@dataclass(frozen=True, slots=True)
class _Page:
    """One of the pages (`web/plugins/pages.ts`).

    Attributes:
        pattern: of its addresses.
        file: its HTML.
        asked: what it asks the API first, of which its address says all.
    """

    pattern: re.Pattern[str]
    file: str
    asked: tuple[str, ...]


@functools.lru_cache(maxsize=64)
def _taken(accept_encoding: str) -> frozenset[str]:
    """The encodings that somebody takes."""
    return frozenset(part.split(";")[0].strip() for part in accept_encoding.split(",")).intersection(_ENCODINGS)


class _Assets(StaticFiles):
    """Reads each asset once; parts of one, and what is not there, as Starlette does it."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory=directory, check_dir=False)
        self._kept: dict[tuple[str, frozenset[str]], _Kept] = {}
        self._bytes = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        headers = Headers(scope=scope)
        whole = scope["type"] == "http" and scope["method"] in ("GET", "HEAD") and "range" not in headers
        if not whole:
            await super().__call__(scope, receive, send)
            return
        key = (self.get_path(scope), _taken(headers.get("accept-encoding", "")))
        kept = self._kept.get(key) or self._read(*key)
        if kept is None:
            await super().__call__(scope, receive, send)
            return
        await kept.send(scope, send)

    def _read(self, path: str, taken: frozenset[str]) -> _Kept | None:
        """The file, the smallest that is taken; None where there is none, or no room for it any more."""
        for encoding, ending in (*_ENCODINGS.items(), (None, "")):
            if encoding is not None and encoding not in taken:
                continue
            try:
                file, about = self.lookup_path(path + ending)
            except OSError:
                # Longer than any file's name.
                return None
            if about is None or not Path(file).is_file():
                continue
            if self._bytes + about.st_size > _MAX_KEPT_BYTES:
                return None
            kept = _Kept.of(Path(file).read_bytes(), path, _FOREVER, encoding)
            self._bytes += len(kept.body)
            self._kept[path, taken] = kept
            return kept
        return None


class _Pages:
    """The HTML of the page at an address, and the few files beside the assets.

    Args:
        dist: the built pages.
        prefix: what stands before every path in a browser's address.
        is_known: whether somebody may be signed in who asks.
    """

    def __init__(self, dist: Path, prefix: str, is_known: Callable[[Request], bool]) -> None:
        self._dist = dist
        self._prefix = prefix
        self._is_known = is_known
        self._kept: dict[tuple[Path, bool], tuple[int, _Kept]] = {}
        self._pages: tuple[int, list[_Page]] = (0, [])

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it.

        Raises:
            NotFoundError: it is an address of the API, or the like.
        """
        request = Request(scope)
        path: str = request.path_params["path"]
        if path.startswith(("api/", "live/")):
            raise NotFoundError(f"There is no route {request.url.path}.")
        # Every file of a build has an ending, and no address of a page.
        file = _file_within(self._dist, path) if "." in path else None
        page, asked = (file, ()) if file else self._page_at(f"/{path}")
        written = _written(page)
        if written is None:
            await HTMLResponse(_MISSING, status_code=503)(scope, receive, send)
            return
        change: Callable[[bytes], bytes] = bytes
        if self._prefix and file is None:
            if not is_at_home(request, self._prefix):
                query = request.url.query
                await RedirectResponse(f"/{path}?{query}" if query else f"/{path}")(scope, receive, send)
                return
            change = functools.partial(_below, self._prefix)
        compressed = "gzip" in _taken(request.headers.get("accept-encoding", ""))
        ahead = [(b"link", _ahead(self._prefix, asked))] if asked and self._is_known(request) else []
        await self._read(page, written, change, compressed=compressed).send(scope, send, *ahead)

    def _read(self, file: Path, written: int, change: Callable[[bytes], bytes], *, compressed: bool) -> _Kept:
        since, kept = self._kept.get((file, compressed), (None, None))
        if kept is None or since != written:
            body = change(file.read_bytes())
            large = len(body) >= _COMPRESS_FROM
            compressed_now = compressed and large
            content = gzip.compress(body, mtime=0) if compressed_now else body
            kept = _Kept.of(content, file.name, _ASK_EACH_TIME, "gzip" if compressed_now else None, varies=large)
            self._kept[file, compressed] = (written, kept)
        return kept

    def _page_at(self, address: str) -> tuple[Path, tuple[str, ...]]:
        """The HTML of the page at an address, which names all that the page needs, and what the page asks first."""
        table = self._dist / "pages" / "routes.json"
        written = _written(table)
        if written is None:
            return self._dist / "index.html", ()
        since, pages = self._pages
        if since != written:
            found_there = json.loads(table.read_bytes())
            pages = [_Page(re.compile(pattern), file, tuple(asked)) for pattern, file, asked in found_there]
            self._pages = (written, pages)
        for page in pages:
            if found := page.pattern.fullmatch(address):
                names = {name: quote(value or "", safe="") for name, value in found.groupdict().items()}
                return self._dist / "pages" / page.file, tuple(question.format_map(names) for question in page.asked)
        return self._dist / "pages" / "NotFoundPage.html", ()


def mount_pages(app: FastAPI, dist: Path, prefix: str, is_known: Callable[[Request], bool]) -> None:
    """Serve `dist` beside the API; to be called last, since it answers every path that is left.

    Args:
        app: where.
        dist: the built pages.
        prefix: what stands before every path in a browser's address, as /mapless; whoever comes without it is led there.
        is_known: whether somebody may be signed in who asks: only then a page's HTML says what the page will ask the API.
    """
    app.mount("/assets", _Assets(dist / "assets"), name="assets")
    pages = _Pages(dist, prefix, is_known)
    app.router.routes.append(Route("/{path:path}", pages, methods=["GET", "HEAD"], include_in_schema=False))


def _ahead(prefix: str, asked: Iterable[str]) -> bytes:
    """The header that lets a browser ask the API while the page's code still comes."""
    return ", ".join(f"<{prefix}{question}>; rel=preload; as=fetch; crossorigin" for question in asked).encode()


def _below(prefix: str, html: bytes) -> bytes:
    """The HTML of a page whose addresses begin with a prefix; the application reads it there (`web/src/lib/base.ts`)."""
    text = html.decode().replace("<html ", f'<html data-base="{prefix}" ', 1)
    return re.sub(r'((?:href|src|data-entry|data-asks)=")/', rf"\g<1>{prefix}/", text).encode()


def _written(file: Path) -> int | None:
    """When a regular file was written; None where there is none."""
    try:
        return file.stat().st_mtime_ns if file.is_file() else None
    except OSError:
        return None


def _file_within(directory: Path, path: str) -> Path | None:
    """The regular file at `path` below `directory`, links that lead out of it not followed; None if there is none."""
    try:
        file = (directory / path).resolve()
        return file if file.is_relative_to(directory.resolve()) and file.is_file() else None
    except OSError:
        # Longer than any file's name.
        return None
