"""How the suites were made: `python -m sim.suites.builder NAME` writes the file again, byte for byte.

With `--arenas` it writes a suite of files that bring a start and a target each.

The scenarios come from a generator that is seeded by the suite's name and used for nothing else, and generated maps from
seeds that no training draws, so they are no part of any training.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from sim.arenas.barn import barn_world
from sim.arenas.families import SUITE_SEEDS
from sim.arenas.files import load_arena
from sim.arenas.scenes import SCENES
from sim.config import ArenaConfig, ArenaFile, JackalConfig, MoversConfig, RoundConfig, SingleMount
from sim.errors import SuiteError
from sim.suite_rules import SuiteLidar
from sim.suites import BarnPlace, GeneratedPlace, ScenePlace, SuiteRules, build_places, content_hash, suite_places
from sim.suites.scenarios import COLUMNS, barn_scenarios, draw_scenarios, own_scenarios, scene_scenarios

_FOLDER = Path(__file__).parent / "data"

_DECIMALS = 4  # of geometry in files, metres

_SUITES: dict[str, tuple[tuple[ArenaConfig | GeneratedPlace, ...], int]] = {
    "simple-200": ((ArenaConfig(name="simple"),), 200),
    "complex-200": ((ArenaConfig(name="complex"),), 200),
    "clutter-500": (suite_places("clutter", 0.5, 50), 500),
    "crowd-200": (suite_places("clutter", 0.3, 40, MoversConfig(count=4, kind="pedestrian", speed=1.0)), 200),
}

_SCENES_EACH = 50
_PEOPLE_RULES = SuiteRules(
    robot=RoundConfig(radius=0.25, max_linear_speed=1.0, max_angular_speed=2.0),
    arrival_distance=0.3,
    collision_distance=0.0,
    lidar=SuiteLidar(rays=120, batches=60, field_of_view=360.0, range=6.0),
    time_limit=60.0,
)

# Scenes among people, and whether these see the robot.
_AMONG_PEOPLE = {"people-500": True, "heedless-500": False}

# As the BARN challenge has it, for its robot: the maker's limits, a scanner like the one on it, 1 m, 100 s.
_BARN_RULES = SuiteRules(
    robot=JackalConfig(max_linear_acceleration=20.0, max_angular_acceleration=25.0),
    arrival_distance=1.0,
    collision_distance=0.0,
    lidar=SuiteLidar(rays=135, batches=45, field_of_view=270.0, range=10.0, mount=SingleMount(x=0.055)),
    control_period=0.1,
    time_limit=100.0,
)

# Worlds of the benchmark's kind: how many, and the seed that they are drawn from, the first eight digits of the commit that
# froze the recipe of the policy trained for them (fb5bf6af).
_BARN = {"barn-jackal-300": (300, 0xFB5BF6AF)}

# Arenas that bring a start and a target each: their geometry is in the suite's file.
_OWN_SCENARIOS = ("barn-20",)

_NAMES = (*_SUITES, *_OWN_SCENARIOS, *_AMONG_PEOPLE, *_BARN)


def build_suite(name: str) -> str:
    """The text of a frozen suite's file.

    Raises:
        SuiteError: there is no suite of this name.
    """
    if name in _OWN_SCENARIOS:
        frozen = json.loads((_FOLDER / f"{name}.json").read_text("utf-8"))
        return suite_text(name, [ArenaFile.model_validate(arena) for arena in frozen["arenas"]])
    if name in _AMONG_PEOPLE:
        seeds = SUITE_SEEDS[:_SCENES_EACH]
        scenes = [ScenePlace(scene=scene, seed=seed, sees=_AMONG_PEOPLE[name]) for scene in SCENES for seed in seeds]
        return _ruled_text(name, scenes, scene_scenarios(scenes, _PEOPLE_RULES.task()), _PEOPLE_RULES)
    if name in _BARN:
        count, seed = _BARN[name]
        worlds = [BarnPlace(world=world, barn_seed=seed, attempt=barn_world(world, seed).attempt) for world in range(count)]
        return _ruled_text(name, worlds, barn_scenarios(worlds), _BARN_RULES)
    if name not in _SUITES:
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join(_NAMES)}")
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


def _ruled_text(name: str, places: Sequence[ScenePlace | BarnPlace], scenarios: list[list[float]], rules: SuiteRules) -> str:
    head = {"name": name, "hash": content_hash(build_places(places), scenarios, rules), "rules": rules.content()}
    rows = ",\n".join(f"  {place.model_dump_json()}" for place in places)
    columns = json.dumps(list(COLUMNS))
    return f'{json.dumps(head, indent=1)[:-2]},\n "arenas": [\n{rows}\n ],\n "columns": {columns},\n{_rows(scenarios)}'


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


def _left_out(place: ArenaConfig | GeneratedPlace) -> dict[str, bool | set[str]]:
    """Files of suites are as they were before anything moved, or saw a robot, where nothing does."""
    if not place.movers.count:
        return {"movers": True}
    return {} if place.movers.sees_robots else {"movers": {"sees_robots"}}


def main() -> None:
    """Write the files of suites: of those named, of all when none is, or of a new one from arena files."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("names", nargs="*", default=_NAMES)
    parser.add_argument(
        "--arenas", nargs="+", type=Path, help="files with a start and a target each, for a suite of this name"
    )
    options = parser.parse_args()
    for name in options.names:
        text = suite_text(name, [load_arena(path) for path in options.arenas]) if options.arenas else build_suite(name)
        (_FOLDER / f"{name}.json").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
