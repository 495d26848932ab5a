"""The built pages: hashed assets that never change, and for every route of the application the HTML of its page."""

import functools
import json
import re
from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.datastructures import Headers
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from server.errors import NotFoundError
from server.http.prefix import is_at_home

_MISSING = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Mapless</title>
<body style="font: 1rem/1.5 system-ui; max-width: 40rem; margin: 4rem auto; padding: 0 1rem">
<h1>The pages have not been built</h1>
<p>The service is running, but <code>web/dist</code> is not there. Run <code>make pages</code> in the project's directory and
reload this page. The API works meanwhile.</p></body></html>"""

# Vite puts a hash of the content into the names below assets/.
_FOREVER = "public, max-age=31536000, immutable"


# Made by the build beside each asset, the smallest first (`web/plugins/compressed.ts`).
_ENCODINGS = {"br": ".br", "gzip": ".gz"}


class _Assets(StaticFiles):
    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        taken = {part.split(";")[0].strip() for part in Headers(scope=scope).get("accept-encoding", "").split(",")}
        for encoding, ending in _ENCODINGS.items():
            if encoding in taken and self.lookup_path(path + ending)[1]:
                response = await super().get_response(path + ending, scope)
                response.headers["Content-Encoding"] = encoding
                response.headers.add_vary_header("Accept-Encoding")
                break
        response.headers["Cache-Control"] = _FOREVER
        return response


def mount_pages(app: FastAPI, dist: Path, prefix: str = "") -> None:
    """Serve `dist` beside the API; to be called last, since it answers every path that is left.

    Args:
        app: where.
        dist: the built pages.
        prefix: what stands before every path in a browser's address, as /mapless; whoever comes without it is led there.
    """
    app.mount("/assets", _Assets(directory=dist / "assets", check_dir=False), name="assets")

    @app.api_route("/{path:path}", methods=["GET", "HEAD"], include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        if path.startswith(("api/", "live/")):
            raise NotFoundError(f"There is no route {request.url.path}.")
        file = _file_within(dist, path)
        if file is not None:
            return FileResponse(file, headers={"Cache-Control": "no-cache"})
        html = _page_at(dist, f"/{path}")
        if not html.is_file():
            return HTMLResponse(_MISSING, status_code=503)
        if not prefix:
            return FileResponse(html, headers={"Cache-Control": "no-cache"})
        if not is_at_home(request, prefix):
            query = request.url.query
            return RedirectResponse(f"/{path}?{query}" if query else f"/{path}")
        page = _below(prefix, html, html.stat().st_mtime_ns)
        return HTMLResponse(page, headers={"Cache-Control": "no-cache"})


def _page_at(dist: Path, address: str) -> Path:
    """The HTML of the page at an address: it names all that the page needs (`web/plugins/pages.ts`)."""
    try:
        routes: list[tuple[str, str]] = json.loads((dist / "pages" / "routes.json").read_bytes())
    except FileNotFoundError:
        return dist / "index.html"
    found = (file for pattern, file in routes if re.fullmatch(pattern, address))
    return dist / "pages" / next(found, "NotFoundPage.html")


@functools.lru_cache(maxsize=64)
def _below(prefix: str, html: Path, _written: int) -> str:
    """The HTML of a page whose addresses begin with a prefix; the application reads it there (`web/src/lib/base.ts`)."""
    text = html.read_text(encoding="utf-8").replace("<html ", f'<html data-base="{prefix}" ', 1)
    return re.sub(r'((?:href|src|data-entry)=")/', rf"\g<1>{prefix}/", text)


def _file_within(directory: Path, path: str) -> Path | None:
    """The regular file at `path` below `directory`, links that lead out of it not followed; None if there is none."""
    if not path:
        return None
    try:
        file = (directory / path).resolve()
        return file if file.is_relative_to(directory.resolve()) and file.is_file() else None
    except OSError:
        # Longer than any file's name.
        return None
