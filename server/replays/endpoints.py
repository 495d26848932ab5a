"""Routes of replays: driving a scenario again by one policy or several, its numbers, and the page that plays it."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Depends, Request
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.concurrency import run_in_threadpool

from server.errors import ServiceError
from server.http.paging import PartDep
from server.http.problems import CONFLICT, FAILED, NOT_FOUND, retry_after
from server.live.page import HEADERS
from server.replays import lapse, repository, service
from server.replays.films import episode_film, film_of, film_progress
from server.replays.page import failed_page, replay_page
from server.replays.recordings import progress_of, recordings_of
from server.replays.references import Reference, references
from server.replays.schemas import BesideList, EpisodeReplay, EpisodeSeries, FilmProgress, Lapse, Replay, ReplayProgress
from server.replays.service import Part
from server.replays.subject import Subject
from server.replays.subjects import subject_of
from server.security.permissions import SIGNED_IN, VIEW_REPLAYED, view
from server.security.principal import PrincipalDep
from server.services import Services, ServicesDep
from workers.film_protocol import FilmForm
from workers.scene.themes import Theme

router = APIRouter(tags=["replays"])

_DOWNLOAD = "download"


class Replayed:
    """Everything that an address of replays names."""

    def __init__(self, named: Sequence[Reference], services: Services) -> None:
        self.references = named
        self._services = services

    async def subjects(self) -> list[Subject]:
        """Whose episodes they are.

        Raises:
            NotFoundError: one is not there.
        """
        return [await run_in_threadpool(subject_of, self._services, each) for each in self.references]

    async def parts(self, episode: int) -> list[Part]:
        """All that they did, driven again where that is not kept.

        Raises:
            NotFoundError: one is not there, or there is no such episode.
            ConflictError: they were measured on different suites.
            ReplayFailedError: see `recording_of`, also for more.
        """
        subjects = await self.subjects()
        service.check_episode(subjects, episode)
        recordings = await recordings_of(self._services, subjects)
        return [Part(*each) for each in zip(self.references, subjects, recordings, strict=True)]

    async def one(self, episode: int) -> Replay:
        """An episode of the first of them."""
        return service.prepared((await self.parts(episode))[0], episode)


async def _replayed(subjects: str, services: ServicesDep) -> Replayed:
    return Replayed(references(subjects), services)


ReplayedDep = Annotated[Replayed, Depends(_replayed)]


@router.get(
    "/api/checkpoints/{checkpoint_id}/replays/{episode}",
    responses=NOT_FOUND | FAILED,
    dependencies=[view("checkpoint_id")],
)
async def replay_checkpoint(checkpoint_id: str, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of a checkpoint's evaluation again: a few seconds for the first one, then at once."""
    return await Replayed([Reference("checkpoint", checkpoint_id)], services).one(episode)


