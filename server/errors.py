"""The service's errors; each carries the HTTP status that it becomes and tells the reader what to do next.

ServiceError (a sim.errors.MaplessError)   500
├── InvalidRequestError             400  the request makes no sense as a whole (a wrong Host header, say)
├── UnauthorizedError               401  no valid token
│   └── (server.people.oidc.refusals.SignInRefusedError)
├── ForbiddenError                  403  a request from a foreign page, or a token without that right
├── NotFoundError                   404  no such experiment, run, checkpoint
├── ConflictError                   409  not in this state
│   └── (server.runs.states.TransitionError)
├── TooLargeError                   413  a body over its cap
├── UnusableArenaError              422  an arena's files are refused, or it is not there to train on
├── MisplacedError                  422  something can't be where a playground's owner wants it
├── RefusedFieldError               422  a field of a form, told as FastAPI tells its own
├── CorruptUploadError              422  the bytes are not what their checksum says
├── MissingExtraError               501  a part that few need is not installed
├── TooManyAttemptsError            429  too many wrong tokens
├── JobFailedError                  500  a worker could not do what was asked for
│   ├── ExportFailedError                a policy could not be exported faithfully
│   └── ReplayFailedError                an evaluation could not be driven again
├── PartAwayError                   503  what the server needs from outside can't be reached now
│   ├── DatabaseAwayError                the database
│   └── (server.files.StoreAwayError)    an object store, which may also refuse
├── DatabaseBusyError               503  other writers take too long
├── BusyError                       503  as much of this kind of work waits as may
├── JobTimeoutError                 503  what was asked for took a worker too long
├── (server.people.oidc.refusals.ProviderUnusableError)
└── NoWorkerError                   503  no worker is there to do it
"""

from typing import ClassVar

from pydantic import BaseModel

from sim.errors import MaplessError


class ErrorBody(BaseModel):
    """The body of every error but 422 of a form, which lists its fields as FastAPI does."""

    detail: str


class ServiceError(MaplessError):
    """Base of everything that the service refuses; `status` is its HTTP status.

    Args:
        message: what is wrong, and what to do next.
        retry_after: seconds after which trying again makes sense; None where nothing better is known than `come_again`.
    """

    status = 500
    come_again: ClassVar[float | None] = None
    """Seconds after which trying again usually makes sense; None where it makes none. Every 503 has some."""

    def __init__(self, message: str, *, retry_after: float | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.retry_after = self.come_again if retry_after is None else retry_after


class InvalidRequestError(ServiceError):
    """The request makes no sense as a whole."""

    status = 400


class UnauthorizedError(ServiceError):
    """No token, or a wrong one."""

    status = 401


class ForbiddenError(ServiceError):
    """The request comes from a foreign page, or its token lacks the right."""

    status = 403


class NotFoundError(ServiceError):
    """There is no such thing (any more)."""

    status = 404

    @classmethod
    def of(cls, kind: str, identifier: str) -> "NotFoundError":
        """The usual sentence for `kind` (experiment, run, checkpoint) and its id."""
        return cls(f"There is no {kind} {identifier}; it may have been deleted.")


class ConflictError(ServiceError):
    """The thing exists, but not in a state that allows this."""

    status = 409


class TooLargeError(ServiceError):
    """A body over its cap."""

    status = 413


class UnusableArenaError(ServiceError):
    """An arena's files are refused, or it is not there to train on."""

    status = 422


class UnusableBagError(ServiceError):
    """A robot's recording can't be read, or lacks what is asked of it."""

    status = 422


class MisplacedError(ServiceError):
    """Something can't be where a playground's owner wants it, or is not there."""

    status = 422


class RefusedFieldError(ServiceError):
    """One field of a form is refused for what this installation can do.

    Args:
        location: of the field, as FastAPI names it: "body", then the names that lead to it.
        message: what is wrong with it, and what would be right.
        position: of the fault in the field's text, in characters from 0; None where all of it is meant.
    """

    status = 422

    def __init__(self, location: tuple[str, ...], message: str, position: int | None = None) -> None:
        super().__init__(message)
        self.location = location
        self.position = position


class CorruptUploadError(ServiceError):
    """The bytes that arrived are not what their checksum says."""

    status = 422


class MissingExtraError(ServiceError):
    """A part of the service that few need is not installed.

    Args:
        what: that needs it.
        extra: its name.
        instead: what to do without it.
    """

    status = 501

    def __init__(self, what: str, extra: str, instead: str) -> None:
        super().__init__(
            f"{what} needs a part that is not installed where the server runs: pip install 'mapless[{extra}]' there, "
            f"{instead}."
        )


class TooManyAttemptsError(ServiceError):
    """Too many wrong tokens from one address."""

    status = 429


class PartAwayError(ServiceError):
    """Something that the server needs from outside can't be reached now; later it may be."""

    status = 503
    come_again = 1.0


class DatabaseAwayError(PartAwayError):
    """The database can't be reached, or was lost in a transaction: none of it was kept, or all, with the answer lost."""


class DatabaseBusyError(ServiceError):
    """Other writers hold the database for too long; later they may not."""

    status = 503
    come_again = 1.0


class BusyError(ServiceError):
    """As much of this kind of work waits as may; later there is room."""

    status = 503
    come_again = 1.0


class JobFailedError(ServiceError):
    """A worker could not do what was asked for; it would fail again."""

    status = 500


class ExportFailedError(JobFailedError):
    """A checkpoint's policy could not be exported, or the export does not equal it."""


class ReplayFailedError(JobFailedError):
    """An evaluation could not be driven again."""


class JobTimeoutError(ServiceError):
    """What was asked for took too long; later it may not."""

    status = 503
    come_again = 1.0


class NoWorkerError(ServiceError):
    """No worker is there to do what was asked for."""

    status = 503
    come_again = 1.0
