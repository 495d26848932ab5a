"""Behind a proxy with TLS, as docs/proxies sets it up: a worker that knows only the proxy, views, events, guesses."""

import asyncio
import json
import os
import ssl
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.asyncio.client import connect
from websockets.typing import Origin, Subprotocol

from server.live.page import VISER_PROTOCOL
from tests.services.proxies import Way, certificate, proxy, settings_behind
from tests.services.stack import ROLLOUT, TOKEN, Service, assert_one_unbroken_curve, free_port, until


@dataclass
class Proxied:
    """A service, and where its proxy listens."""

    service: Service
    url: str
    trust: ssl.SSLContext

    def client(self, address: str = "127.0.0.1") -> httpx.Client:
        """A browser at an address of this machine."""
        transport = httpx.HTTPTransport(verify=self.trust, local_address=address)
        return httpx.Client(base_url=self.url, transport=transport, timeout=30)


WAYS = (Way("caddy"), Way("nginx"), Way("caddy", "/mapless"), Way("nginx", "/tools/mapless"))


@pytest.fixture(scope="module", params=WAYS, ids=str)
def proxied(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxied]:
    way: Way = request.param
    directory = tmp_path_factory.mktemp("proxied")
    own, port = certificate(directory), free_port()
    service = Service(directory, SSL_CERT_FILE=str(own.pem), **settings_behind(way, port))
    try:
        service.start_server()
        with proxy(directory, way, port, service.port, own, service.environment):
            yield Proxied(service, f"https://localhost:{port}{way.path}", own.trust)
    finally:
        service.close()


def origin(proxied: Proxied) -> str:
    """As a browser has it: without the path."""
    parts = urlsplit(proxied.url)
    return f"{parts.scheme}://{parts.netloc}"


@pytest.mark.services
def test_a_worker_that_knows_the_proxy_only_trains_and_is_watched(proxied: Proxied) -> None:
    service = proxied.service
    # Its link is a WebSocket, its checkpoints are uploads.
    service.environment["MAPLESS_SERVER_URL"] = proxied.url
    service.start_worker()
    (run_id,) = service.launch(20 * ROLLOUT, save_every=10 * ROLLOUT)
    service.until_state(run_id, "running")

    async def first_frame() -> bytes:
        url = f"{proxied.url.replace('https', 'wss')}/live/{run_id}"
        login = {"Authorization": f"Bearer {TOKEN}"}
        async with connect(
            url,
            ssl=proxied.trust,
            subprotocols=[Subprotocol(VISER_PROTOCOL)],
            additional_headers=login,
            origin=Origin(origin(proxied)),
        ) as scene:
            return await asyncio.wait_for(scene.recv(decode=False), 60)

    assert asyncio.run(first_frame())
    assert service.until_state(run_id, "completed")["step"] == 20 * ROLLOUT
    assert_one_unbroken_curve(service, run_id)
    archive = service.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"][0]
    with proxied.client() as browser:
        downloaded = browser.get(f"/api/checkpoints/{archive['id']}/download", headers={"Authorization": f"Bearer {TOKEN}"})
    assert len(downloaded.content) == archive["size"]


@pytest.mark.services
def test_pages_hear_of_a_launch_at_once(proxied: Proxied) -> None:
    heard = threading.Event()

    def listen(browser: httpx.Client) -> None:
        with browser.stream("GET", "/api/events", headers={"Authorization": f"Bearer {TOKEN}"}) as stream:
            for line in stream.iter_lines():
                if line.startswith("data:") and "experiment" in line:
                    heard.set()
                    return

    with proxied.client() as browser:
        listener = threading.Thread(target=listen, args=(browser,), daemon=True)
        listener.start()

        def launched_and_heard() -> bool:
            # A stream that is only just being opened misses what was before.
            proxied.service.launch(ROLLOUT)
            return heard.wait(1.0)

        until(launched_and_heard, seconds=20)
        listener.join()


@pytest.mark.services
def test_the_login_is_encrypted_and_guesses_count_for_who_guesses(proxied: Proxied) -> None:
    with proxied.client() as owner:
        answer = owner.post("/api/login", json={"token": TOKEN}, headers={"Origin": origin(proxied)})
        assert answer.status_code == 204
        assert "secure" in answer.headers["set-cookie"].lower()
        assert owner.get("/api/status").status_code == 200

    with proxied.client("127.0.0.2") as guesser, proxied.client("127.0.0.3") as other:
        # What a client says of itself counts for nothing.
        guesses = [
            guesser.post("/api/login", json={"token": f"wrong{n}"}, headers={"X-Forwarded-For": f"10.0.0.{n}"}).status_code
            for n in range(12)
        ]
        assert guesses == [401] * 10 + [429] * 2
        assert other.post("/api/login", json={"token": "wrong"}).status_code == 401


@pytest.mark.services
def test_an_upload_is_refused_by_mapless_not_by_the_proxy(proxied: Proxied) -> None:
    with proxied.client() as browser:
        answer = browser.post(
            "/api/arenas", content=b"x" * 3_000_000, headers={"Authorization": f"Bearer {TOKEN}", "Origin": origin(proxied)}
        )
    assert json.loads(answer.content)["detail"]


@pytest.mark.services
def test_the_client_and_the_doctor_know_the_address_of_the_proxy(proxied: Proxied) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**proxied.service.environment, "PATH": path, "MAPLESS_URL": f"{proxied.url}/", "MAPLESS_TOKEN": TOKEN}

    def mapless(*arguments: str) -> str:
        return subprocess.run(["mapless", *arguments], env=environment, check=True, capture_output=True, text=True).stdout

    (run_id,) = proxied.service.launch(ROLLOUT)
    (listed, *_) = map(json.loads, mapless("runs", "--json").splitlines())
    assert listed["id"] == proxied.service.run(run_id)["experiment_id"]
    if "MAPLESS_PUBLIC_URL" in environment:
        assert f"{proxied.url} leads to it" in mapless("doctor")
        environment["MAPLESS_PUBLIC_URL"] += "/elsewhere"
        with pytest.raises(subprocess.CalledProcessError) as refused:
            mapless("doctor")
        assert "something else answers" in refused.value.stdout
