"""The route of deployment bundles."""

import functools
import hashlib
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import FileResponse

from server.checkpoints.service import CheckpointService
from server.exports.service import bundle_of
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import FAILED, NOT_FOUND, Responses
from server.security.permissions import view
from server.services import ServicesDep
from workers.job_protocol import CheckpointPolicy

router = APIRouter(tags=["checkpoints"])

_ZIP: Responses = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}


@router.get(
    "/api/checkpoints/{checkpoint_id}/bundle",
    response_class=FileResponse,
    responses=NOT_FOUND | NOT_MODIFIED | FAILED | _ZIP,
    dependencies=[view("checkpoint_id")],
)
async def download_bundle(checkpoint_id: str, services: ServicesDep, kept: KeptDep) -> FileResponse:
    """All that it takes to drive a robot: ONNX, manifest, NumPy runner, ROS 2 package; compared with torch.

    `ETag` is its SHA-256.
    """
    checkpoints = CheckpointService(services)
    archive = await services.lanes.jobs.run(checkpoints.described, checkpoint_id)
    name = archive.file_name.removesuffix(".zip")
    path = await bundle_of(services, CheckpointPolicy(id=checkpoint_id), archive.sha256, name)
    headers = kept.unless_file(await services.lanes.downloads.run(_sha256, path, path.stat().st_mtime_ns))
    await services.lanes.jobs.run(checkpoints.taken_home, checkpoint_id)
    return FileResponse(path, media_type="application/zip", filename=f"{name}-bundle.zip", headers=headers)


@functools.lru_cache(maxsize=1_000)
def _sha256(path: Path, _changed_at: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
