"""What alerts are sent to in tests: an HTTP and an SMTP server on this machine, which remember what they took."""

import asyncio
import contextlib
import email
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from email.message import Message
from typing import Any


@dataclass
class HttpReceiver:
    """Answers every POST with the next of `answers`, with the last one for ever.

    Attributes:
        answers: statuses, each with its headers.
        taken: what came: path, headers in lower case, body.
        silent: whether it says nothing at all.
    """

    answers: list[tuple[int, str]] = field(default_factory=lambda: [(204, "")])
    taken: list[tuple[str, dict[str, str], bytes]] = field(default_factory=list)
    silent: bool = False
    port: int = 0

    def url(self, host: str = "127.0.0.1") -> str:
        return f"http://{host}:{self.port}/hook?a=1"

    @property
    def said(self) -> list[dict[str, Any]]:
        return [json.loads(body) for _, _, body in self.taken]

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode().split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in head[1:] if line)}
        body = await reader.readexactly(int(headers.get("content-length", "0")))
        self.taken.append((head[0].split(" ")[1], headers, body))
        if not self.silent:
            status, extra = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
            writer.write(f"HTTP/1.1 {status} Said\r\n{extra}Content-Length: 0\r\nConnection: close\r\n\r\n".encode())
            await writer.drain()
            writer.close()


@dataclass
class SmtpReceiver:
    """Takes every mail that is not for somebody whom it refuses."""

    refused: str = "nobody@example.org"
    taken: list[Message] = field(default_factory=list)
    port: int = 0

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def say(line: str) -> None:
            writer.write(f"{line}\r\n".encode())

        say("220 here")
        while line := (await reader.readline()).decode().strip():
            command = line.upper()
            if command.startswith("RCPT TO") and self.refused in line:
                say("550 there is nobody of that name")
            elif command == "DATA":
                say("354 go on")
                text = await reader.readuntil(b"\r\n.\r\n")
                self.taken.append(email.message_from_bytes(text[:-5]))
                say("250 taken")
            elif command == "QUIT":
                say("221 bye")
                break
            else:
                say("250 fine")
        with contextlib.suppress(ConnectionError):
            await writer.drain()
        writer.close()


@asynccontextmanager
async def listening(receiver: HttpReceiver | SmtpReceiver) -> AsyncIterator[None]:
    """The receiver listens on a free port meanwhile."""
    server = await asyncio.start_server(receiver.serve, "127.0.0.1", 0)
    receiver.port = server.sockets[0].getsockname()[1]
    try:
        yield
    finally:
        server.close()
