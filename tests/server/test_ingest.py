"""What workers report, many at once: one transaction for those who wait, one fate for each."""

import asyncio
import threading
from collections.abc import Iterator, Sequence

import pytest
from sqlalchemy import select, text

from server.app import create_services
from server.database import tables
from server.metrics.repository import MetricRepository
from server.services import Services
from server.settings import Settings
from server.worker_api.attempts import FencedError
from server.worker_api.ingest import Ingest, Outcome, Report
from server.worker_api.service import WorkerService
from workers.config import TrainingConfig
from workers.protocol import Batch, EventItem, Final, MetricItem, Orders


@pytest.fixture
def services(settings: Settings, database_url: str) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        session.flush()
        session.add_all(
            tables.Run(id=f"r{i}", experiment_id="e", seed=i, state="running", attempt=1, worker=f"w{i}") for i in range(50)
        )
    yield services
    services.database.dispose()


def report(run: int, *steps: int, attempt: int = 1, final: Final | None = None) -> Report:
    """Items numbered as their steps are."""
    items = tuple(MetricItem(seq=step, step=step, at=1.0, values={"x": float(run)}) for step in steps)
    return Report(f"r{run}", attempt, Batch(items=items, final=final))


def acks(outcomes: Sequence[Outcome]) -> list[int | str]:
    return [outcome.ack if isinstance(outcome, Orders) else type(outcome).__name__ for outcome in outcomes]


def steps_of(services: Services, run: int) -> list[int]:
    with services.database.read() as session:
        series = MetricRepository(session).read(f"r{run}")
    return series["x"].steps.tolist() if series else []


def test_each_report_is_answered_for_itself(services: Services) -> None:
    outcomes = WorkerService(services).receive(
        [report(0, 1, 2), report(1, 1, attempt=7), Report("deleted", 1, Batch()), report(2), report(3, 1, 3)]
    )
    assert acks(outcomes) == [2, "FencedError", "FencedError", 0, 1]
    assert [steps_of(services, run) for run in range(4)] == [[1, 2], [], [], [1]]


def test_two_reports_of_one_run_follow_one_another(services: Services) -> None:
    """A link was opened anew while the last words of the old one still waited."""
    end = Final(outcome="completed")
    outcomes = WorkerService(services).receive([report(0, 1, 2), report(0, 1, 2, 3), report(0, final=end), report(0, 4)])
    assert acks(outcomes) == [2, 3, 3, "FencedError"]
    assert steps_of(services, 0) == [1, 2, 3]


def test_what_the_database_refuses_of_one_run_is_no_other_ones_trouble(services: Services) -> None:
    with services.database.write() as session:
        if services.database.engine.dialect.name == "sqlite":
            refuse = (
                "CREATE TRIGGER t BEFORE INSERT ON metric_rows WHEN NEW.run_id = 'r1' BEGIN SELECT RAISE(ABORT, 'no'); END"
            )
        else:
            refuse = "ALTER TABLE metric_rows ADD CONSTRAINT t CHECK (run_id <> 'r1')"
        session.execute(text(refuse))
    outcomes = WorkerService(services).receive([report(0, 1), report(1, 1), report(2, 1)])
    assert acks(outcomes) == [1, "IntegrityError", 1]
    assert [steps_of(services, run) for run in range(3)] == [[1], [], [1]]
    with services.database.read() as session:
        assert session.scalars(select(tables.Run.last_seq).order_by(tables.Run.seed).limit(3)).all() == [1, 0, 1]


def test_signs_of_life_alone_need_no_writer(services: Services) -> None:
    with services.database.write():
        assert acks(WorkerService(services).receive([report(0), report(1, attempt=2)])) == [0, "FencedError"]


def test_those_who_come_while_one_transaction_is_under_way_share_the_next(services: Services) -> None:
    """And nobody is answered before the commit."""
    service = WorkerService(services)
    groups: list[int] = []
    entered, go_on = threading.Event(), threading.Event()

    def store(reports: Sequence[Report]) -> list[Outcome]:
        groups.append(len(reports))
        entered.set()
        assert go_on.wait(30)
        return service.receive(reports)

    async def everybody() -> list[Orders]:
        ingest = Ingest(store)
        first = asyncio.create_task(ingest.receive(report(0, 1)))
        await asyncio.to_thread(entered.wait)
        others = [asyncio.create_task(ingest.receive(report(run, 1))) for run in range(1, 50)]
        await asyncio.sleep(0.05)
        assert not any(task.done() for task in (first, *others))
        go_on.set()
        return await asyncio.gather(first, *others)

    assert acks(asyncio.run(everybody())) == [1] * 50
    assert groups == [1, 49]


def test_one_that_is_fenced_out_hears_so_and_the_others_their_acknowledgement(services: Services) -> None:
    async def everybody() -> list[Orders | BaseException]:
        ingest = Ingest(WorkerService(services).receive)
        reports = [report(0, 1), report(1, 1, attempt=9), report(2, 1)]
        return await asyncio.gather(*(ingest.receive(each) for each in reports), return_exceptions=True)

    first, second, third = asyncio.run(everybody())
    assert isinstance(first, Orders)
    assert isinstance(second, FencedError)
    assert isinstance(third, Orders)


def test_who_leaves_keeps_nobody_from_his_answer_and_what_he_said_is_stored(services: Services) -> None:
    async def everybody() -> Orders:
        ingest = Ingest(WorkerService(services).receive)
        gone = asyncio.create_task(ingest.receive(report(0, 1)))
        stays = asyncio.create_task(ingest.receive(report(1, 1)))
        await asyncio.sleep(0)
        gone.cancel()
        answer = await stays
        await ingest.close()
        return answer

    assert asyncio.run(everybody()).ack == 1
    assert [steps_of(services, run) for run in (0, 1)] == [[1], [1]]


def test_fifty_runs_report_while_people_write_too_and_nothing_is_lost(services: Services) -> None:
    """Each link waits for its acknowledgement before it goes on, as workers do; five people launch, stop and rename."""
    batches = 10

    def rename(person: int) -> None:
        for i in range(20):
            with services.database.write() as session:
                session.get_one(tables.Experiment, "e").name = f"{person}-{i}"

    async def work(ingest: Ingest, run: int) -> None:
        for step in range(1, batches + 1):
            event = EventItem(seq=2 * step, step=step, at=1.0, level="info", message=f"step {step}")
            metrics = MetricItem(seq=2 * step - 1, step=step, at=1.0, values={f"s{i}": 1.0 for i in range(10)})
            assert (await ingest.receive(Report(f"r{run}", 1, Batch(items=(metrics, event))))).ack == 2 * step

    async def everybody() -> None:
        ingest = Ingest(WorkerService(services).receive)
        await asyncio.gather(
            *(work(ingest, run) for run in range(50)), *(asyncio.to_thread(rename, person) for person in range(5))
        )

    asyncio.run(everybody())
    with services.database.read() as session:
        stored = session.execute(
            select(tables.MetricRow.run_id, tables.MetricRow.step).order_by(tables.MetricRow.run_id, tables.MetricRow.seq)
        ).all()
        said = select(tables.RunEvent.message).where(tables.RunEvent.run_id == "r7").order_by(tables.RunEvent.id)
        messages = session.scalars(said).all()
    assert [tuple(row) for row in stored] == sorted((f"r{run}", step) for run in range(50) for step in range(1, batches + 1))
    assert messages == [f"step {step}" for step in range(1, batches + 1)]
