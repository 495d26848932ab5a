"""Routes of robots' recordings."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request

from server.bags import service
from server.bags.schemas import MAX_BAG_BYTES, Bag, BagPage
from server.database.tables import DEFAULT_PROJECT
from server.errors import RefusedFieldError
from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.schemas import Line
from server.security.permissions import LAUNCH, SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from workers.bags.results import BagBeside, BagReading, TopicChoice
from workers.job_protocol import CheckpointPolicy, Identifier, PlayedPolicy, ShippedPolicyName, UploadedPolicy

router = APIRouter(prefix="/api/recordings", tags=["recordings"])

_CONTENT = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}
_BODY = {"requestBody": {"required": True, "content": _CONTENT}}
NameQuery = Annotated[Line, Query(max_length=120, description="Of the recording, for people.")]
TopicQuery = Annotated[str | None, Query(max_length=200, description="Where several fit: the one that is read.")]


async def _topics(
    scan: TopicQuery = None, odometry: TopicQuery = None, commands: TopicQuery = None, goal: TopicQuery = None
) -> TopicChoice:
    return TopicChoice(scan=scan, odometry=odometry, commands=commands, goal=goal)


async def _policy(
    shipped: Annotated[Identifier | None, Query(description="Name of a shipped policy.")] = None,
    checkpoint: Annotated[Identifier | None, Query(description="Id of a checkpoint.")] = None,
    uploaded: Annotated[Identifier | None, Query(description="Id of an uploaded policy.")] = None,
) -> PlayedPolicy:
    if shipped is not None:
        return ShippedPolicyName(name=shipped)
    if checkpoint is not None:
        return CheckpointPolicy(id=checkpoint)
    if uploaded is not None:
        return UploadedPolicy(id=uploaded)
    raise RefusedFieldError(("query", "shipped"), "Say which policy: shipped, checkpoint or uploaded.")


TopicsDep = Annotated[TopicChoice, Depends(_topics)]
PolicyDep = Annotated[PlayedPolicy, Depends(_policy)]


@router.post(
    "",
    status_code=201,
    responses=NOT_FOUND | CONFLICT,
    max_body_size=MAX_BAG_BYTES + 1,
    openapi_extra=_BODY,
    dependencies=[LAUNCH],
)
async def upload_recording(
    name: NameQuery,
    request: Request,
    services: ServicesDep,
    principal: PrincipalDep,
    project_id: str = DEFAULT_PROJECT,
) -> Bag:
    """Keep what a robot recorded: an `.mcap` or a `.db3` file, or the folder of a rosbag2 recording as `.zip` or `.tar`."""
    content = await service.arrived(request.stream())
    return await services.lanes.jobs.run(service.keep, services, name, project_id, content, principal)


@router.get("", dependencies=[SIGNED_IN])
def list_recordings(window: WindowDep, services: ServicesDep, principal: PrincipalDep) -> BagPage:
    """Some of the recordings, the newest first."""
    return service.some(services, window, principal)


@router.get("/{recording_id}", responses=NOT_FOUND, dependencies=[view("recording_id")])
def get_recording(recording_id: str, services: ServicesDep) -> Bag:
    """One of the recordings."""
    return service.one(services, recording_id)


@router.get("/{recording_id}/reading", responses=NOT_FOUND, dependencies=[view("recording_id")])
async def read_recording(recording_id: str, topics: TopicsDep, services: ServicesDep) -> BagReading:
    """The scene, and noise, dropout, rate, delay and accelerations with their intervals: a second or two, then at once."""
    return await service.reading_of(services, recording_id, topics)


@router.get("/{recording_id}/beside", responses=NOT_FOUND, dependencies=[view("recording_id")])
async def hold_beside(
    recording_id: str, topics: TopicsDep, policy: PolicyDep, services: ServicesDep, principal: PrincipalDep
) -> BagBeside:
    """What a policy would have commanded at every moment beside what the robot did, and where they part."""
    return await service.beside(services, recording_id, topics, policy, principal)


@router.delete("/{recording_id}", status_code=204, responses=NOT_FOUND, dependencies=[edit("recording_id")])
def delete_recording(recording_id: str, services: ServicesDep) -> None:
    """Forget one."""
    service.delete(services, recording_id)
