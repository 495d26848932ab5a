"""How the suites were made: `python -m sim.suites.builder NAME` writes the file again, byte for byte.

With `--arenas` it writes a suite of files that bring a start and a target each.

The scenarios come from a generator that is seeded by the suite's name and used for nothing else, and generated maps from
seeds that no training draws, so they are no part of any training.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from sim.arenas.files import load_arena
from sim.config import ArenaConfig, ArenaFile, MoversConfig
from sim.errors import SuiteError
from sim.suites import GeneratedPlace, build_places, content_hash, suite_places
from sim.suites.scenarios import COLUMNS, draw_scenarios, own_scenarios

_FOLDER = Path(__file__).parent / "data"

_DECIMALS = 4  # of geometry in files, metres

_SUITES: dict[str, tuple[tuple[ArenaConfig | GeneratedPlace, ...], int]] = {
    "simple-200": ((ArenaConfig(name="simple"),), 200),
    "complex-200": ((ArenaConfig(name="complex"),), 200),
    "clutter-500": (suite_places("clutter", 0.5, 50), 500),
    "crowd-200": (suite_places("clutter", 0.3, 40, MoversConfig(count=4, kind="pedestrian", speed=1.0)), 200),
}

# Arenas that bring a start and a target each: their geometry is in the suite's file.
_OWN_SCENARIOS = ("barn-20",)


def build_suite(name: str) -> str:
    """The text of a frozen suite's file.

    Raises:
        SuiteError: there is no suite of this name.
    """
    if name in _OWN_SCENARIOS:
        frozen = json.loads((_FOLDER / f"{name}.json").read_text("utf-8"))
        return suite_text(name, [ArenaFile.model_validate(arena) for arena in frozen["arenas"]])
    if name not in _SUITES:
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join((*_SUITES, *_OWN_SCENARIOS))}")
    places, count = _SUITES[name]
    arenas = build_places(places)
    scenarios = draw_scenarios(name, arenas, count)
    content = {
        "name": name,
        "hash": content_hash(arenas, scenarios),
        "arenas": [place.model_dump(mode="json", exclude=_left_out(place)) for place in places],
        "columns": list(COLUMNS),
    }
    return f"{json.dumps(content, indent=1)[:-2]},\n{_rows(scenarios)}"


def suite_text(name: str, documents: Sequence[ArenaFile]) -> str:
    """The text of the file of a suite of arenas with a start and a target each, one arena a line; see `sim.suites.suite_of`.

    Raises:
        PlacementError: an arena has no start or target, or they have no room for the robot.
    """
    documents = [_rounded(document) for document in documents]
    scenarios = own_scenarios(documents)
    head = {"name": name, "hash": content_hash(build_places(documents), scenarios)}
    arenas = ",\n".join(f"  {document.model_dump_json(exclude_defaults=True)}" for document in documents)
    columns = json.dumps(list(COLUMNS))
    return f'{json.dumps(head, indent=1)[:-2]},\n "arenas": [\n{arenas}\n ],\n "columns": {columns},\n{_rows(scenarios)}'


def _rounded(document: ArenaFile) -> ArenaFile:
    """An arena to a tenth of a millimetre, as people would write it."""
    rounded = json.loads(document.model_dump_json(), parse_float=lambda number: round(float(number), _DECIMALS))
    return ArenaFile.model_validate(rounded)


def _rows(scenarios: list[list[float]]) -> str:
    rows = ",\n".join(f"  {json.dumps(row)}" for row in scenarios)
    return f' "scenarios": [\n{rows}\n ]\n}}\n'


def _left_out(place: ArenaConfig | GeneratedPlace) -> set[str]:
    """Files of suites in which nothing moves are as they were before anything could."""
    return set() if place.movers.count else {"movers"}


def main() -> None:
    """Write the files of suites: of those named, of all when none is, or of a new one from arena files."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("names", nargs="*", default=[*_SUITES, *_OWN_SCENARIOS])
    parser.add_argument(
        "--arenas", nargs="+", type=Path, help="files with a start and a target each, for a suite of this name"
    )
    options = parser.parse_args()
    for name in options.names:
        text = suite_text(name, [load_arena(path) for path in options.arenas]) if options.arenas else build_suite(name)
        (_FOLDER / f"{name}.json").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
