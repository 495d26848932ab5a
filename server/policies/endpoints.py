"""Routes of the policies that ship."""

from fastapi import APIRouter
from fastapi.responses import FileResponse

from server.exports.service import bundle_of
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import PartDep
from server.http.problems import FAILED, NOT_FOUND, Responses
from server.policies import service
from server.policies.schemas import PolicyEpisodes, ShippedPolicy
from server.security.permissions import SIGNED_IN
from server.services import ServicesDep
from workers.job_protocol import ShippedPolicyName
from workers.shipped.library import shipped_policies

router = APIRouter(prefix="/api/policies", tags=["policies"])

_ZIP: Responses = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}


@router.get("", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_policies(part: PartDep, kept: KeptDep) -> list[ShippedPolicy]:
    """Trained policies that ship with the project, to watch, to drive and to compare with."""
    kept.unless(part.limit, part.offset)
    return [service.view(policy) for policy in part.of(shipped_policies())]


@router.get("/{name}", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_policy(name: str, kept: KeptDep) -> ShippedPolicy:
    """One of them."""
    policy = service.find(name)
    kept.unless(name)
    return service.view(policy)


@router.get("/{name}/suites/{suite}/episodes", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_policy_episodes(name: str, suite: str, kept: KeptDep) -> PolicyEpisodes:
    """Every episode behind its figures on a suite."""
    service.find(name)
    kept.unless(name, suite)
    return service.episodes(name, suite)


@router.get(
    "/{name}/download", response_class=FileResponse, responses=NOT_FOUND | NOT_MODIFIED | _ZIP, dependencies=[SIGNED_IN]
)
def download_policy(name: str, kept: KeptDep) -> FileResponse:
    """The archive: weights as safetensors, and the manifest."""
    policy = service.find(name)
    headers = kept.unless_file(service.shipped_hash(name))
    file_name = f"mapless-{policy.card.name}.zip"
    return FileResponse(policy.archive, media_type="application/zip", filename=file_name, headers=headers)


@router.get("/{name}/bundle", response_class=FileResponse, responses=NOT_FOUND | FAILED | _ZIP, dependencies=[SIGNED_IN])
async def download_policy_bundle(name: str, services: ServicesDep) -> FileResponse:
    """All that it takes to drive a robot with it; compared with torch."""
    policy = service.find(name)
    file_name = f"mapless-{policy.card.name}-bundle.zip"
    path = await bundle_of(services, ShippedPolicyName(name=name), service.shipped_hash(name), policy.card.title)
    return FileResponse(path, media_type="application/zip", filename=file_name)
