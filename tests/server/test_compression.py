"""Answers on their way out: packed as whoever asks can read, once, and as they are sent."""

import asyncio
import gzip
from collections.abc import AsyncIterator

import httpx
import pytest
import zstandard
from fastapi import FastAPI
from fastapi.responses import Response, StreamingResponse

from server.http.compression import CompressionMiddleware, reads_zstd

TEXT = b'{"steps": [1, 2, 3]}' * 20_000
BROWSER = "gzip, deflate, br, zstd"


@pytest.mark.parametrize(
    ("accepted", "reads"),
    [
        (BROWSER, True),
        ("ZSTD", True),
        ("gzip;q=0.5, zstd;q=0.1", True),
        ("zstd; q=1.0", True),
        ("gzip, zstd;q=0", False),
        ("zstd;q=0.000", False),
        ("gzip, deflate, br", False),
        ("x-zstd", False),
        ("", False),
    ],
)
def test_who_reads_zstandard(accepted: str, reads: bool) -> None:
    assert reads_zstd(accepted) == reads


def made() -> FastAPI:
    app = FastAPI()

    @app.get("/large")
    async def large() -> Response:
        return Response(TEXT, media_type="application/json")

    @app.get("/small")
    async def small() -> Response:
        return Response(b"small", media_type="text/plain")

    @app.get("/packed")
    async def packed() -> Response:
        return Response(gzip.compress(TEXT), headers={"Content-Encoding": "gzip"}, media_type="text/javascript")

    @app.get("/zip")
    async def archive() -> Response:
        return Response(TEXT, media_type="application/zip")

    @app.get("/stream")
    async def stream() -> StreamingResponse:
        async def parts() -> AsyncIterator[bytes]:
            for number in range(3):
                yield b"%d," % number * 1_000

        return StreamingResponse(parts(), media_type="text/csv")

    app.add_middleware(CompressionMiddleware)
    return app


async def raw(path: str, accepted: str) -> tuple[httpx.Headers, list[bytes]]:
    """The headers, and the parts of the body as they came."""
    parts: list[bytes] = []
    headers: list[tuple[bytes, bytes]] = []

    asked = [{"type": "http.request", "body": b"", "more_body": False}]

    async def receive() -> dict[str, object]:
        if not asked:
            await asyncio.Event().wait()  # nobody hangs up
        return asked.pop()

    async def send(message: dict[str, object]) -> None:
        headers.extend(message.get("headers", []))  # type: ignore[arg-type]
        parts.append(message.get("body", b""))  # type: ignore[arg-type]

    scope = {"type": "http", "method": "GET", "path": path, "query_string": b"", "root_path": ""}
    await made()({**scope, "headers": [(b"accept-encoding", accepted.encode())]}, receive, send)  # type: ignore[arg-type]
    return httpx.Headers(headers), [part for part in parts if part]


def ask(path: str, accepted: str = BROWSER) -> tuple[httpx.Headers, list[bytes]]:
    return asyncio.run(raw(path, accepted))


def test_a_large_answer_is_packed_as_the_asker_reads_it() -> None:
    headers, (body,) = ask("/large")
    assert (headers["content-encoding"], headers["vary"]) == ("zstd", "Accept-Encoding")
    assert int(headers["content-length"]) == len(body) < len(TEXT) / 10
    assert zstandard.ZstdDecompressor().decompressobj().decompress(body) == TEXT
    headers, (body,) = ask("/large", "gzip")
    assert (headers["content-encoding"], gzip.decompress(body)) == ("gzip", TEXT)
    headers, (body,) = ask("/large", "identity")
    assert ("content-encoding" in headers, body) == (False, TEXT)


@pytest.mark.parametrize("path", ["/small", "/zip"])
def test_what_would_not_shrink_goes_as_it_is(path: str) -> None:
    headers, (body,) = ask(path)
    assert "content-encoding" not in headers
    assert body in (b"small", TEXT)


def test_what_is_packed_already_is_not_packed_again() -> None:
    headers, (body,) = ask("/packed")
    assert (headers["content-encoding"], gzip.decompress(body)) == ("gzip", TEXT)


def test_what_is_streamed_can_be_read_as_it_is_sent() -> None:
    headers, parts = ask("/stream")
    assert headers["content-encoding"] == "zstd"
    reader, seen = zstandard.ZstdDecompressor().decompressobj(), b""
    for number, part in enumerate(parts[:3]):
        seen += reader.decompress(part)
        assert seen.endswith(b"%d," % number * 1_000)
    assert seen == b"0," * 1_000 + b"1," * 1_000 + b"2," * 1_000
