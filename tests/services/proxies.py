"""Caddy and nginx with TLS in front of a service, as docs/proxies sets them up, at the root of a host or below a path."""

import shutil
import ssl
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from tests.conftest import require_program
from tests.services.stack import until

FILES = Path(__file__).parents[2] / "docs" / "proxies"


@dataclass(frozen=True)
class Way:
    """How a proxy leads to a service.

    Attributes:
        program: of the proxy.
        path: below which the service is; empty for the root of the host.
        keeps: whether the proxy passes the path on, as in docs/proxies, or takes it off.
    """

    program: str
    path: str = ""
    keeps: bool = True

    def __str__(self) -> str:
        return self.program + (self.path and f"{self.path}{'' if self.keeps else ' taken off'}")


@dataclass(frozen=True)
class Certificate:
    """Of localhost, and its key."""

    pem: Path
    key: Path

    @property
    def trust(self) -> ssl.SSLContext:
        """For whoever has to believe it."""
        return ssl.create_default_context(cafile=str(self.pem))


def certificate(directory: Path) -> Certificate:
    """A new one."""
    made = Certificate(directory / "mapless.pem", directory / "mapless.key")
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"]
    subprocess.run([*command, "-keyout", made.key, "-out", made.pem, *subject], check=True, capture_output=True)
    return made


def replaced(text: str, *pairs: tuple[str, str]) -> str:
    """A file of docs/proxies with other names in it; all that is replaced must be there."""
    for before, after in pairs:
        assert before in text
        text = text.replace(before, after)
    return text


def caddy(directory: Path, way: Way, port: int, behind: int, own: Certificate) -> list[str]:
    """The command that runs docs/proxies/Caddyfile with another name, port and certificate."""
    text = (FILES / "Caddyfile").read_text()
    if way.path:
        # What the comment says.
        kept = "reverse_proxy /mapless* 127.0.0.1:8400"
        below = kept if way.keeps else "handle_path /mapless* {\n\t\treverse_proxy 127.0.0.1:8400\n\t}"
        assert f"# {kept}" in text
        text = replaced(text, ("\treverse_proxy 127.0.0.1:8400", f"\t{below.replace('/mapless', way.path)}"))
    text = replaced(
        text,
        ("mapless.lab.example {", f"https://localhost:{port} {{\n\ttls {own.pem} {own.key}"),
        ("127.0.0.1:8400", f"127.0.0.1:{behind}"),
    )
    # Nothing outside of this test: no other port, no certificate authority.
    (directory / "Caddyfile").write_text(f"{{\n\tadmin off\n\tauto_https disable_redirects\n}}\n{text}")
    return ["caddy", "run", "--adapter", "caddyfile", "--config", str(directory / "Caddyfile")]


def nginx(directory: Path, way: Way, port: int, behind: int, own: Certificate) -> list[str]:
    """The command that runs docs/proxies/nginx.conf with another name, port and certificate."""
    text = (FILES / "nginx.conf").read_text()
    if way.path:
        assert '"location /mapless/ {"' in text
        text = replaced(text, ("    location / {", f"    location {way.path}/ {{"))
        if not way.keeps:
            text = replaced(text, ("proxy_pass http://127.0.0.1:8400;", "proxy_pass http://127.0.0.1:8400/;"))
    text = replaced(
        text,
        ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
        ("mapless.lab.example", "localhost"),
        ("/etc/ssl/certs/mapless.pem", str(own.pem)),
        ("/etc/ssl/private/mapless.key", str(own.key)),
        ("127.0.0.1:8400", f"127.0.0.1:{behind}"),
    )
    places = "".join(
        f"{kind}_temp_path {directory / kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    process = f"daemon off;\npid {directory / 'pid'};\nerror_log stderr;\nevents {{}}\n"
    (directory / "nginx.conf").write_text(f"{process}http {{\naccess_log off;\n{places}{text}}}\n")
    return ["nginx", "-c", str(directory / "nginx.conf"), "-e", "stderr"]


_COMMANDS: Mapping[str, Callable[..., list[str]]] = {"caddy": caddy, "nginx": nginx}


def settings_behind(way: Way, port: int) -> dict[str, str]:
    """What docs/security.md tells a service behind a proxy, as environment variables."""
    known = {"MAPLESS_PUBLIC_URL": f"https://localhost:{port}{way.path}"}
    if not way.path:
        known = {"MAPLESS_ALLOWED_HOSTS": '["localhost"]'}
    return {"MAPLESS_TRUSTED_PROXIES": '["127.0.0.1"]', **known}


@contextmanager
def proxy(
    directory: Path, way: Way, port: int, behind: int, own: Certificate, environment: Mapping[str, str]
) -> Iterator[None]:
    """A proxy that listens on a port of localhost, and passes on to the service on another, which is there.

    The test skips where the program is not installed.
    """
    require_program(way.program)
    directory.chmod(0o755)  # nginx's own user looks for its folders here
    command = _COMMANDS[way.program](directory, way, port, behind, own)
    with (directory / "proxy.log").open("wb") as log:
        process = subprocess.Popen(
            [shutil.which(command[0]) or command[0], *command[1:]],
            env={**environment, "XDG_DATA_HOME": str(directory), "XDG_CONFIG_HOME": str(directory)},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    try:

        def answers() -> bool:
            assert process.poll() is None, (directory / "proxy.log").read_text()
            return httpx.get(f"https://localhost:{port}{way.path}/healthz", verify=own.trust).status_code == 200

        until(answers)
        yield
    finally:
        process.terminate()
        process.wait()
