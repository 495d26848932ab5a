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

logger = logging.getLogger(__name__)

Responses = dict[int | str, dict[str, Any]]

TRY_AGAIN_LATER = 1013
"""RFC 6455 and its registry: what a socket is closed with that can't be served now."""
MAX_REASON = 120
"""Bytes that a closing socket may say; ours are of one byte a character."""

UNAUTHORIZED: Responses = {401: {"model": ErrorBody, "description": "No valid login"}}
AWAY: Responses = {
    503: {
        "model": ErrorBody,
        "description": "The database or the store can't be reached now, or is busy: Retry-After says when to come again",
    }
}
FORBIDDEN: Responses = {403: {"model": ErrorBody, "description": "Takes more rights"}}
INVALID: Responses = {400: {"model": ErrorBody, "description": "Makes no sense as a whole"}}
NOT_FOUND: Responses = {404: {"model": ErrorBody, "description": "No such thing"}}
CONFLICT: Responses = {409: {"model": ErrorBody, "description": "Not in this state"}}
EXPORT_FAILED: Responses = {
    500: {"model": ErrorBody, "description": "Not exported: the reason is in the detail"},
    503: {"model": ErrorBody, "description": "Took too long, or too many wait already: Retry-After says when to come again"},
}
REPLAY_FAILED: Responses = {
    500: {"model": ErrorBody, "description": "Not driven again: the reason is in the detail"},
    503: {"model": ErrorBody, "description": "Took too long, or too many wait already: Retry-After says when to come again"},
}
BAG_UNUSABLE: Responses = {
    422: {"model": ErrorBody, "description": "Can't be read, or lacks what is asked of it: the reason is in the detail"},
    503: {"model": ErrorBody, "description": "Took too long, or too many wait already: Retry-After says when to come again"},
}
NOT_INSTALLED: Responses = {501: {"model": ErrorBody, "description": "Needs a part that is not installed"}}
BUSY: Responses = {
    503: {"model": ErrorBody, "description": "Too many wait already: Retry-After says when to come again"},
}
TOO_MANY_STREAMS: Responses = {503: {"model": ErrorBody, "description": "Too many streams are open"}}
PROVIDER_FAILED: Responses = {503: {"model": ErrorBody, "description": "The provider of identities can't be used now"}}
TOO_MANY: Responses = {429: {"model": ErrorBody, "description": "Too many wrong tokens"}}


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
            for problem in error.errors()
        ]
        return JSONResponse({"detail": problems}, status_code=422)
