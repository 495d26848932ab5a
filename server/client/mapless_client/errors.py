"""What may go wrong between a client and its server.

ClientError
 ├─ UnreachableError       nobody answers at the address
 ├─ DamagedDownloadError   what arrived is not what the server has
 └─ RefusedError           the server says no: `status`, and its sentence
     ├─ UnauthorizedError  401: no token, or one that is not known
     ├─ ForbiddenError     403: the token may not
     ├─ NotFoundError      404: no such thing, or one that the token may not see
     ├─ ConflictError      409: not in this state
     └─ InvalidRequestError  400, 422: the fields are named
"""


class ClientError(Exception):
    """Base of all of them."""


class UnreachableError(ClientError):
    """Nobody answers at the server's address."""


class DamagedDownloadError(ClientError):
    """What arrived does not have the SHA-256 that the server names; nothing of it was kept."""


class RefusedError(ClientError):
    """The server says no.

    Args:
        status: of the answer.
        message: the server's sentence.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class UnauthorizedError(RefusedError):
    """No token, or one that the server does not know."""


class ForbiddenError(RefusedError):
    """The token's scope or role is too small."""


class NotFoundError(RefusedError):
    """There is no such thing, or the token may not see it."""


class ConflictError(RefusedError):
    """Not in this state."""


class InvalidRequestError(RefusedError):
    """Something in the request makes no sense; the message names the fields."""


BY_STATUS: dict[int, type[RefusedError]] = {
    400: InvalidRequestError,
    401: UnauthorizedError,
    403: ForbiddenError,
    404: NotFoundError,
    409: ConflictError,
    422: InvalidRequestError,
}
