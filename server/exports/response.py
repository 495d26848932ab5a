"""A bundle on its way to a browser; nothing of it stays, whether it arrives or not."""

from fastapi.responses import FileResponse
from starlette.types import Receive, Scope, Send

from server.exports.service import BundleFile


class BundleResponse(FileResponse):
    """Sends a bundle and removes it.

    Args:
        bundle: to send.
    """

    def __init__(self, bundle: BundleFile) -> None:
        super().__init__(bundle.path, media_type="application/zip", filename=bundle.file_name)
        self._bundle = bundle

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it, and remove it also where the client has left."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._bundle.discard()
