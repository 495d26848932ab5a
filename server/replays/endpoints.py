"""Routes of replays: driving an episode again, and the page that plays it."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from server.evaluations.service import replayed
from server.live.page import HEADERS
from server.problems import NOT_FOUND, REPLAY_FAILED
from server.replays import service
from server.replays.recordings import recording_of
from server.replays.schemas import Replay
from server.replays.subject import Subject
from server.replays.subjects import checkpoint_subject, policy_subject
from server.scene.themes import Theme
from server.security.permissions import SIGNED_IN, view
from server.services import ServicesDep

router = APIRouter(tags=["replays"])

_DOWNLOAD = "download"


def _checkpoint(checkpoint_id: str, services: ServicesDep) -> Subject:
    return checkpoint_subject(services, checkpoint_id)


def _evaluation(evaluation_id: str, services: ServicesDep) -> Subject:
    return replayed(services, evaluation_id)


class Player:
    """Answers with an episode's page, made in the replays' lane."""

    def __init__(self, services: ServicesDep) -> None:
        self._services = services

    async def __call__(self, request: Request, subject: Subject, episode: int, theme: Theme) -> Response:
        """The episode is inside the page. viser's client would do more that its address asks for: what is not ours goes."""
        if request.query_params.keys() - {_DOWNLOAD}:
            return RedirectResponse(request.url.path)
        headers = dict(HEADERS)
        if _DOWNLOAD in request.query_params:
            name = f"{subject.file_name.removesuffix('.zip')}-episode{episode}.html"
            headers["Content-Disposition"] = f'attachment; filename="{name}"'
        service.check_episode(subject, episode)
        recording = await recording_of(self._services, subject)
        page = await self._services.lanes.replays.run(service.filmed, subject, recording, episode, theme)
        return HTMLResponse(page, headers=headers)


PlayerDep = Annotated[Player, Depends()]
EvaluationDep = Annotated[Subject, Depends(_evaluation)]
CheckpointDep = Annotated[Subject, Depends(_checkpoint)]
PolicyDep = Annotated[Subject, Depends(policy_subject)]


@router.get(
    "/api/checkpoints/{checkpoint_id}/replays/{episode}",
    responses=NOT_FOUND | REPLAY_FAILED,
    dependencies=[view("checkpoint_id")],
)
async def replay_checkpoint(checkpoint_id: str, subject: CheckpointDep, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of a checkpoint's evaluation again: a few seconds for the first one, then at once."""
    page = f"/replays/checkpoints/{checkpoint_id}/{episode}/"
    service.check_episode(subject, episode)
    return service.prepared(subject, await recording_of(services, subject), episode, page)


@router.get(
    "/api/policies/{name}/suites/{suite}/replays/{episode}", responses=NOT_FOUND | REPLAY_FAILED, dependencies=[SIGNED_IN]
)
async def replay_policy(name: str, suite: str, subject: PolicyDep, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of a shipped policy again: a few seconds for the first one, then at once."""
    page = f"/replays/policies/{name}/{suite}/{episode}/"
    service.check_episode(subject, episode)
    return service.prepared(subject, await recording_of(services, subject), episode, page)


@router.get(
    "/api/evaluations/{evaluation_id}/replays/{episode}",
    responses=NOT_FOUND | REPLAY_FAILED,
    dependencies=[view("evaluation_id")],
)
async def replay_evaluation(evaluation_id: str, subject: EvaluationDep, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of an evaluation again: a few seconds for the first one, then at once."""
    page = f"/replays/evaluations/{evaluation_id}/{episode}/"
    service.check_episode(subject, episode)
    return service.prepared(subject, await recording_of(services, subject), episode, page)


@router.get(
    "/replays/checkpoints/{checkpoint_id}/{episode}/{theme}/", include_in_schema=False, dependencies=[view("checkpoint_id")]
)
async def play_checkpoint(
    request: Request, subject: CheckpointDep, episode: int, theme: Theme, player: PlayerDep
) -> Response:
    """The player of an episode of a checkpoint's evaluation."""
    return await player(request, subject, episode, theme)


@router.get(
    "/replays/evaluations/{evaluation_id}/{episode}/{theme}/", include_in_schema=False, dependencies=[view("evaluation_id")]
)
async def play_evaluation(
    request: Request, subject: EvaluationDep, episode: int, theme: Theme, player: PlayerDep
) -> Response:
    """The player of an episode of an evaluation."""
    return await player(request, subject, episode, theme)


@router.get("/replays/policies/{name}/{suite}/{episode}/{theme}/", include_in_schema=False, dependencies=[SIGNED_IN])
async def play_policy(request: Request, subject: PolicyDep, episode: int, theme: Theme, player: PlayerDep) -> Response:
    """The player of an episode of a shipped policy."""
    return await player(request, subject, episode, theme)
