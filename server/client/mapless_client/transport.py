"""Requests to the server: with the token, patient where it is busy, and with its refusals as errors."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import httpx

from mapless_client.errors import BY_STATUS, RefusedError, UnreachableError

Query: TypeAlias = Mapping[str, str | int | float | Sequence[str] | None]

# Answers after which the same request may be sent again: too many at once, or a server that restarts behind a proxy.
_LATER = frozenset({429, 502, 503, 504})
_TRIES = 6
_LONGEST_PAUSE = 30.0
# Of bodies: a bundle is made while the request waits.
_TIMEOUT = httpx.Timeout(30.0, read=180.0)
# The server writes what arrives, and takes no more meanwhile.
_UPLOAD = httpx.Timeout(30.0, read=600.0, write=600.0)
_BLOCK = 256 * 1024


def pause(failures: int) -> float:
    """Seconds to wait after so many failures in a row: twice as long each time, and never all clients at once."""
    return min(_LONGEST_PAUSE, 0.5 * 2.0 ** (failures - 1)) * random.uniform(0.8, 1.2)  # noqa: S311 (no secret)


class Transport:
    """One server.

    Args:
        url: of the server.
        token: that opens it; none where it asks for none.
        http: the client to use instead of one of its own, whose address and headers are as they are.
        tries: how often a request that changes nothing is sent before the server counts as unreachable.
    """

    def __init__(self, url: str, token: str | None, http: httpx.Client | None = None, tries: int = _TRIES) -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._http = http or httpx.Client(base_url=url, headers=headers, timeout=_TIMEOUT)
        self._url = url
        self._tries = tries

    def close(self) -> None:
        """Close its connections."""
        self._http.close()

    def get(self, path: str, query: Query | None = None) -> Any:
        """The JSON at a path; asked for again while the server is away or busy.

        Raises:
            RefusedError: one of its kinds.
            UnreachableError: the server was away for too long.
        """
        with self.stream(path, query) as response:
            response.read()
            return response.json()

    def text(self, path: str, query: Query | None = None) -> str:
        """The text at a path; asked for again while the server is away or busy.

        Raises:
            As `get`.
        """
        with self.stream(path, query) as response:
            response.read()
            return response.text

    def send(self, method: str, path: str, body: Any = None, query: Query | None = None) -> Any:
        """Change something, once; the answer's JSON, None where there is none.

        Raises:
            RefusedError: one of its kinds.
            UnreachableError: the server did not answer: whether it has done it is not known.
        """
        try:
            response = self._http.request(method, path, json=body, params=_params(query))
        except httpx.TransportError as error:
            raise UnreachableError(f"{self._url} does not answer: {error}") from error
        _check(response)
        return response.json() if response.content else None

    def upload(self, path: str, file: Path, content_type: str, query: Query | None = None) -> Any:
        """Send a file, read bit by bit; the answer's JSON.

        Raises:
            RefusedError: one of its kinds.
            UnreachableError: the server did not answer: what it has taken is not known.
        """
        headers = {"Content-Type": content_type, "Content-Length": str(file.stat().st_size)}
        try:
            with file.open("rb") as content:
                blocks = iter(lambda: content.read(_BLOCK), b"")
                response = self._http.post(path, params=_params(query), content=blocks, headers=headers, timeout=_UPLOAD)
        except httpx.TransportError as error:
            raise UnreachableError(f"{self._url} does not answer: {error}") from error
        _check(response)
        return response.json()

    @contextmanager
    def stream(
        self, path: str, query: Query | None = None, headers: dict[str, str] | None = None, read_seconds: float | None = None
    ) -> Iterator[httpx.Response]:
        """An answer that is read bit by bit; asked for again while the server is away or busy.

        Raises:
            RefusedError: one of its kinds.
            UnreachableError: the server was away for too long, or broke off while it was read.
        """
        for failures in range(1, self._tries + 1):
            request = self._http.build_request("GET", path, params=_params(query), headers=headers)
            if read_seconds is not None:
                request.extensions["timeout"] = {**request.extensions["timeout"], "read": read_seconds}
            try:
                response = self._http.send(request, stream=True)
            except httpx.TransportError as error:
                if failures == self._tries:
                    raise UnreachableError(f"{self._url} does not answer: {error}") from error
                time.sleep(pause(failures))
                continue
            try:
                if response.status_code in _LATER and failures < self._tries:
                    time.sleep(_announced(response) or pause(failures))
                    continue
                if response.is_error:
                    response.read()
                    _check(response)
                yield response
            except httpx.TransportError as error:
                raise UnreachableError(f"{self._url} broke off: {error}") from error
            finally:
                response.close()
            return


def _params(query: Query | None) -> dict[str, Any]:
    return {name: value for name, value in (query or {}).items() if value is not None}


def _announced(response: httpx.Response) -> float | None:
    text = response.headers.get("Retry-After", "")
    return min(float(text), _LONGEST_PAUSE) if text.isdecimal() else None


def _check(response: httpx.Response) -> None:
    if response.is_success:
        return
    raise BY_STATUS.get(response.status_code, RefusedError)(response.status_code, _sentence(response))


def _sentence(response: httpx.Response) -> str:
    """What a refusal says: the server's sentence, or its fields with what is wrong with each."""
    try:
        detail = response.json()["detail"]
    except (ValueError, KeyError, TypeError):
        return f"{response.status_code} {response.reason_phrase}: is this the address of a Mapless server?"
    if isinstance(detail, str):
        return detail
    return "; ".join(f"{'.'.join(str(part) for part in each['loc'][1:])}: {each['msg']}" for each in detail)
