"""What is asked for, before it is a job."""

from dataclasses import dataclass

from workers.job_protocol import JobSpec


@dataclass(frozen=True)
class Asked:
    """Something to be done.

    Attributes:
        spec: what.
        key: what comes out of it; asked for twice, it is one job.
        title: for people.
        sha256: of the policy's archive, where there is one.
        ahead: whether nobody waits for it yet: it goes behind everything else, and makes way for it.
    """

    spec: JobSpec
    key: str
    title: str
    sha256: str | None = None
    ahead: bool = False
