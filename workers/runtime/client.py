"""The worker's side of the server's worker API over HTTP: claim, heartbeat, checkpoints down and up."""

import hashlib
import ssl
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

import httpx
from pydantic import BaseModel, ValidationError

from workers.errors import (
    ArchiveIntegrityError,
    CheckpointGoneError,
    RequestRefusedError,
    RunRefusedError,
    ServerUnavailableError,
)
from workers.protocol import (
    CheckpointReference,
    CheckpointUpload,
    Claim,
    ClaimRequest,
    Heartbeat,
    HeartbeatAnswer,
    LogBatch,
    Machine,
    Queue,
    found_extensions,
)
from workers.reporting import EvaluationResult
from workers.wording import counted

_Answer = TypeVar("_Answer", bound=BaseModel)

_BLOCK = 256 * 1024
# Connecting is quick or hopeless; an answer may wait for a busy database.
_TIMEOUT = httpx.Timeout(30.0, connect=5.0)


class ServerClient:
    """One connection pool to the server, with the workers' token. Thread-safe.

    Every method raises, unless it says otherwise:
        ServerUnavailableError: not reached, or the server cannot answer now.
        RunRefusedError: the run is not (or no longer) this worker's.
        RequestRefusedError: the server would refuse the same request again.
    """

    def __init__(self, server_url: str, token: str) -> None:
        # The system's certificates or SSL_CERT_FILE's, as for the link's WebSocket: a lab may have its own authority.
        self._http = httpx.Client(
            base_url=server_url,
            headers={"Authorization": f"Bearer {token}"},
            timeout=_TIMEOUT,
            trust_env=False,
            verify=ssl.create_default_context(),
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def heartbeat(
        self,
        worker: str,
        queue: Queue,
        trouble: str | None = None,
        *,
        first: bool = False,
        machine: Machine | None = None,
    ) -> HeartbeatAnswer:
        """Tell that this worker is there, on what, and why it takes up no run where it does not."""
        beat = Heartbeat(
            worker=worker, queue=queue, trouble=trouble, first=first, extensions=found_extensions(), machine=machine
        )
        response = self._send("POST", "/api/worker/heartbeat", content=beat.model_dump_json())
        return read_answer(HeartbeatAnswer, response)

    def claim(self, run_id: str, worker: str, published_attempt: int, claim_id: str, queue: Queue = "cpu") -> Claim:
        """Take up this run, or one that comes before it; asked again with the same `claim_id`, it is the same attempt."""
        request = ClaimRequest(
            worker=worker,
            published_attempt=published_attempt,
            claim_id=claim_id,
            any_run=True,
            queue=queue,
            extensions=found_extensions(),
        )
        response = self._send("POST", f"/api/worker/runs/{run_id}/claim", content=request.model_dump_json())
        return read_answer(Claim, response)

    def download(self, checkpoint: CheckpointReference, path: Path) -> None:
        """Fetch an archive to `path`; refuses what is not what the server registered.

        Raises:
            ArchiveIntegrityError: the bytes are others than those that were registered.
            CheckpointGoneError: it is gone.
            ServerUnavailableError: not now; ask again later.
            RequestRefusedError: never.
        """
        what = f"the checkpoint of step {counted(checkpoint.step)}"
        self._fetch(f"/api/worker/checkpoints/{checkpoint.id}", checkpoint.sha256, path, what)

    def fetch_start(self, run_id: str, sha256: str, path: Path) -> None:
        """Fetch the archive whose policy a run begins with; raises as `download` does."""
        self._fetch(f"/api/worker/runs/{run_id}/start", sha256, path, "the policy to start from")

    def _fetch(self, url: str, sha256: str, path: Path, what: str) -> None:
        digest = hashlib.sha256()
        try:
            with self._http.stream("GET", url) as response, path.open("wb") as file:
                if response.is_error:
                    response.read()
                check(response)
                for block in response.iter_bytes(_BLOCK):
                    digest.update(block)
                    file.write(block)
        except httpx.TransportError as error:
            raise unavailable(error) from error
        except RunRefusedError as error:
            raise CheckpointGoneError(f"{what} is gone: {error}") from error
        if digest.hexdigest() != sha256:
            raise ArchiveIntegrityError(f"{what} is not what was stored there")

    def upload(
        self, run_id: str, attempt: int, step: int, archive: Path, after_seq: int, evaluation: EvaluationResult | None
    ) -> None:
        """Bring an archive; the server registers it once it is complete and has item `after_seq`."""
        with archive.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        head = CheckpointUpload(after_seq=after_seq, sha256=sha256, evaluation=evaluation)
        self._send(
            "PUT",
            f"/api/worker/runs/{run_id}/checkpoints/{step}",
            params={"attempt": attempt},
            content=_upload_body(head, archive),
        )

    def log(self, run_id: str, attempt: int, batch: LogBatch) -> None:
        """Bring what the trainer has printed."""
        body = batch.model_dump_json()
        self._send("POST", f"/api/worker/runs/{run_id}/log", params={"attempt": attempt}, content=body)

    def _send(
        self,
        method: str,
        url: str,
        *,
        content: str | bytes | Iterator[bytes],
        params: Mapping[str, int | str] | None = None,
    ) -> httpx.Response:
        try:
            response = self._http.request(
                method, url, params=dict(params or {}), content=content, headers={"Content-Type": "application/json"}
            )
        except httpx.TransportError as error:
            raise unavailable(error) from error
        check(response)
        return response


def read_answer(model: type[_Answer], response: httpx.Response) -> _Answer:
    """An answer as the server writes it; whatever else answers in its place may be gone the next time."""
    try:
        return model.model_validate_json(response.content)
    except ValidationError as error:
        raise ServerUnavailableError(
            f"what answers is not understood ({response.text[:80]!r}): is something between worker and server, or are "
            "they of different versions?"
        ) from error


def _upload_body(head: CheckpointUpload, archive: Path) -> Iterator[bytes]:
    yield head.model_dump_json().encode() + b"\n"
    with archive.open("rb") as file:
        while block := file.read(_BLOCK):
            yield block


def unavailable(error: httpx.TransportError) -> ServerUnavailableError:
    """What is told where a request did not get through."""
    return ServerUnavailableError(f"the server does not answer ({type(error).__name__}: {error})")


def check(response: httpx.Response) -> None:
    """Raise what an answer that is an error means; see `ServerClient`."""
    if response.is_success:
        return
    detail = f"{response.status_code} {response.text[:500]}"
    if response.status_code in (404, 409, 410):
        raise RunRefusedError(detail)
    if response.status_code >= 500 or response.status_code in (408, 425, 429):
        raise ServerUnavailableError(f"the server cannot answer now: {detail}")
    if response.status_code in (401, 403):
        raise RequestRefusedError(f"{detail}: is MAPLESS_WORKER_TOKEN the server's?")
    raise RequestRefusedError(detail)
