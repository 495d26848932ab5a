"""Rows of metrics are compacted beside what workers report, one run after another, and nothing is lost."""

import asyncio
import logging

import pytest
from sqlalchemy import event, func, select, update

from benchmarks.service import wait_for
from server.database import tables
from server.metrics.compaction import keep_compacted, rest
from server.metrics.repository import COMPACT_AFTER, MetricRepository
from server.services import Services
from server.worker_api.ingest import Report
from server.worker_api.service import WorkerService
from workers.protocol import MAX_BATCH_ITEMS, Batch, MetricItem

ITEMS = COMPACT_AFTER + 20


def launched(services: Services, runs: int) -> list[str]:
    """Runs of one experiment, each claimed; no server compacts beside them yet."""
    run_ids = [f"r{seed}" for seed in range(runs)]
    with services.database.write() as session:
        experiment = tables.Experiment(id="e", name="together", training={})
        experiment.runs = [tables.Run(id=f"r{seed}", seed=seed, state="running", attempt=1) for seed in range(runs)]
        session.add(experiment)
    return run_ids


def report(services: Services, run_ids: list[str], first: int, last: int) -> None:
    """All runs at once, as they do that were launched together."""
    for start in range(first, last + 1, MAX_BATCH_ITEMS):
        seqs = range(start, min(start + MAX_BATCH_ITEMS, last + 1))
        items = tuple(MetricItem(seq=seq, step=10 * seq, at=0.0, values={"a": seq / 2, "b": 1.0}) for seq in seqs)
        WorkerService(services).receive([Report(run_id, 1, Batch(items=items)) for run_id in run_ids])


def waiting(services: Services) -> dict[str, int]:
    """How many rows of each run wait."""
    row = tables.MetricRow
    with services.database.read() as session:
        counted = session.execute(select(row.run_id, func.count()).group_by(row.run_id))
        return {run_id: count for run_id, count in counted}  # noqa: C416 (a result has keys of its own)


async def compacted(services: Services) -> None:
    """Until nothing is due."""
    async with keep_compacted(services):
        await asyncio.to_thread(
            wait_for, lambda: all(count < COMPACT_AFTER for count in waiting(services).values()), seconds=20.0
        )


def test_runs_that_grew_together_keep_no_report_waiting(services: Services) -> None:
    run_ids = launched(services, 5)
    chunks: list[str] = []

    @event.listens_for(services.database.engine, "before_cursor_execute")
    def _(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        if "INSERT INTO metric_chunks" in statement:
            chunks.append(statement)

    report(services, run_ids, 1, ITEMS)
    assert chunks == []
    assert waiting(services) == dict.fromkeys(run_ids, ITEMS)
    asyncio.run(compacted(services))
    assert len(chunks) >= len(run_ids)
    with services.database.read() as session:
        for series in MetricRepository(session).read_many(run_ids).values():
            assert series["a"].values.tolist() == [seq / 2 for seq in range(1, ITEMS + 1)]


def test_what_is_reported_meanwhile_is_not_swept_away(services: Services) -> None:
    run_ids = launched(services, 2)

    async def scenario() -> None:
        compacting = asyncio.create_task(compacted(services))
        for seq in range(ITEMS + 1, ITEMS + 201):
            await asyncio.to_thread(report, services, run_ids, seq, seq)
        await compacting

    report(services, run_ids, 1, ITEMS)
    asyncio.run(scenario())
    with services.database.read() as session:
        for series in MetricRepository(session).read_many(run_ids).values():
            assert series["a"].steps.tolist() == [10 * seq for seq in range(1, ITEMS + 201)]


def test_a_run_that_cannot_be_compacted_keeps_no_other_one_waiting(
    services: Services, caplog: pytest.LogCaptureFixture
) -> None:
    broken, whole = launched(services, 2)
    report(services, [broken], 1, ITEMS)
    with services.database.write() as session:
        # What no series can be made of.
        session.execute(update(tables.MetricRow).values(values={"a": "?"}))
    report(services, [whole], 1, ITEMS)

    async def scenario() -> None:
        async with keep_compacted(services):
            await asyncio.to_thread(wait_for, lambda: whole not in waiting(services), seconds=20.0)

    with caplog.at_level(logging.ERROR):
        asyncio.run(scenario())
    assert waiting(services) == {broken: ITEMS}
    assert f"the points of run {broken} could not be compacted" in caplog.text


def test_few_that_wait_leave_pages_the_core_and_many_are_worked_off() -> None:
    assert 1.0 / (1.0 + rest(100)) < 0.08
    assert 1.0 / (1.0 + rest(1_000)) == 0.25
