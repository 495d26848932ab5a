"""Who else drove the same scenarios: policies that may be shown beside one another."""

from collections.abc import Collection

from sqlalchemy import select
from sqlalchemy.orm import Session, defer

from server.checkpoints.views import policy_title
from server.database import tables
from server.evaluations.schemas import EvaluationFigures
from server.leaderboards.repository import LeaderboardRepository
from server.replays.references import Reference
from server.replays.schemas import Beside
from server.runs.repository import RunRepository
from workers.shipped.library import shipped_policies

MOST_OF_A_RUN = 50
"""Checkpoints of the same run that are offered, the newest first."""
MOST = 100
"""Of each other kind."""


def beside(session: Session, suite_hash: str, visible: Collection[str] | None, shown: Collection[Reference]) -> list[Beside]:
    """Everybody who was measured on a suite and may be seen, but those who are shown already.

    Args:
        session: of the database.
        suite_hash: of the suite.
        visible: projects that may be seen; None for all.
        shown: in the replay.
    """
    found = _of_the_same_runs(session, suite_hash, shown)
    for policy in shipped_policies():
        for result in policy.card.results:
            if result.suite_hash == suite_hash:
                of = Reference("policy", policy.card.name, result.suite)
                found.append((of, policy.card.title, result.figures.arrivals / result.figures.episodes))
    for row in LeaderboardRepository(session, visible).evaluations(suite_hash)[:MOST]:
        success = EvaluationFigures.model_validate(row.figures).success.value
        found.append((Reference("evaluation", row.id), row.title, success))
    return [Beside(of=str(of), title=title, success=success) for of, title, success in found if of not in shown]


def _of_the_same_runs(session: Session, suite_hash: str, shown: Collection[Reference]) -> list[tuple[Reference, str, float]]:
    checkpoint, evaluation = tables.Checkpoint, tables.Evaluation
    runs = select(checkpoint.run_id).where(checkpoint.id.in_([each.id for each in shown if each.kind == "checkpoint"]))
    query = (
        select(checkpoint, evaluation)
        .join(evaluation, evaluation.checkpoint_id == checkpoint.id)
        .where(checkpoint.run_id.in_(runs), evaluation.suite_hash == suite_hash, checkpoint.damaged_at.is_(None))
        .options(defer(evaluation.episodes))
        .order_by(checkpoint.step.desc())
        .limit(MOST_OF_A_RUN)
    )
    rows = session.execute(query).all()
    named = RunRepository(session).several({row[0].run_id for row in rows}, with_experiments=True)
    return [
        (Reference("checkpoint", made.id), policy_title(named[made.run_id], made), result.arrivals / result.episode_count)
        for made, result in rows
    ]
