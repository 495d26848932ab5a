"""What the event loop does in a turn where it is busy: take in all who connect, and hang up on nobody who asks."""

import asyncio
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn
import uvloop
from starlette.types import Receive, Scope, Send

from server.http.slow_clients import timed_protocol
from server.processes.listening import accepting

PATIENCE = 20.0


def test_many_who_connect_at_once_are_taken_in_a_few_turns() -> None:
    async def turns(listener: socket.socket, clients: int) -> int:
        taken = 0

        class Taken(asyncio.Protocol):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                nonlocal taken
                taken += 1

        loop = asyncio.get_running_loop()
        servers = [await loop.create_server(Taken, sock=each) for each in accepting(listener)]
        connected = [socket.create_connection(listener.getsockname()) for _ in range(clients)]
        turn = 0
        while taken < clients:
            await asyncio.sleep(0)
            turn += 1
        for each in connected:
            each.close()
        for server in servers:
            server.close()
        return turn

    with socket.create_server(("127.0.0.1", 0), backlog=100) as listener:
        assert uvloop.run(turns(listener, 64)) <= 10


async def _answer(scope: Scope, receive: Receive, send: Send) -> None:
    """Answers; after `/busy` the loop stands still for a while, as it does while it reads from many sockets."""
    if scope["type"] != "http":
        return
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body"})
    if scope["path"] == "/busy":
        ringing, rung = socket.socketpair()
        loop = asyncio.get_running_loop()

        def read() -> None:
            time.sleep(1.5)
            loop.remove_reader(rung)
            rung.close()

        loop.add_reader(rung, read)
        ringing.close()


@contextmanager
def served(kept_seconds: int) -> Iterator[tuple[str, int]]:
    """An application on uvloop whose connections are kept for so long."""
    config = uvicorn.Config(
        _answer,
        lifespan="off",
        log_config=None,
        http=timed_protocol(PATIENCE),
        loop="uvloop",
        timeout_keep_alive=kept_seconds,
    )
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            yield listener.getsockname()
        finally:
            server.should_exit = True
            thread.join(PATIENCE)


def test_who_asks_on_a_kept_connection_while_the_loop_is_busy_is_answered() -> None:
    with (
        served(kept_seconds=1) as address,
        socket.create_connection(address) as kept,
        socket.create_connection(address) as busy,
    ):
        kept.settimeout(PATIENCE)
        kept.sendall(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n")
        assert kept.recv(1000).startswith(b"HTTP/1.1 204 ")
        busy.sendall(b"GET /busy HTTP/1.1\r\nHost: here\r\n\r\n")
        time.sleep(0.5)
        # It lies there when the time of the connection is up.
        kept.sendall(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n")
        assert kept.recv(1000).startswith(b"HTTP/1.1 204 ")
        # Nobody asks any more: it ends.
        assert kept.recv(1000) == b""
