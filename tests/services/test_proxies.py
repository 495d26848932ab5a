"""Behind a proxy with TLS, as docs/proxies sets it up: a worker that knows only the proxy, views, events, guesses."""

import asyncio
import json
import shutil
import ssl
import subprocess
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from websockets.asyncio.client import connect
from websockets.typing import Origin, Subprotocol

from server.live.page import VISER_PROTOCOL
from tests.conftest import require_program
from tests.services.stack import ROLLOUT, TOKEN, Service, assert_one_unbroken_curve, free_port, until

FILES = Path(__file__).parents[2] / "docs" / "proxies"


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


def certificate(directory: Path) -> tuple[Path, Path]:
    """A certificate for localhost, and its key."""
    pem, key = directory / "mapless.pem", directory / "mapless.key"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"]
    subprocess.run([*command, "-keyout", key, "-out", pem, *subject], check=True, capture_output=True)
    return pem, key


def caddy(directory: Path, port: int, service: Service, pem: Path, key: Path) -> list[str]:
    """The command that runs docs/proxies/Caddyfile with another name, port and certificate."""
    text = (FILES / "Caddyfile").read_text()
    assert "mapless.lab.example {" in text
    text = text.replace("mapless.lab.example {", f"https://localhost:{port} {{\n\ttls {pem} {key}").replace(
        "127.0.0.1:8400", f"127.0.0.1:{service.port}"
    )
    # Nothing outside of this test: no other port, no certificate authority.
    (directory / "Caddyfile").write_text(f"{{\n\tadmin off\n\tauto_https disable_redirects\n}}\n{text}")
    return ["caddy", "run", "--adapter", "caddyfile", "--config", str(directory / "Caddyfile")]


def nginx(directory: Path, port: int, service: Service, pem: Path, key: Path) -> list[str]:
    """The command that runs docs/proxies/nginx.conf with another name, port and certificate."""
    text = (FILES / "nginx.conf").read_text()
    for before, after in (
        ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
        ("mapless.lab.example", "localhost"),
        ("/etc/ssl/certs/mapless.pem", str(pem)),
        ("/etc/ssl/private/mapless.key", str(key)),
        ("127.0.0.1:8400", f"127.0.0.1:{service.port}"),
    ):
        assert before in text
        text = text.replace(before, after)
    places = "".join(
        f"{kind}_temp_path {directory / kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    process = f"daemon off;\npid {directory / 'pid'};\nerror_log stderr;\nevents {{}}\n"
    (directory / "nginx.conf").write_text(f"{process}http {{\naccess_log off;\n{places}{text}}}\n")
    return ["nginx", "-c", str(directory / "nginx.conf"), "-e", "stderr"]


@pytest.fixture(scope="module", params=[caddy, nginx], ids=["caddy", "nginx"])
def proxied(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxied]:
    require_program(request.param.__name__)
    directory = tmp_path_factory.mktemp("proxied")
    directory.chmod(0o755)  # nginx's own user looks for its folders here
    pem, key = certificate(directory)
    port = free_port()
    url = f"https://localhost:{port}"
    service = Service(
        directory,
        MAPLESS_TRUSTED_PROXIES='["127.0.0.1"]',
        MAPLESS_ALLOWED_HOSTS='["localhost"]',
        SSL_CERT_FILE=str(pem),
    )
    service.start_server()
    command = request.param(directory, port, service, pem, key)
    with (directory / "proxy.log").open("wb") as log:
        process = subprocess.Popen(
            [shutil.which(command[0]) or command[0], *command[1:]],
            env={**service.environment, "XDG_DATA_HOME": str(directory), "XDG_CONFIG_HOME": str(directory)},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    service.processes.append(process)
    proxied = Proxied(service, url, ssl.create_default_context(cafile=str(pem)))
    with proxied.client() as client:

        def answers() -> bool:
            assert process.poll() is None, (directory / "proxy.log").read_text()
            return client.get("/healthz").status_code == 200

        until(answers)
    yield proxied
    service.close()


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
            origin=Origin(proxied.url),
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
        answer = owner.post("/api/login", json={"token": TOKEN}, headers={"Origin": proxied.url})
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
            "/api/arenas", content=b"x" * 3_000_000, headers={"Authorization": f"Bearer {TOKEN}", "Origin": proxied.url}
        )
    assert json.loads(answer.content)["detail"]
