"""Errors of the worker API; both belong to the service's tree (`server.errors`)."""

from server.errors import ServiceError


class TooEarlyError(ServiceError):
    """A checkpoint came ahead of the metrics that precede it, or was too long on its way: it is to be sent again."""

    status = 425


class MalformedUploadError(ServiceError):
    """The body of an upload does not begin with its description."""

    status = 422
