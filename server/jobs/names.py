"""Under which names the results of jobs are kept."""

from workers.job_protocol import JobKind

_SUFFIXES: dict[JobKind, str] = {"replay": ".npz", "bag": ".json", "export": ".zip"}


def result_name(kind: JobKind, key: str) -> str:
    """The file of what comes out of a job of this kind and key."""
    return f"{key}{_SUFFIXES.get(kind, '')}"


def recordings_prefix(identity: str) -> str:
    """How the names of all recordings of a policy begin: `identity` is its archive's SHA-256, or a baseline's."""
    return f"{identity[:32]}-"
