"""Routes of policies from elsewhere."""

from fastapi import APIRouter

from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import LAUNCH, SIGNED_IN, edit
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.uploads import service
from server.uploads.schemas import (
    MAX_UPLOAD_BYTES,
    PolicyShapes,
    PolicyTask,
    PolicyUpload,
    UploadedPolicy,
    UploadedPolicyPage,
)

router = APIRouter(prefix="/api/uploads", tags=["policies"])


@router.post("", status_code=201, responses=CONFLICT, max_body_size=MAX_UPLOAD_BYTES, dependencies=[LAUNCH])
def upload_policy(upload: PolicyUpload, services: ServicesDep, principal: PrincipalDep) -> UploadedPolicy:
    """Keep an ONNX file, to be measured as any other policy."""
    return service.upload(services, upload, principal)


@router.post("/shapes", dependencies=[LAUNCH])
def get_policy_shapes(wanted: PolicyTask) -> PolicyShapes:
    """What an ONNX file has to take and give for a robot, its LiDAR and an observation."""
    return service.shapes(wanted.task)


@router.get("", dependencies=[SIGNED_IN])
def list_uploads(window: WindowDep, services: ServicesDep, principal: PrincipalDep) -> UploadedPolicyPage:
    """Some of the uploaded policies, the newest first."""
    return service.some(services, window, principal)


@router.delete("/{upload_id}", status_code=204, responses=NOT_FOUND, dependencies=[edit("upload_id")])
def delete_upload(upload_id: str, services: ServicesDep) -> None:
    """Forget one; what was measured of it stays."""
    service.delete(services, upload_id)
