"""The `mapless` command: what it offers, what it says of itself, and what it hands on."""

import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from server.cli import app
from server.version import commit

ROOT = Path(__file__).parents[2]


def run(*arguments: str) -> tuple[int, str]:
    """Exit status, and what was printed."""
    result = CliRunner().invoke(app, arguments, prog_name="mapless", env={"COLUMNS": "200", "NO_COLOR": "1"})
    return result.exit_code, result.output


@pytest.mark.parametrize("argument", ["--version", "version"])
def test_version_and_commit(argument: str) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    status, output = run(argument)

    assert status == 0
    assert output.strip() == (f"mapless {version} ({commit()})" if commit() else f"mapless {version}")
    assert re.fullmatch(r"[0-9a-f]{7,}(-dirty)?", commit() or "0000000")


def test_help_names_every_command() -> None:
    status, output = run("--help")

    assert status == 0
    passed_on = {"train", "evaluate", "export", "reproduce", "worker"}
    assert set(re.findall(r"^\W*(\w+)  ", output, re.MULTILINE)) >= {"up", "serve", "arena", "version"} | passed_on


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("train", "--seed"),
        ("evaluate", "--suite"),
        ("export", "--format"),
        ("reproduce", "--seeds"),
        ("worker", "--concurrency"),
    ],
)
def test_the_workers_commands_explain_themselves(command: str, option: str) -> None:
    status, output = run(command, "--help")

    assert status == 0
    assert f"mapless {command}" in output
    assert option in output


def test_a_command_that_there_is_not() -> None:
    status, output = run("fly")

    assert status == 2
    assert "No such command 'fly'" in output
