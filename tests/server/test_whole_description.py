"""Every operation of the description, asked with what it allows and what it does not, one by one and one after another.

`EXAMPLES=100 make test ARGS=tests/server/test_whole_description.py` asks for longer.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from server.app import create_app
from server.jobs import waiting
from server.settings import Settings
from tests.server.furnished import Furnished, furnished

ROOT = Path(__file__).parents[2]
SCHEMATHESIS = (sys.executable, "-m", "schemathesis.cli", "--no-color")
EXAMPLES = int(os.environ.get("EXAMPLES", "3"))
"""Requests of each operation, and walks from one operation to the next, as each of who asks."""

STEPS = 8
"""Operations of a walk, at most."""

NOT_ASKED = {
    "POST /api/sign-out": "ends the session that all others are asked with",
    "DELETE /api/account/sessions/{session_id}": "likewise",
}
"""Operations that are left out, each with its reason."""

CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "comes_again",
)


@pytest.fixture
def service(settings: Settings, database_url: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Furnished]:
    # Nobody works here: whoever asks for a worker's time is told so at once.
    monkeypatch.setattr(waiting, "NO_WORKER_SECONDS", 0.0)
    app = create_app(settings.model_copy(update={"database_url": database_url, "lease_seconds": 600.0}))
    with furnished(app) as service:
        yield service


def configuration(service: Furnished, who: dict[str, str]) -> str:
    """What Schemathesis reads, in TOML: whose strings, lists and tables of one line are written as JSON's are."""
    lines = [
        "continue-on-failure = true",
        "request-timeout = 30",
        "max-stream-events = 1",
        "warnings = false",
        "cache.enabled = false",
        f"generation.max-examples = {EXAMPLES}",
        'generation.database = "none"',
        "phases.examples.enabled = false",
        "phases.coverage.enabled = false",
        f"phases.stateful.max-steps = {STEPS}",
        "checks.enabled = false",
        *(f"checks.{name}.enabled = true" for name in CHECKS),
        # What 503 must say is a check of its own.
        'checks.not_a_server_error.expected-statuses = ["2xx", "3xx", "4xx", 503]',
        *(f"headers.{name} = {json.dumps(value)}" for name, value in who.items()),
    ]
    for name, values in service.there.items():
        lines += [
            f"dictionaries.{name}.values = {json.dumps(values)}",
            f'parameters."path.{name}" = {{ dictionary = "{name}", probability = 0.7 }}',
        ]
    for name in NOT_ASKED:
        lines += ["[[operations]]", f"include-name = {json.dumps(name)}", "enabled = false"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("database_url", "who", "seed"),
    [
        ("sqlite", "owner", 1),
        pytest.param("postgresql", "person", 2, marks=pytest.mark.services),
        pytest.param("postgresql", "owner", 3, marks=pytest.mark.services),
    ],
    indirect=["database_url"],
)
def test_every_answer_is_one_that_the_description_promises(service: Furnished, who: str, seed: int, tmp_path: Path) -> None:
    config = tmp_path / "schemathesis.toml"
    config.write_text(configuration(service, getattr(service, who)))
    asked = subprocess.run(
        [*SCHEMATHESIS, f"--config-file={config}", "run", f"--seed={seed}", f"{service.url}/api/openapi.json"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "SCHEMATHESIS_HOOKS": "tests.server.schemathesis_hooks"},
        capture_output=True,
        text=True,
    )
    assert asked.returncode == 0, asked.stdout + asked.stderr
