"""How the service's errors are described in OpenAPI and answered over HTTP."""

import logging
import math
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request, WebSocket
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.requests import ClientDisconnect
from starlette.websockets import WebSocketState

from server.errors import ErrorBody, RefusedFieldError, ServiceError
from server.http.refusals import refusal
from sim.config.refusals import to_tell

logger = logging.getLogger(__name__)

Responses = dict[int | str, dict[str, Any]]

TRY_AGAIN_LATER = 1013
"""RFC 6455 and its registry: what a socket is closed with that can't be served now."""
MAX_REASON = 120
"""Bytes that a closing socket may say; ours are of one byte a character."""

NOT_FOUND: Responses = {404: refusal(404)}
CONFLICT: Responses = {409: refusal(409)}
FAILED: Responses = {500: refusal(500)}
"""Of what a worker is asked for: a job that fails would fail again."""
NOT_INSTALLED: Responses = {501: {"model": ErrorBody, "description": "Needs a part that is not installed"}}


def retry_after(error: ServiceError) -> dict[str, str]:
    """The header that says when to come again, where that is known."""
    return {} if error.retry_after is None else {"Retry-After": str(max(1, math.ceil(error.retry_after)))}


def error_response(error: ServiceError) -> JSONResponse:
    """The error as its HTTP response."""
    body = ErrorBody(detail=error.message).model_dump()
    return JSONResponse(body, status_code=error.status, headers=retry_after(error))


async def close_for_now(websocket: WebSocket, error: ServiceError) -> None:
    """Tell whoever opened a socket to come again; a handshake that is refused would tell a browser no reason."""
    if websocket.application_state == WebSocketState.CONNECTING:
        await websocket.accept(subprotocol=next(iter(websocket.scope.get("subprotocols", ())), None))
    if WebSocketState.DISCONNECTED not in (websocket.application_state, websocket.client_state):
        await websocket.close(TRY_AGAIN_LATER, error.message[:MAX_REASON])


def install_error_handlers(app: FastAPI) -> None:
    """Answer what an endpoint raises with its status and its sentence, and refused fields with their places."""

    @app.exception_handler(ServiceError)
    async def _refuse(connection: Request | WebSocket, error: ServiceError) -> JSONResponse | None:
        if isinstance(connection, WebSocket) and error.status == HTTPStatus.SERVICE_UNAVAILABLE:
            await close_for_now(connection, error)
            return None
        return error_response(error)

    @app.exception_handler(ClientDisconnect)
    async def _let_go(request: Request, _error: ClientDisconnect) -> Response:
        # A worker that is lost in the middle of an upload is an everyday matter. Nobody reads this answer.
        logger.info("%s %s: whoever sent it left before it was complete", request.method, request.url.path)
        return Response(status_code=HTTPStatus.BAD_REQUEST)

    @app.exception_handler(RefusedFieldError)
    async def _refuse_field(_request: Request, error: RefusedFieldError) -> JSONResponse:
        problem: dict[str, Any] = {"loc": error.location, "msg": error.message, "type": "value_error"}
        if error.position is not None:
            problem["ctx"] = {"position": error.position}
        return JSONResponse({"detail": [problem]}, status_code=error.status)

    @app.exception_handler(RequestValidationError)
    async def _refuse_fields(_request: Request, error: RequestValidationError) -> JSONResponse:
        # What was sent is not sent back: it may be a token, and it may be a number that JSON can't hold.
        problems = [
            {"loc": problem["loc"], "msg": problem["msg"].removeprefix("Value error, "), "type": problem["type"]}
            for problem in to_tell(error.errors())
        ]
        return JSONResponse({"detail": problems}, status_code=422)
