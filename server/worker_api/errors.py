"""Errors of the worker API; both belong to the service's tree (`server.errors`)."""

from server.errors import ServiceError


class TooEarlyError(ServiceError):
    """A checkpoint came ahead of the metrics that precede it: send it again once they are acknowledged."""

    status = 425


class MalformedUploadError(ServiceError):
    """The body of an upload does not begin with its description."""

    status = 422
