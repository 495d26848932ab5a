"""The deployment bundle of a checkpoint, made while somebody waits for it."""

import asyncio
import io
import zipfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from server.checkpoints.repository import CheckpointRepository
from server.services import Services


@pytest.fixture
def store(client: TestClient, services: Services, job_worker: None) -> Callable[[bytes], str]:
    """Registers an archive as the checkpoint of a new run and returns its id."""

    def register(archive: bytes) -> str:
        created = client.post("/api/experiments", json={"name": "Tür & Tor", "seeds": [4], "training": {}})
        run_id = created.json()["runs"][0]["id"]

        async def blocks() -> AsyncIterator[bytes]:
            yield archive

        file = asyncio.run(services.files.write("b" * 16, blocks()))
        with services.database.write() as session:
            CheckpointRepository(session).add(run_id, 81_920, file, None)
        return file.id

    return register


def test_a_checkpoints_bundle_is_complete_and_checked(
    client: TestClient, store: Callable[[bytes], str], make_checkpoint: Callable[..., Path]
) -> None:
    checkpoint_id = store(make_checkpoint().read_bytes())

    response = client.get(f"/api/checkpoints/{checkpoint_id}/bundle")

    assert response.status_code == 200
    assert response.headers["content-type"] == "application/zip"
    assert 'filename="mapless-tur-tor-seed4-step81920-bundle.zip"' in response.headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(response.content)) as bundle:
        assert bundle.testzip() is None
        names = {name.removeprefix("mapless-policy/") for name in bundle.namelist()}
        readme = bundle.read("mapless-policy/README.md").decode()
    assert {"policy.onnx", "manifest.json", "run_policy.py", "ros2/mapless_navigator/package.xml"} <= names
    assert "Checked against the trained network over 1,000 random observations" in readme


def test_a_damaged_archive_is_not_exported(client: TestClient, store: Callable[[bytes], str]) -> None:
    checkpoint_id = store(b"not an archive")

    response = client.get(f"/api/checkpoints/{checkpoint_id}/bundle")

    assert response.status_code == 500
    assert response.json()["detail"].startswith("The policy was not exported: checkpoint.zip is not a readable archive")


def test_there_is_no_bundle_of_an_unknown_checkpoint(client: TestClient) -> None:
    response = client.get("/api/checkpoints/0123456789abcdef/bundle")

    assert response.status_code == 404
