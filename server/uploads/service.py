"""What a person may do with policies from elsewhere: upload one, list them, delete one."""

import base64
import hashlib
import io
import json
import zipfile

from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, RefusedFieldError, TooLargeError
from server.http.paging import Window
from server.ids import new_id
from server.projects.repository import ProjectRepository
from server.security.principal import Principal
from server.services import Services
from server.uploads.look import problem_of
from server.uploads.repository import UploadRepository
from server.uploads.schemas import (
    MAX_FILE_BYTES,
    ActionRange,
    ObservedPart,
    PolicyShapes,
    PolicyUpload,
    UploadedPolicy,
    UploadedPolicyPage,
)
from sim.actions import action_layout
from sim.config import TaskConfig
from sim.observations import observation_layout
from workers.packed import UNPACKING_ERRORS

MAX_UPLOADS = 500
"""Policies from elsewhere that are kept."""

_CONTENT = ("body", "content")
_GRAPH, _MANIFEST = "policy.onnx", "manifest.json"
_ZIP = b"PK\x03\x04"


def upload(services: Services, wanted: PolicyUpload, principal: Principal) -> UploadedPolicy:
    """Keep a policy that ONNX Runtime takes and whose shapes are its task's; what else it does, the worker finds out.

    Raises:
        RefusedFieldError: the file is not what it should be, or its task is missing or another one's.
        TooLargeError: it is too large.
        ConflictError: there are too many already.
        ForbiddenError: the project is not one's own to change.
        NotFoundError: there is no such project.
        BusyError: others are looked at.
    """
    principal.require("editor", wanted.project_id)
    try:
        content = base64.b64decode(wanted.content, validate=True)
    except ValueError as error:
        raise RefusedFieldError(_CONTENT, "The upload is not base64: choose the file again.") from error
    graph, task = _from_bundle(content) if content.startswith(_ZIP) else (content, None)
    task = wanted.task or task
    if task is None:
        raise RefusedFieldError(("body", "task"), "Say which robot, LiDAR and observation this policy is for.")
    if not graph:
        raise RefusedFieldError(_CONTENT, "The file is empty.")
    if len(graph) > MAX_FILE_BYTES:
        raise TooLargeError(f"The policy is larger than {MAX_FILE_BYTES // 2**20} MiB.")
    with services.database.read() as session:
        ProjectRepository(session).get(wanted.project_id)
    if problem := problem_of(graph, task):
        raise RefusedFieldError(_CONTENT, f"The policy can't be used: {problem}.")
    row = tables.UploadedPolicy(
        id=new_id(),
        project_id=wanted.project_id,
        name=wanted.name,
        task=task.model_dump(mode="json"),
        sha256=hashlib.sha256(graph).hexdigest(),
        size=len(graph),
        graph=graph,
    )
    with services.database.write() as session:
        ProjectRepository(session).get(wanted.project_id)
        repository = UploadRepository(session)
        if repository.count() >= MAX_UPLOADS:
            raise ConflictError(f"There are {MAX_UPLOADS} uploaded policies already: delete some first.")
        repository.add(row)
        AuditRepository(session).add("policy.uploaded", target=row.id, name=row.name)
        session.flush()
        return _view(row)


def shapes(task: TaskConfig) -> PolicyShapes:
    """What a file has to take and give to be a task's policy."""
    numbers: dict[str, int] = {}
    for block in (layout := observation_layout(task)).blocks:
        numbers[block.key] = numbers.get(block.key, 0) + len(block.numbers)
    return PolicyShapes(
        observation=layout.size,
        parts=[ObservedPart(name=name, numbers=many) for name, many in numbers.items()],
        actions=[
            ActionRange(name=one.name, low=one.low * one.limit, high=one.limit, unit=one.unit.rstrip(","))
            for one in action_layout(task.robot).components
        ],
    )


def some(services: Services, window: Window, principal: Principal) -> UploadedPolicyPage:
    """Some of them, the newest first."""
    with services.database.read() as session:
        rows, total = UploadRepository(session).page(window, principal.visible)
        return UploadedPolicyPage(items=[_view(row) for row in rows], total=total)


def delete(services: Services, upload_id: str) -> None:
    """Forget a policy; what was measured of it stays.

    Raises:
        NotFoundError: there is none.
    """
    with services.database.write() as session:
        repository = UploadRepository(session)
        AuditRepository(session).add("policy.deleted", target=upload_id, name=repository.get(upload_id).name)
        repository.delete(upload_id)


def _view(row: tables.UploadedPolicy) -> UploadedPolicy:
    return UploadedPolicy(
        id=row.id,
        name=row.name,
        project_id=row.project_id,
        task=TaskConfig.model_validate(row.task),
        sha256=row.sha256,
        size=row.size,
        created_at=row.created_at,
    )


def _from_bundle(content: bytes) -> tuple[bytes, TaskConfig]:
    """The graph and the task of a bundle that this project has exported."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            graph, manifest = (_member(archive, name) for name in (_GRAPH, _MANIFEST))
        return graph, TaskConfig.model_validate(json.loads(manifest)["training"]["task"])
    except (KeyError, TypeError, *UNPACKING_ERRORS) as error:
        raise RefusedFieldError(
            _CONTENT,
            f"This is no robot bundle of this version: {_GRAPH} and {_MANIFEST} belong in one.",
        ) from error


def _member(archive: zipfile.ZipFile, name: str) -> bytes:
    """One file of a bundle, wherever it lies in there; never more than is allowed."""
    (found,) = [info for info in archive.infolist() if info.filename.split("/")[1:] == [name]]
    with archive.open(found) as file:
        data = file.read(MAX_FILE_BYTES + 1)
    if len(data) > MAX_FILE_BYTES:
        raise TooLargeError(f"{name} is larger than {MAX_FILE_BYTES // 2**20} MiB.")
    return data
