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
    return needed_by_each(session, [spec])[0]


def needed_by_each(session: Session, specs: Sequence[Mapping[str, Any]]) -> list[tuple[UsedExtension, ...]]:
    """The same of several, in one query."""
    ids = {policy["id"] for spec in specs if (policy := spec.get("policy")) and policy["source"] == "checkpoint"}
    query = (
        select(tables.Checkpoint.id, tables.Experiment.training)
        .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
        .join(tables.Experiment, tables.Experiment.id == tables.Run.experiment_id)
        .where(tables.Checkpoint.id.in_(ids))
    )
    trainings = {row[0]: row[1] for row in session.execute(query)} if ids else {}
    return [_needed(spec, trainings) for spec in specs]


def _needed(spec: Mapping[str, Any], trainings: Mapping[str, Mapping[str, Any]]) -> tuple[UsedExtension, ...]:
    needed: dict[str, UsedExtension] = {}
    policy, suite = spec.get("policy"), spec.get("suite") or {}
    family, dot, _ = str((suite.get("arena") or {}).get("name", "")).partition(".")
    for extension in installed().extensions if dot else ():
        if extension.name == family:
            needed[family] = UsedExtension(name=family, version=extension.version, source=extension.source)
    if policy and policy["source"] == "checkpoint":
        used = _USED.validate_python(trainings.get(policy["id"], {}).get("extensions", ()))
        needed |= {extension.name: extension for extension in used}
    return tuple(needed[name] for name in sorted(needed))


def nobody_for(work: str, lacking: Sequence[UsedExtension]) -> str:
    """Why nobody takes up a job, and what to do; `work` is what one would do."""
    if not lacking:
        return f"No worker is there that {work}: start one with `mapless worker`."
    sources = "; ".join(one.source for one in lacking if one.source)
    how = f" ({sources})" if sources else ""
    return f"This waits for a worker with {wording(lacking)}: install it{how} where one runs, and start that worker anew."