@router.get("/api/policies/{name}/suites/{suite}/replays/{episode}", responses=NOT_FOUND | FAILED, dependencies=[SIGNED_IN])
async def replay_policy(name: str, suite: str, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of a shipped policy again: a few seconds for the first one, then at once."""
    return await Replayed([Reference("policy", name, suite)], services).one(episode)


@router.get(
    "/api/evaluations/{evaluation_id}/replays/{episode}",
    responses=NOT_FOUND | FAILED,
    dependencies=[view("evaluation_id")],
)
async def replay_evaluation(evaluation_id: str, episode: int, services: ServicesDep) -> Replay:
    """Drive an episode of an evaluation again: a few seconds for the first one, then at once."""
    return await Replayed([Reference("evaluation", evaluation_id)], services).one(episode)


@router.get("/api/replays/{subjects}/progress", responses=NOT_FOUND, dependencies=[VIEW_REPLAYED])
async def replay_progress(replayed: ReplayedDep, services: ServicesDep) -> ReplayProgress:
    """How far it is, while the replay itself is waited for."""
    return await progress_of(services, await replayed.subjects())


@router.get("/api/replays/{subjects}/beside", responses=NOT_FOUND, dependencies=[VIEW_REPLAYED])
async def list_beside(replayed: ReplayedDep, services: ServicesDep, principal: PrincipalDep, part: PartDep) -> BesideList:
    """Who else drove the same scenarios, to be shown beside."""
    recorded = (await replayed.subjects())[0].recorded

    def read() -> BesideList:
        with services.database.read() as session:
            items = repository.beside(session, recorded.suite_hash, principal.visible, replayed.references)
        return BesideList(suite=recorded.suite, items=part.of(items))

    return await run_in_threadpool(read)


@router.get("/api/replays/{subjects}/{episode}", responses=NOT_FOUND | CONFLICT | FAILED, dependencies=[VIEW_REPLAYED])
async def replay(replayed: ReplayedDep, episode: int) -> EpisodeReplay:
    """Drive one scenario again by one policy or several, which were measured on the same suite."""
    return service.together(await replayed.parts(episode), episode)


@router.get(
    "/api/replays/{subjects}/{episode}/series", responses=NOT_FOUND | CONFLICT | FAILED, dependencies=[VIEW_REPLAYED]
)
async def replay_series(replayed: ReplayedDep, episode: int, services: ServicesDep) -> EpisodeSeries:
    """What the charts beside it show: range ahead, commands, speeds, return to come and reward terms over time."""
    parts = await replayed.parts(episode)
    return await services.lanes.replays.run(service.charted, parts, episode)


@router.get(
    "/api/replays/{subjects}/{episode}/mcap",
    response_class=FileResponse,
    responses=NOT_FOUND | CONFLICT | FAILED | {200: {"content": {"application/octet-stream": {}}}},
    dependencies=[VIEW_REPLAYED],
)
async def replay_messages(replayed: ReplayedDep, episode: int, services: ServicesDep) -> FileResponse:
    """The episode as an MCAP file of ROS 2 messages: scans, odometry, commands, the goal, and transforms."""
    return await _taken_away(replayed, episode, services, "mcap", "application/octet-stream")


@router.get(
    "/api/replays/{subjects}/{episode}/mp4",
    response_class=FileResponse,
    responses=NOT_FOUND | CONFLICT | FAILED | {200: {"content": {"video/mp4": {}}}},
    dependencies=[VIEW_REPLAYED],
)
async def replay_video(replayed: ReplayedDep, episode: int, services: ServicesDep, theme: Theme = "light") -> FileResponse:
    """The episode from above as a film of a minute at most: MP4, H.264; of several policies the others are ghosts."""
    return await _taken_away(replayed, episode, services, "mp4", "video/mp4", theme)


@router.get(
    "/api/replays/{subjects}/{episode}/gif",
    response_class=FileResponse,
    responses=NOT_FOUND | CONFLICT | FAILED | {200: {"content": {"image/gif": {}}}},
    dependencies=[VIEW_REPLAYED],
)
async def replay_gif(replayed: ReplayedDep, episode: int, services: ServicesDep, theme: Theme = "light") -> FileResponse:
    """The episode from above as a GIF of half a minute at most, smaller than the MP4."""
    return await _taken_away(replayed, episode, services, "gif", "image/gif", theme)


async def _taken_away(
    replayed: Replayed, episode: int, services: Services, form: FilmForm, media_type: str, theme: Theme = "light"
) -> FileResponse:
    subjects = await replayed.subjects()
    service.check_episode(subjects, episode)
    path = await film_of(services, episode_film(subjects, episode, form, theme), subjects)
    return FileResponse(path, media_type=media_type, headers=_attached(subjects, episode, form))


@router.get("/api/replays/{subjects}/{episode}/progress", responses=NOT_FOUND | CONFLICT, dependencies=[VIEW_REPLAYED])
async def film_made(
    replayed: ReplayedDep, episode: int, services: ServicesDep, form: FilmForm = "scene", theme: Theme = "light"
) -> FilmProgress:
    """How far a film of the episode is made, while the film itself is waited for."""
    subjects = await replayed.subjects()
    service.check_episode(subjects, episode)
    return await film_progress(services, episode_film(subjects, episode, form, theme))


async def _of_a_run(run_id: str, services: ServicesDep) -> Replayed:
    return Replayed(await run_in_threadpool(lapse.checkpoints_of, services, run_id), services)


LapseDep = Annotated[Replayed, Depends(_of_a_run)]


@router.get("/api/runs/{run_id}/lapse", responses=NOT_FOUND | FAILED, dependencies=[view("run_id")])
async def time_lapse(run_id: str, replayed: LapseDep, services: ServicesDep) -> Lapse:
    """A run's learning: the same scenarios, driven again by its checkpoints; some seconds for each that was not seen yet."""
    subjects = await replayed.subjects()
    return lapse.described(run_id, subjects, await recordings_of(services, subjects))


@router.get("/api/runs/{run_id}/lapse/progress", responses=NOT_FOUND, dependencies=[view("run_id")])
async def time_lapse_progress(replayed: LapseDep, services: ServicesDep) -> ReplayProgress:
    """How far it is, while the time lapse itself is waited for."""
    return await progress_of(services, await replayed.subjects())


@router.get("/replays/lapses/{run_id}/{theme}/", include_in_schema=False, dependencies=[view("run_id")])
async def play_time_lapse(
    replayed: LapseDep, request: Request, run_id: str, theme: Theme, services: ServicesDep
) -> Response:
    """The player of a run's time lapse; see `play`."""
    if request.query_params.keys() - {_DOWNLOAD}:
        return RedirectResponse(request.url.path)
    try:
        return await _time_lapse_player(replayed, request, theme, services)
    except ServiceError as error:
        return _failed(theme, error)


async def _time_lapse_player(replayed: Replayed, request: Request, theme: Theme, services: Services) -> Response:
    subjects = await replayed.subjects()
    # What was read of the recordings is let go while the film is made.
    film, caption = lapse.filmed(subjects, await recordings_of(services, subjects), theme)
    path = await film_of(services, film, subjects)
    headers = dict(HEADERS)
    if _DOWNLOAD in request.query_params:
        name = subjects[-1].file_name.removesuffix(".zip")
        headers["Content-Disposition"] = f'attachment; filename="{name}-time-lapse.html"'
    return HTMLResponse(await services.lanes.replays.run(replay_page, theme, path, caption), headers=headers)


@router.get("/replays/{subjects}/{episode}/{theme}/", include_in_schema=False, dependencies=[VIEW_REPLAYED])
async def play(replayed: ReplayedDep, request: Request, episode: int, theme: Theme, services: ServicesDep) -> Response:
    """The player, with the scenario inside. What viser's client would do besides is cut off."""
    if request.query_params.keys() - {_DOWNLOAD}:
        return RedirectResponse(request.url.path)
    try:
        return await _player(replayed, request, episode, theme, services)
    except ServiceError as error:
        return _failed(theme, error)


async def _player(replayed: Replayed, request: Request, episode: int, theme: Theme, services: Services) -> Response:
    caption = service.captioned(await replayed.parts(episode), episode)
    subjects = await replayed.subjects()
    path = await film_of(services, episode_film(subjects, episode, "scene", theme), subjects)
    headers = HEADERS | (_attached(subjects, episode, "html") if _DOWNLOAD in request.query_params else {})
    return HTMLResponse(await services.lanes.replays.run(replay_page, theme, path, caption), headers=headers)


def _failed(theme: Theme, error: ServiceError) -> Response:
    """The same status as elsewhere, for whoever looks into the frame."""
    return HTMLResponse(failed_page(theme, error.message), status_code=error.status, headers=HEADERS | retry_after(error))


def _attached(subjects: Sequence[Subject], episode: int, suffix: str) -> dict[str, str]:
    others = f"-and-{len(subjects) - 1}-more" if len(subjects) > 1 else ""
    name = subjects[0].file_name.removesuffix(".zip") + others
    return {"Content-Disposition": f'attachment; filename="{name}-episode{episode}.{suffix}"'}
