"""The job that reads a robot's recording, and holds a policy beside it where one was asked for."""

import resource
from collections.abc import Callable
from pathlib import Path

from workers.bags.beside import beside, robots_policy
from workers.bags.read import read_bag
from workers.bags.reading import tell
from workers.bags.results import BagBeside, BagReading
from workers.errors import BagError
from workers.job_protocol import BagJob

_MEMORY_BYTES = 6 * 2**30
"""That this process may have of its own, with all that it has imported."""


def read_recording(
    job: BagJob, path: Path, archive: Path, scratch: Path, progress: Callable[[float], None]
) -> BagReading | BagBeside:
    """Do the job.

    Args:
        job: what is asked for.
        path: of the recording.
        archive: of the policy, where there is one.
        scratch: a folder of its own.
        progress: told the share that is done, 0 to 1.

    Raises:
        BagError: the recording can't be used.
        ArchiveError: the policy's archive is not one that this release reads.
        ForeignPolicyError: an uploaded one can't be run.
    """
    # Whatever a file announces, it takes no more than this of the machine.
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_BYTES, hard))
    try:
        if job.policy is None:
            return tell(path, job.topics, scratch)
        bag = read_bag(path, job.topics, scratch)
        return beside(bag, robots_policy(archive, job.policy), job.title, progress)
    except MemoryError as error:
        raise BagError("the recording takes too much memory: upload a part of it") from error
