"""How the service's errors are described in OpenAPI and answered over HTTP."""

from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse

from server.errors import ErrorBody, ServiceError

Responses = dict[int | str, dict[str, Any]]

UNAUTHORIZED: Responses = {401: {"model": ErrorBody, "description": "No valid login"}}
NOT_FOUND: Responses = {404: {"model": ErrorBody, "description": "No such thing"}}
CONFLICT: Responses = {409: {"model": ErrorBody, "description": "Not in this state"}}
TOO_MANY: Responses = {429: {"model": ErrorBody, "description": "Too many wrong tokens"}}


def error_response(error: ServiceError) -> JSONResponse:
    """The error as its HTTP response."""
    return JSONResponse(ErrorBody(detail=error.message).model_dump(), status_code=error.status)


def install_error_handler(app: FastAPI) -> None:
    """Answer every `ServiceError` that an endpoint raises with its status and its sentence."""

    @app.exception_handler(ServiceError)
    async def _handle(_request: Request, error: ServiceError) -> JSONResponse:
        return error_response(error)
