"""Routes of the queue and of the workers."""

from typing import Annotated

from fastapi import APIRouter, Depends, status

from server.http.paging import PartDep, WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.queueing.schemas import Priority, QueuePage, QueuePlace, Workers
from server.queueing.service import QueueService
from server.security.permissions import ADMINISTRATE, SIGNED_IN, edit
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.system.schemas import WorkerName

router = APIRouter(tags=["queue"])


async def _service(services: ServicesDep) -> QueueService:
    return QueueService(services)


QueueServiceDep = Annotated[QueueService, Depends(_service)]


@router.get("/api/queue", dependencies=[SIGNED_IN])
def list_queue(service: QueueServiceDep, window: WindowDep, principal: PrincipalDep) -> QueuePage:
    """The runs that wait, in the order of their turns, with what for and until when."""
    return service.page(window, principal.visible)


@router.put(
    "/api/runs/{run_id}/priority",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[edit("run_id")],
)
def set_priority(run_id: str, body: Priority, service: QueueServiceDep, principal: PrincipalDep) -> None:
    """Say how urgent a run is that waits."""
    service.prioritise(run_id, body.priority, principal)


@router.put(
    "/api/runs/{run_id}/place",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[edit("run_id")],
)
def put_beside(run_id: str, body: QueuePlace, service: QueueServiceDep, principal: PrincipalDep) -> None:
    """Let a run have its turn right before or after another one, by its priority, and by others' where it must."""
    service.place(run_id, body, principal)


@router.post(
    "/api/runs/{run_id}/front",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[edit("run_id")],
)
def move_to_front(run_id: str, service: QueueServiceDep, principal: PrincipalDep) -> None:
    """Let a run that waits have the next turn."""
    service.to_front(run_id, principal)


@router.get("/api/workers", dependencies=[SIGNED_IN])
def list_workers(service: QueueServiceDep, principal: PrincipalDep, part: PartDep) -> Workers:
    """Every worker with its machine, what it trains, how busy it was, and what was last heard of it."""
    return Workers(items=part.of(service.workers(principal.visible).items))


@router.post(
    "/api/workers/remove",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[ADMINISTRATE],
)
def remove_worker(body: WorkerName, service: QueueServiceDep) -> None:
    """Forget a worker that has gone."""
    service.remove(body.worker)
