"""What a person may do with robots' recordings: keep one, have it read, hold a policy beside it, delete it."""

import hashlib
from collections.abc import AsyncIterator

from server.audit.repository import AuditRepository
from server.bags.repository import BagRepository
from server.bags.schemas import MAX_BAG_BYTES, Bag, BagPage
from server.database import tables
from server.errors import ConflictError, InvalidRequestError, JobFailedError, TooLargeError, UnusableBagError
from server.evaluations.subjects import wanted_policies
from server.http.paging import Window
from server.ids import new_id
from server.jobs.asked import Asked
from server.jobs.waiting import result_of
from server.projects.repository import ProjectRepository
from server.replays.simulator import simulator
from server.security.principal import Principal
from server.services import Services
from workers.bags.results import BagBeside, BagReading, TopicChoice
from workers.job_protocol import BagJob, PlayedPolicy

MAX_BAGS = 100
"""Recordings that are kept."""


async def arrived(blocks: AsyncIterator[bytes]) -> bytes:
    """A recording's file, as it comes in.

    Raises:
        TooLargeError: it is too large.
        InvalidRequestError: it is empty.
    """
    content = bytearray()
    async for block in blocks:
        content += block
        if len(content) > MAX_BAG_BYTES:
            raise TooLargeError(
                f"The recording is larger than {MAX_BAG_BYTES // 2**20} MiB: record only what is needed "
                "(ros2 bag record /scan /odom /cmd_vel /goal_pose /tf /tf_static), or compress it."
            )
    if not content:
        raise InvalidRequestError("The file is empty: choose the recording again.")
    return bytes(content)


def keep(services: Services, name: str, project_id: str, content: bytes, principal: Principal) -> Bag:
    """Keep a recording; whether it can be read is found out by the worker that reads it.

    Raises:
        ConflictError: there are too many already.
        ForbiddenError: the project is not one's own to change.
        NotFoundError: there is no such project.
    """
    principal.require("editor", project_id)
    row = tables.Bag(
        id=new_id(),
        project_id=project_id,
        name=name,
        sha256=hashlib.sha256(content).hexdigest(),
        size=len(content),
        content=content,
    )
    with services.database.write() as session:
        ProjectRepository(session).get(project_id)
        repository = BagRepository(session)
        if repository.count() >= MAX_BAGS:
            raise ConflictError(f"There are {MAX_BAGS} recordings already: delete some first.")
        repository.add(row)
        AuditRepository(session).add("recording.uploaded", target=row.id, name=row.name)
        session.flush()
        return _view(row)


def some(services: Services, window: Window, principal: Principal) -> BagPage:
    """Some of them, the newest first."""
    with services.database.read() as session:
        rows, total = BagRepository(session).page(window, principal.visible)
        return BagPage(items=[_view(row) for row in rows], total=total)


def one(services: Services, bag_id: str) -> Bag:
    """One of them.

    Raises:
        NotFoundError: there is none.
    """
    with services.database.read() as session:
        return _view(BagRepository(session).get(bag_id))


def delete(services: Services, bag_id: str) -> None:
    """Forget a recording.

    Raises:
        NotFoundError: there is none.
    """
    with services.database.write() as session:
        repository = BagRepository(session)
        AuditRepository(session).add("recording.deleted", target=bag_id, name=repository.get(bag_id).name)
        repository.delete(bag_id)


async def reading_of(services: Services, bag_id: str, topics: TopicChoice) -> BagReading:
    """What a recording tells; read now if that is not kept.

    Raises:
        NotFoundError: there is none.
        UnusableBagError: it can't be read.
        JobTimeoutError: it took too long.
        NoWorkerError: nobody is there to do it.
        BusyError: as much waits as may.
    """
    lane = services.lanes.jobs
    bag = await lane.run(one, services, bag_id)
    job = BagJob(bag=bag.id, bag_sha256=bag.sha256, topics=topics)
    data = await _done(services, Asked(job, _key(job, ""), f"{bag.name}: read"))
    return await lane.run(BagReading.model_validate_json, data)


async def beside(
    services: Services, bag_id: str, topics: TopicChoice, policy: PlayedPolicy, principal: Principal
) -> BagBeside:
    """What a policy would have done in a recording; worked out now if that is not kept.

    Raises:
        NotFoundError: there is no such recording or policy, or it may not be seen.
        ServiceError: see `reading_of` for more.
    """
    lane = services.lanes.jobs
    bag = await lane.run(one, services, bag_id)

    def find() -> Asked:
        with services.database.read() as session:
            ((whole, subject),) = wanted_policies(session, [policy], principal)
        job = BagJob(bag=bag.id, bag_sha256=bag.sha256, topics=topics, policy=whole, title=subject.title)
        return Asked(job, _key(job, subject.sha256 or ""), f"{bag.name}: {subject.title}", subject.sha256)

    data = await _done(services, await lane.run(find))
    return await lane.run(BagBeside.model_validate_json, data)


def _key(job: BagJob, policy_sha256: str) -> str:
    """What comes out depends on the file, on what is read of it and how, and on the policy and what it is called."""
    told = f"{job.topics.model_dump_json()}\n{policy_sha256}\n{job.policy}\n{job.title}"
    return f"{job.bag_sha256[:32]}-bag-{hashlib.sha256(told.encode()).hexdigest()[:32]}-{simulator()}"


async def _done(services: Services, asked: Asked) -> bytes:
    try:
        path = await result_of(services, asked)
    except JobFailedError as error:
        raise UnusableBagError(f"{error.message[:1].upper()}{error.message[1:]}.") from error
    return await services.lanes.jobs.run(path.read_bytes)


def _view(row: tables.Bag) -> Bag:
    return Bag(
        id=row.id,
        name=row.name,
        project_id=row.project_id,
        sha256=row.sha256,
        size=row.size,
        created_at=row.created_at,
    )
