"""Fixtures that tests of several packages share."""

import os
import socket
import uuid
from collections.abc import Iterator

import psycopg
import pytest

POSTGRES = ("127.0.0.1", 5432)


def require_service(name: str, host: str, port: int) -> None:
    """Skip the test where nobody listens; with REQUIRE_SERVICES=1 that is an error: CI must have run it."""
    try:
        socket.create_connection((host, port), timeout=2).close()
    except OSError as error:
        message = f"{name} does not answer on {host}:{port}: {error}"
        if os.environ.get("REQUIRE_SERVICES") == "1":
            pytest.fail(message)
        pytest.skip(message)


@pytest.fixture
def postgres_url() -> Iterator[str]:
    """SQLAlchemy URL of an empty PostgreSQL database that is gone after the test."""
    require_service("PostgreSQL", *POSTGRES)
    host, port = POSTGRES
    name = f"mapless_test_{uuid.uuid4().hex[:12]}"
    with psycopg.connect(host=host, port=port, user="postgres", dbname="postgres", autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"'.encode())
        try:
            yield f"postgresql+psycopg://postgres@{host}:{port}/{name}"
        finally:
            connection.execute(f'DROP DATABASE "{name}" WITH (FORCE)'.encode())
