"""A PostgreSQL that is not up yet, or that can't hold every name."""

import socket
import threading
import time
import uuid
from collections.abc import Iterator

import psycopg
import pytest
from sqlalchemy import make_url, text

from server.app import create_services
from server.database.engine import UnusableDatabaseError
from server.database.migrate import UnreachableDatabaseError
from server.settings import Settings
from tests.conftest import POSTGRES, require_service

pytestmark = pytest.mark.services


@pytest.fixture
def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port: int = nobody.getsockname()[1]
        return port


@pytest.fixture(params=["SQL_ASCII", "LATIN1"])
def narrow_url(request: pytest.FixtureRequest) -> Iterator[str]:
    """A database that keeps text otherwise."""
    require_service("PostgreSQL", *POSTGRES)
    host, port = POSTGRES
    name = f"mapless_test_{uuid.uuid4().hex[:12]}"
    create = f"CREATE DATABASE {name} ENCODING '{request.param}' LC_COLLATE 'C' LC_CTYPE 'C' TEMPLATE template0"
    with psycopg.connect(host=host, port=port, user="postgres", dbname="postgres", autocommit=True) as connection:
        connection.execute(create.encode())
        try:
            yield f"postgresql+psycopg://postgres@{host}:{port}/{name}"
        finally:
            connection.execute(f"DROP DATABASE {name} WITH (FORCE)".encode())


def pass_on(source: socket.socket, target: socket.socket) -> None:
    """What one side says to the other, until it has said all."""
    try:
        while data := source.recv(65_536):
            target.sendall(data)
        target.shutdown(socket.SHUT_WR)
    except OSError:
        return


def come_up(port: int, after: float) -> None:
    """The database server listens at this port from now on, for one connection."""
    time.sleep(after)
    with socket.create_server(("127.0.0.1", port)) as listener:
        listener.settimeout(30)
        near, _ = listener.accept()
        with near, socket.create_connection(POSTGRES) as far:
            back = threading.Thread(target=pass_on, args=(far, near))
            back.start()
            pass_on(near, far)
            back.join()


def test_a_database_server_that_is_not_up_yet_is_waited_for_and_said_so(
    settings: Settings, empty_postgres_url: str, free_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    url = make_url(empty_postgres_url).set(port=free_port).render_as_string()
    server = threading.Thread(target=come_up, args=(free_port, 1.0))
    server.start()
    services = create_services(settings.model_copy(update={"database_url": url, "database_wait_seconds": 60.0}))
    with services.database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM runs")) == 0
    services.database.dispose()
    server.join()
    (line,) = [record.getMessage() for record in caplog.records if record.name == "server.database.migrate"]
    assert "can't be used yet" in line
    assert "Trying for 60 s" in line


def test_one_that_does_not_come_up_is_given_up(settings: Settings, free_port: int) -> None:
    url = f"postgresql+psycopg://postgres@127.0.0.1:{free_port}/x"
    begun = time.monotonic()
    with pytest.raises(UnreachableDatabaseError, match="can't be used"):
        create_services(settings.model_copy(update={"database_url": url, "database_wait_seconds": 1.0}))
    assert time.monotonic() - begun >= 1.0


def test_one_that_does_not_keep_every_character_is_refused_with_what_to_do(settings: Settings, narrow_url: str) -> None:
    with pytest.raises(UnusableDatabaseError, match="createdb --encoding UTF8"):
        create_services(settings.model_copy(update={"database_url": narrow_url}))
