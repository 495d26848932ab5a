"""What the pages under docs/ claim stands in the code: tests that are named exist, settings are listed as they are."""

import ast
import re
from pathlib import Path

import pytest

from server.settings import Settings
from server.written.settings_page import page
from workers.runtime.settings import WorkerSettings

ROOT = Path(__file__).parents[1]
NAMED = re.compile(r"(tests/[\w/]+\.py)(?:::(test_\w+))?")


def named_tests(text: str) -> list[tuple[str, str]]:
    return [(match[1], match[2] or "") for match in NAMED.finditer(text)]


def names_in(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}


@pytest.mark.parametrize("doc", sorted(path.name for path in (ROOT / "docs").glob("*.md")))
def test_the_tests_that_a_page_names_exist(doc: str) -> None:
    text = (ROOT / "docs" / doc).read_text(encoding="utf-8")
    for file, name in named_tests(text):
        assert (ROOT / file).is_file(), f"{doc} names {file}"
        assert not name or name in names_in(ROOT / file), f"{doc} names {name} of {file}"


@pytest.mark.parametrize(
    ("doc", "head", "least"), [("security.md", "| threat ", 25), ("reliability.md", "| fault | what holds", 18)]
)
def test_every_claim_names_its_test(doc: str, head: str, least: int) -> None:
    """Of the threat model, and of the faults that were found once."""
    tables = (ROOT / "docs" / doc).read_text(encoding="utf-8").split("\n\n")
    claims = [line for table in tables if table.startswith(head) for line in table.splitlines()[2:]]

    assert len(claims) >= least
    for claim in claims:
        threat, defence, tests = (cell.strip() for cell in claim.strip("|").split("|"))
        assert threat
        assert defence
        assert [name for _, name in named_tests(tests) if name], f"no test: {threat}"


def test_the_page_of_settings_says_what_the_code_says() -> None:
    text = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")

    assert text == page(), "python -m server.written.settings_page docs/settings.md"
    for model in (Settings, WorkerSettings):
        assert all(f"`MAPLESS_{name.upper()}`" in text for name in model.model_fields)
