"""Signs of life of a job while its place can give none: as its process starts, its policy comes, its result goes."""

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from workers.errors import RunRefusedError, ServerError
from workers.job_protocol import JobClaim
from workers.runtime.jobs.client import JobClient

logger = logging.getLogger(__name__)

REPORT_SECONDS = 1.0
"""Between two signs of life of a job."""
MOST_SECONDS = 120.0
"""Who needs longer to begin, or to bring what came out, is taken for stuck: the lease runs out."""


@contextmanager
def pulse(client: JobClient, claim: JobClaim, progress: float) -> Iterator[None]:
    """Report for as long as the block lasts, `MOST_SECONDS` at most.

    Args:
        client: to the server.
        claim: of the job.
        progress: share of the work that is done, 0 to 1.

    Raises:
        RunRefusedError: at the block's end: nobody wants the job any more, or somebody else has it.
    """
    over = threading.Event()
    refusals: list[RunRefusedError] = []

    def report() -> None:
        end = time.monotonic() + MOST_SECONDS
        while not over.wait(REPORT_SECONDS) and time.monotonic() < end:
            try:
                client.report_job(claim.id, claim.attempt, progress)
            except RunRefusedError as refusal:
                refusals.append(refusal)
                return
            except ServerError as error:
                # It may be back before the lease is over.
                logger.warning("job %s: %s", claim.id, error)

    thread = threading.Thread(target=report, name=f"pulse of {claim.id}", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
    if refusals:
        raise refusals[0]
