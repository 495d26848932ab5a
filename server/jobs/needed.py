"""Which extensions whoever does a job must have: those of its policy's training, and that of its suite's arenas."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import select
from sqlalchemy.orm import Session

from server.database import tables
from sim.extending.discovery import UsedExtension, installed, wording

_USED: TypeAdapter[tuple[UsedExtension, ...]] = TypeAdapter(tuple[UsedExtension, ...])


def needed_by(session: Session, spec: Mapping[str, Any]) -> tuple[UsedExtension, ...]:
    """The extensions, as the training was launched with; of an arena as the service has them.

    Args:
        session: to look the policy up with.
        spec: `workers.job_protocol.JobSpec` as it was stored, whether this version can read it or not.
    """
    needed: dict[str, UsedExtension] = {}
    policy, suite = spec["policy"], spec.get("suite") or {}
    family, dot, _ = str((suite.get("arena") or {}).get("name", "")).partition(".")
    for extension in installed().extensions if dot else ():
        if extension.name == family:
            needed[family] = UsedExtension(name=family, version=extension.version, source=extension.source)
    if policy["source"] == "checkpoint":
        training = session.scalar(
            select(tables.Experiment.training)
            .join(tables.Run, tables.Run.experiment_id == tables.Experiment.id)
            .join(tables.Checkpoint, tables.Checkpoint.run_id == tables.Run.id)
            .where(tables.Checkpoint.id == policy["id"])
        )
        used = _USED.validate_python((training or {}).get("extensions", ()))
        needed |= {extension.name: extension for extension in used}
    return tuple(needed[name] for name in sorted(needed))


def nobody_for(work: str, lacking: Sequence[UsedExtension]) -> str:
    """Why nobody takes up a job, and what to do; `work` is what one would do."""
    if not lacking:
        return f"No worker is there that {work}: start one with `mapless worker`."
    sources = "; ".join(one.source for one in lacking if one.source)
    how = f" ({sources})" if sources else ""
    return f"This waits for a worker with {wording(lacking)}: install it{how} where one runs, and start that worker anew."
