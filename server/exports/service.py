"""Deployment bundles: made by a worker, for exporting compares with torch, which the server never imports."""

from pathlib import Path

from server.errors import ExportFailedError, JobFailedError
from server.jobs.asked import Asked
from server.jobs.waiting import result_of
from server.replays.simulator import simulator
from server.services import Services
from workers.job_protocol import ArchivedPolicy, ExportJob


async def bundle_of(services: Services, policy: ArchivedPolicy, sha256: str, title: str) -> Path:
    """A policy's deployment bundle; made now if it is not kept.

    Args:
        services: of the server.
        policy: which.
        sha256: of its archive.
        title: for people.

    Raises:
        ExportFailedError: the archive can't be exported, or the export does not equal the trained policy.
        JobTimeoutError: it took too long.
        NoWorkerError: nobody is there to do it.
        BusyError: as much waits as may.
    """
    asked = Asked(ExportJob(policy=policy), f"{sha256[:32]}-bundle-{simulator()}", title, sha256)
    try:
        return await result_of(services, asked)
    except JobFailedError as error:
        raise ExportFailedError(f"The policy was not exported: {error.message}") from error
