"""The route of deployment bundles."""

from fastapi import APIRouter
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from server.exports.service import ExportService
from server.problems import EXPORT_FAILED, NOT_FOUND, Responses
from server.services import ServicesDep

router = APIRouter(tags=["checkpoints"])

_ZIP: Responses = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}


@router.get(
    "/api/checkpoints/{checkpoint_id}/bundle",
    response_class=FileResponse,
    responses=NOT_FOUND | EXPORT_FAILED | _ZIP,
)
def download_bundle(checkpoint_id: str, services: ServicesDep) -> FileResponse:
    """All that it takes to drive a robot: ONNX, manifest, NumPy runner, ROS 2 package; compared with torch just now."""
    bundle = ExportService(services).bundle(checkpoint_id)
    return FileResponse(
        bundle.path,
        media_type="application/zip",
        filename=bundle.file_name,
        background=BackgroundTask(bundle.discard),
    )
