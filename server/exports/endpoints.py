"""The route of deployment bundles."""

from fastapi import APIRouter
from fastapi.responses import FileResponse

from server.exports.response import BundleResponse
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
async def download_bundle(checkpoint_id: str, services: ServicesDep) -> FileResponse:
    """All that it takes to drive a robot: ONNX, manifest, NumPy runner, ROS 2 package; compared with torch just now."""
    return BundleResponse(await services.lanes.exports.run(ExportService(services).bundle, checkpoint_id))
