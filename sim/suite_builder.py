"""How the suites were made: `python -m sim.suite_builder NAME` writes the file again, byte for byte.

The scenarios come from a generator that is seeded by the suite's name and used for nothing else, and generated maps from
seeds that no training draws, so they are no part of any training.
"""

import json
import sys
from pathlib import Path

from sim.config import ArenaConfig
from sim.errors import SuiteError
from sim.scenarios import COLUMNS, draw_scenarios
from sim.suites import Place, build_places, content_hash, suite_places

_SUITES: dict[str, tuple[tuple[Place, ...], int]] = {
    "simple-200": ((ArenaConfig(name="simple"),), 200),
    "complex-200": ((ArenaConfig(name="complex"),), 200),
    "clutter-500": (suite_places("clutter", 0.5, 50), 500),
}


def build_suite(name: str) -> str:
    """The text of a suite's file.

    Raises:
        SuiteError: there is no suite of this name.
    """
    if name not in _SUITES:
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join(_SUITES)}")
    places, count = _SUITES[name]
    arenas = build_places(places)
    scenarios = draw_scenarios(name, arenas, count)
    content = {
        "name": name,
        "hash": content_hash(arenas, scenarios),
        "arenas": [place.model_dump(mode="json") for place in places],
        "columns": list(COLUMNS),
    }
    head = json.dumps(content, indent=1)[:-2]
    rows = ",\n".join(f"  {json.dumps(row)}" for row in scenarios)
    return f'{head},\n "scenarios": [\n{rows}\n ]\n}}\n'


def main() -> None:
    """Write the files of the suites named on the command line, of all when none is."""
    for name in sys.argv[1:] or list(_SUITES):
        path = Path(__file__).parent / "suite_data" / f"{name}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(build_suite(name), "utf-8")


if __name__ == "__main__":
    main()
