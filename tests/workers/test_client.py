"""The worker's client, where something else than the server answers."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from workers.errors import ServerUnavailableError
from workers.runtime.client import ServerClient


class _SignInPage(BaseHTTPRequestHandler):
    """A proxy that answers everything with a page of its own."""

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<html>Please sign in</html>")

    def log_message(self, *_: object) -> None:
        """Says nothing."""


@pytest.fixture
def proxy() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), _SignInPage)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_an_answer_that_is_not_the_servers_is_asked_for_again_later(proxy: str) -> None:
    with ServerClient(proxy, "token") as client:
        with pytest.raises(ServerUnavailableError, match=r"not understood \('<html>Please sign in</html>'\)"):
            client.heartbeat("w@a/0", "cpu")
        with pytest.raises(ServerUnavailableError, match="different versions"):
            client.claim("run", "w@a/0", 0, "1" * 32)
