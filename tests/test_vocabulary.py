"""The table of words in docs/architecture.md: each is where it says, and names that were given up are used nowhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"
CODE = {"sim": "*.py", "workers": "*.py", "server": "*.py", "benchmarks": "*.py", "web/src": "*.ts*", "docs": "*.md"}
QUOTED = re.compile(r"`([^`]+)`")


def rows() -> dict[str, tuple[str, str, str]]:
    """Meaning, rooms and former names of each word."""
    section = PAGE.read_text("utf-8").split("\n## Words\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")][2:]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {word: (meaning, where, former) for word, meaning, where, former in cells}


def sources() -> dict[str, str]:
    """All code and pages but this table, and migrations, which are never rewritten."""
    files = [path for folder, pattern in CODE.items() for path in (ROOT / folder).rglob(pattern)]
    kept = [path for path in files if not {"migrations", "node_modules"} & set(path.parts)]
    texts = {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in kept}
    texts["docs/architecture.md"] = texts["docs/architecture.md"].split("\n## Words\n")[0]
    return texts


@pytest.mark.parametrize("word", rows())
def test_a_word_means_one_thing_and_is_where_the_table_says(word: str) -> None:
    meaning, where, _ = rows()[word]
    assert len(meaning.split()) >= 4
    rooms = QUOTED.findall(where)
    assert rooms
    assert [room for room in rooms if not (ROOT / room).exists()] == []


def test_a_word_that_is_a_name_in_code_is_found_there() -> None:
    for word, (_, where, _) in rows().items():
        for name in QUOTED.findall(word):
            room = ROOT / QUOTED.findall(where)[0]
            assert re.search(name.replace("X", r"\w+"), room.read_text("utf-8")), f"{name} is not in {room}"


def test_names_that_were_given_up_are_used_nowhere() -> None:
    given_up = {name for _, _, former in rows().values() for name in QUOTED.findall(former)}
    assert len(given_up) >= 10
    pattern = re.compile(rf"\b({'|'.join(map(re.escape, sorted(given_up)))})\b")
    found = {file: sorted(set(pattern.findall(text))) for file, text in sources().items() if pattern.search(text)}
    assert found == {}
