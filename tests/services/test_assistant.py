"""`mapless mcp`, spoken to by the protocol's own client: tools over a real server, within the token's rights."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.services.stack import ROLLOUT, ROOT, TOKEN, Service, until

CLIENT = ROOT / "server" / "client"
# One session: calls come as JSON on standard input, the tools and what was answered go out as JSON.
SESSION = """
import asyncio, json, os, sys
from mcp import Client, StdioServerParameters

async def session(calls):
    command = StdioServerParameters(command=sys.executable, args=["-m", "mapless_client", "mcp"], env=dict(os.environ))
    async with Client(command) as client:
        tools = [tool.model_dump(mode="json") for tool in (await client.list_tools()).tools]
        answers = [(await client.call_tool(name, given)).model_dump(mode="json") for name, given in calls]
        return {"tools": tools, "answers": answers}

print(json.dumps(asyncio.run(session(json.load(sys.stdin)))))
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with what the client and the protocol need, as locked, and nothing else."""
    directory = tmp_path_factory.mktemp("assistant") / "venv"
    path = directory / "bin" / "python"
    uv = (sys.executable, "-m", "uv")
    subprocess.run([*uv, "venv", "-q", "--python", sys.executable, str(directory)], check=True)
    locked = ("--require-hashes", "-r", str(CLIENT / "requirements.txt"))
    subprocess.run([*uv, "pip", "install", "-q", "--python", str(path), *locked], check=True)
    return path


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    service = Service(tmp_path_factory.mktemp("service"))
    service.start_server()
    service.start_worker()
    yield service
    service.close()


class Assistant:
    """Sessions with a token of the service."""

    def __init__(self, python: Path, service: Service, token: str = TOKEN) -> None:
        self._python = python
        self._environment = {
            **os.environ,
            "MAPLESS_URL": service.url,
            "MAPLESS_TOKEN": token,
            "PYTHONPATH": str(CLIENT),
        }

    def session(self, *calls: tuple[str, dict[str, Any]]) -> dict[str, Any]:
        run = subprocess.run(
            [str(self._python), "-c", SESSION],
            input=json.dumps(calls),
            env=self._environment,
            cwd=self._python.parent,
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr
        answered: dict[str, Any] = json.loads(run.stdout)
        return answered

    def ask(self, *calls: tuple[str, dict[str, Any]]) -> list[dict[str, Any]]:
        answers: list[dict[str, Any]] = self.session(*calls)["answers"]
        return answers


@pytest.fixture
def assistant(python: Path, service: Service) -> Assistant:
    return Assistant(python, service)


def answer(result: dict[str, Any]) -> Any:
    assert not result["is_error"], text(result)
    content = result["structured_content"]
    return content["result"] if set(content) == {"result"} else content


def text(result: dict[str, Any]) -> str:
    return "".join(part["text"] for part in result["content"])


def test_an_assistant_launches_looks_and_compares(assistant: Assistant, service: Service) -> None:
    training = {"steps": 2 * ROLLOUT, "evaluation": {"every_steps": ROLLOUT}}
    launched = [
        answer(result)
        for result in assistant.ask(
            ("launch_training", {"name": "Asked for", "settings": training, "seeds": [3]}),
            ("launch_training", {"name": "Beside it", "settings": training | {"algorithm": {"gamma": 0.9}}}),
        )
    ]
    run = launched[0]["runs"][0]["id"]
    for experiment in launched:
        service.until_state(experiment["runs"][0]["id"], "completed")

    listed, training_now, diagnoses, curves, events, comparison = assistant.ask(
        ("list_trainings", {"query": "gamma < 0.95", "columns": ["algorithm.gamma"]}),
        ("get_training", {"training": launched[0]["id"]}),
        ("diagnose_run", {"run": run}),
        ("read_curves", {"run": run, "names": ["train/return"]}),
        ("read_events", {"run": run}),
        ("compare_trainings", {"trainings": [each["id"] for each in launched]}),
    )

    assert [(each["name"], each["settings"]) for each in answer(listed)] == [("Beside it", {"algorithm.gamma": 0.9})]
    assert answer(training_now)["state"] == "completed"
    assert answer(training_now)["runs"][0]["seed"] == 3
    assert answer(diagnoses)["run_id"] == run
    assert answer(curves)["train/return"]["steps"] == service.steps(run)
    assert answer(events)[-1]["message"] == "Completed."
    assert answer(comparison)["verdicts"][0]["word"] == "refused"
    assert json.loads(text(comparison))["differences"][0]["path"] == "algorithm.gamma"


def test_it_stops_and_resumes(assistant: Assistant, service: Service) -> None:
    (launched,) = assistant.ask(("launch_training", {"name": "Long", "settings": {"steps": 10_000 * ROLLOUT}}))
    run = answer(launched)["runs"][0]["id"]
    until(lambda: service.run(run)["state"] == "running")
    assistant.ask(("stop_training", {"training": answer(launched)["id"]}))
    service.until_state(run, "stopped")
    (resumed,) = assistant.ask(("resume_training", {"training": answer(launched)["id"]}))
    assert answer(resumed)["state"] in ("queued", "running")
    service.stop(run)


def test_what_is_refused_is_said(assistant: Assistant, python: Path, service: Service) -> None:
    wrong, absent = assistant.ask(
        ("launch_training", {"name": "Wrong", "settings": {"algorithm": {"gamma": 2.0}}}),
        ("diagnose_run", {"run": "nowhere"}),
    )
    (stranger,) = Assistant(python, service, "nobody-knows-this-token").ask(("launch_training", {"name": "Mine"}))

    for refused, sentence in ((wrong, "gamma"), (absent, "nowhere"), (stranger, "Log in first")):
        assert refused["is_error"]
        assert sentence in text(refused)
    (listed,) = assistant.ask(("list_trainings", {}))
    assert not any(each["name"] in ("Wrong", "Mine") for each in answer(listed))


def test_an_assistant_is_told_which_tools_only_read(assistant: Assistant) -> None:
    tools = assistant.session()["tools"]
    reading = {tool["name"] for tool in tools if tool["annotations"]["read_only_hint"]}

    assert {tool["name"] for tool in tools} - reading == {"launch_training", "stop_training", "resume_training"}
    assert len(tools) == 10


def test_without_the_protocols_package_it_says_what_to_install() -> None:
    run = subprocess.run([sys.executable, "-m", "server", "mcp"], cwd=ROOT, capture_output=True, text=True)

    assert run.returncode == 1
    assert run.stderr.startswith("mapless: this needs the package mcp")
