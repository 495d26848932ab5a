"""Routes of playgrounds; whoever opened one is the only one who finds it."""

from typing import Annotated

from fastapi import APIRouter, Body

from server.http.problems import NOT_FOUND
from server.live.settings import LiveSettings
from server.playground import service
from server.playground.schemas import AnyChange, KeptArena, KeptArenaName, Playground, PlaygroundRequest, PlaygroundSettings
from server.security.permissions import LAUNCH, OWN_PLAYGROUND, SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/playgrounds", tags=["playgrounds"])


@router.post("", status_code=201, responses=NOT_FOUND, dependencies=[SIGNED_IN])
def open_playground(request: PlaygroundRequest, services: ServicesDep, principal: PrincipalDep) -> Playground:
    """Let a policy drive somewhere; it does while somebody watches."""
    return service.open_playground(services, request, principal).view()


@router.get("/{playground_id}", responses=NOT_FOUND, dependencies=[OWN_PLAYGROUND])
async def get_playground(playground_id: str, services: ServicesDep) -> Playground:
    """Everything in it as it is now."""
    return services.playgrounds.get(playground_id).view()


@router.delete("/{playground_id}", status_code=204, responses=NOT_FOUND, dependencies=[OWN_PLAYGROUND])
async def close_playground(playground_id: str, services: ServicesDep) -> None:
    """Forget it."""
    services.playgrounds.close(playground_id)


@router.put("/{playground_id}/settings", responses=NOT_FOUND, dependencies=[OWN_PLAYGROUND])
async def change_playground_settings(playground_id: str, settings: PlaygroundSettings, services: ServicesDep) -> Playground:
    """How it drives, what it perceives and what is shown."""
    ground = services.playgrounds.get(playground_id)
    ground.configure(settings)
    services.live.configure(playground_id, LiveSettings(robots=1, rays=settings.rays, follow=0 if settings.follow else None))
    return ground.view()


@router.post("/{playground_id}/changes", responses=NOT_FOUND, dependencies=[OWN_PLAYGROUND])
async def change_playground(playground_id: str, change: Annotated[AnyChange, Body()], services: ServicesDep) -> Playground:
    """Put something somewhere, push the robot, or let a paused one make its next steps."""
    ground = services.playgrounds.get(playground_id)
    ground.change(change)
    return ground.view()


@router.post("/{playground_id}/arena", status_code=201, responses=NOT_FOUND, dependencies=[LAUNCH])
def keep_arena(playground_id: str, body: KeptArenaName, services: ServicesDep, principal: PrincipalDep) -> KeptArena:
    """Put the arena as it stands into the gallery, the robot's place as its start: it can be trained on at once."""
    ground = services.playgrounds.of(playground_id, principal)
    return KeptArena(config=service.keep_arena(services, ground, body.name))
