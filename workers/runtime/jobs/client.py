"""The worker's side of jobs over HTTP."""

import hashlib
from collections.abc import Iterator
from pathlib import Path

import httpx

from workers.errors import ArchiveIntegrityError
from workers.job_protocol import JobClaim, JobClaimRequest, JobEnd, JobKind, JobOrders, JobReport
from workers.play_protocol import PlaySeen
from workers.protocol import found_extensions
from workers.runtime.client import ServerClient, check, read_answer, unavailable

_BLOCK = 256 * 1024


class JobClient(ServerClient):
    """Claims jobs and brings what comes out of them; errors as of `ServerClient`, where a run is a job."""

    def claim_job(
        self, worker: str, kinds: tuple[JobKind, ...], claim_id: str, wait_seconds: float, *, long: bool = True
    ) -> JobClaim | None:
        """Take up the next job, waiting for one, one of minutes only if `long`; None where none came."""
        request = JobClaimRequest(
            worker=worker,
            claim_id=claim_id,
            kinds=kinds,
            long=long,
            extensions=found_extensions(),
            wait_seconds=wait_seconds,
        )
        response = self._send("POST", "/api/worker/jobs/claim", content=request.model_dump_json())
        return None if response.status_code == httpx.codes.NO_CONTENT else read_answer(JobClaim, response)

    def report_job(self, job_id: str, attempt: int, progress: float, revision: int = -1) -> JobOrders:
        """A sign of life; `revision` is that of a playground's orders that the worker has."""
        content = JobReport(progress=progress).model_dump_json()
        return read_answer(JobOrders, self._job("POST", job_id, "report", attempt, content, revision=str(revision)))

    def send_frames(self, job_id: str, attempt: int, frames: bytes, revision: int = -1) -> JobOrders:
        """Moments of a view, each after its length; see `report_job`."""
        return read_answer(JobOrders, self._job("POST", job_id, "frames", attempt, frames, revision=str(revision)))

    def send_seen(self, job_id: str, attempt: int, seen: PlaySeen, revision: int) -> JobOrders:
        """What a playground's worker makes of the moment; see `report_job`."""
        content = seen.model_dump_json()
        return read_answer(JobOrders, self._job("POST", job_id, "seen", attempt, content, revision=str(revision)))

    def fetch_archive(self, job_id: str, attempt: int, sha256: str, path: Path) -> None:
        """The archive of the job's policy.

        Raises:
            ArchiveIntegrityError: what came is not what was stored.
        """
        if self._fetch_file(job_id, "archive", attempt, path) != sha256:
            raise ArchiveIntegrityError("the policy's archive is not what was stored there")

    def fetch_recording(self, job_id: str, attempt: int, number: int, path: Path) -> None:
        """What a film's policy of that number did."""
        self._fetch_file(job_id, f"recordings/{number}", attempt, path)

    def fetch_bag(self, job_id: str, attempt: int, sha256: str, path: Path) -> None:
        """The robot's recording that the job reads.

        Raises:
            ArchiveIntegrityError: what came is not what was stored.
        """
        if self._fetch_file(job_id, "bag", attempt, path) != sha256:
            raise ArchiveIntegrityError("the recording is not what was stored there")

    def _fetch_file(self, job_id: str, what: str, attempt: int, path: Path) -> str:
        """A file; its SHA-256."""
        digest = hashlib.sha256()
        try:
            with self._http.stream("GET", f"/api/worker/jobs/{job_id}/{what}", params={"attempt": attempt}) as response:
                if response.is_error:
                    response.read()
                check(response)
                with path.open("wb") as file:
                    for block in response.iter_bytes(_BLOCK):
                        digest.update(block)
                        file.write(block)
        except httpx.TransportError as error:
            raise unavailable(error) from error
        return digest.hexdigest()

    def bring_result(self, job_id: str, attempt: int, path: Path) -> None:
        """What came out of the job."""
        self._bring(job_id, "result", attempt, path)

    def bring_recording(self, job_id: str, attempt: int, path: Path) -> None:
        """What the robots of an evaluation did, after its result."""
        self._bring(job_id, "recording", attempt, path)

    def _bring(self, job_id: str, what: str, attempt: int, path: Path) -> None:
        with path.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        self._job("PUT", job_id, what, attempt, _blocks(path), sha256=sha256)

    def end_job(self, job_id: str, attempt: int, end: JobEnd) -> None:
        """The last word."""
        self._job("POST", job_id, "end", attempt, end.model_dump_json())

    def _job(
        self, method: str, job_id: str, what: str, attempt: int, content: str | bytes | Iterator[bytes], **params: str
    ) -> httpx.Response:
        return self._send(
            method, f"/api/worker/jobs/{job_id}/{what}", params={"attempt": attempt, **params}, content=content
        )


def _blocks(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            yield block
