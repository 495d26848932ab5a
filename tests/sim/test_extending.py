"""Extensions: which are taken, which are refused and why, and what their reward terms and arenas do."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from pydantic import Field

from sim.arenas import build_arenas
from sim.arenas.families import FAMILIES, generate_arena
from sim.arenas.families.layout import Plan
from sim.arrays import Floats
from sim.config import AddedArenaPool, RewardConfig, TaskConfig, TimeTerm
from sim.engine.rewards import evaluate, parameters_of, program_of
from sim.engine.world import World
from sim.errors import FormulaError
from sim.extending import ArenaFamily, Extension, Part, RewardTerm
from sim.extending.discovery import UsedExtension, complete, discover, missing

DECLARATION = """
from typing import Literal
from sim.extending import Extension, Field, RewardTerm

class Term(RewardTerm):
    name: Literal["{name}.term"] = Field("{name}.term", title="Term")
    formula = "speed"

extension = Extension(name="{name}", version="1.2", api=1, parts=(Term,))
"""


class GentleTerm(RewardTerm):
    """Turning faster than a limit."""

    name: Literal["lab.gentle"] = Field("lab.gentle", title="Gentle")
    limit: float = 0.5
    formula = "max(0, abs(turning_rate) - limit)"


class CountedTerm(RewardTerm):
    """A function in place of a formula."""

    name: Literal["lab.counted"] = Field("lab.counted", title="Counted")
    implementation = "tests.sim.test_extending:counted"


class PostFamily(ArenaFamily):
    """One post in the middle."""

    name: Literal["lab.post"] = Field("lab.post", title="Post")
    radius: float = Field(0.3, ge=0.1, le=1.0)
    implementation = "tests.sim.test_extending:post"


def counted(term: CountedTerm, quantities: Mapping[str, Floats], constants: Mapping[str, float]) -> Floats:
    """Steps so far; nothing to say from the fourth on."""
    with pytest.raises(ValueError, match="read-only"):
        quantities["steps"][0] = 0.0
    return np.where(quantities["steps"] < 4.0, quantities["steps"], np.float32(np.nan))


def post(plan: Plan, family: PostFamily) -> None:
    plan.circles.append((0.0, 0.0, family.radius))


def extension(*parts: type[Part], name: str = "lab", version: str = "1.0", api: int = 1) -> Extension:
    return Extension(name=name, version=version, api=api, parts=parts)


def refusal(found: object) -> str:
    (refused,) = discover([("lab", lambda: found)]).refused
    return f"{refused.name}: {refused.reason}"


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder in which Python finds packages, and forgets them afterwards."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def install(folder: Path, name: str, code: str) -> None:
    (folder / f"{name}.py").write_text(code)
    metadata = folder / f"{name}-1.2.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (metadata / "entry_points.txt").write_text(f"[mapless.extensions]\n{name} = {name}:extension\n")


def test_installed_packages_are_found_by_their_entry_point_and_a_broken_one_stands_in_nobodys_way(packages: Path) -> None:
    install(packages, "broken_lab", "import no_such_module")
    install(packages, "leaving_lab", "raise SystemExit(3)")
    install(packages, "whole_lab", DECLARATION.format(name="whole_lab"))
    found = discover()
    assert [(one.name, one.version) for one in found.extensions] == [("whole_lab", "1.2")]
    assert [(one.name, one.reason) for one in found.refused] == [
        ("broken_lab", "it can't be imported: ModuleNotFoundError: No module named 'no_such_module'"),
        ("leaving_lab", "it can't be imported: SystemExit: 3"),
    ]


def test_one_that_is_installed_and_named_in_the_setting_is_one() -> None:
    one = extension(GentleTerm)
    assert discover([("lab", lambda: one), ("lab:extension", lambda: one)]).extensions == (one,)


def test_two_of_the_same_name_are_told_apart_by_refusing_the_second() -> None:
    found = discover([("a", lambda: extension(GentleTerm)), ("b", lambda: extension(CountedTerm))])
    assert [one.parts for one in found.extensions] == [(GentleTerm,)]
    assert [(one.name, one.reason) for one in found.refused] == [
        ("lab", "there is another extension of this name: keep one of them")
    ]


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (object(), "lab: what it names is a object, not a sim.extending.Extension"),
        (extension(GentleTerm, api=2), "lab: it was written for version 2 of what extensions may use, and this Mapless has"),
        (extension(GentleTerm, name="Lab 1"), "Lab 1: its name, 'Lab 1', should be small letters"),
        (extension(GentleTerm, version=""), "lab: its version, '', should be such as 1.2"),
        (extension(GentleTerm, name="other"), "other: its reward term 'lab.gentle' should be named 'other.gentle'"),
        (extension(GentleTerm, GentleTerm), "lab: two of its parts have the name 'lab.gentle'"),
        (extension(Part), "is no part that an extension may add"),
    ],
)  # fmt: skip
def test_what_can_not_be_used_is_refused_with_the_reason(found: object, reason: str) -> None:
    assert reason in refusal(found)


def declared(**body: Any) -> type[RewardTerm]:
    annotations = {name: float for name in body if name not in ("formula", "implementation", "name")}
    annotations["name"] = body.pop("literal", Literal["lab.term"])
    name: dict[str, Any] = {"name": "lab.term", "__annotations__": annotations, "__module__": __name__}
    return type("Term", (RewardTerm,), name | body)


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        (declared(formula="speed", literal=Literal["progress"], name="progress"), "should be named 'lab.progress'"),
        (declared(formula="speed", literal=str), "needs a field name"),
        (declared(), "Term needs a formula or an implementation, one of both"),
        (declared(formula="speed", implementation="lab:one"), "one of both"),
        (declared(formula="speed * limit"), "there is no quantity 'limit'"),
        (declared(formula="speed", bearing=1.0), "has a field 'bearing', which means something else in formulas"),
        (declared(implementation="lab.one"), 'needs implementation = "package.module:name"'),
        (declared(formula="__import__('os')"), "there is no function '__import__'"),
    ],
)
def test_a_part_that_is_declared_wrongly_is_refused(part: type[Part], reason: str) -> None:
    assert reason in refusal(extension(part))


def test_a_part_without_a_default_is_refused() -> None:
    class Needy(RewardTerm):
        """Has a field that nobody fills in."""

        name: Literal["lab.needy"] = "lab.needy"
        limit: float
        formula = "speed * limit"

    assert "every field needs a default" in refusal(extension(Needy))


def test_what_is_missing_is_what_is_not_there_in_the_same_version() -> None:
    needed = (UsedExtension(name="a", version="1"), UsedExtension(name="b", version="2"))
    assert missing(needed, {"a": "1", "b": "2", "c": "3"}) == ()
    assert missing(needed, {"a": "1.1", "c": "3"}) == needed


def test_a_formula_reads_the_terms_own_numbers() -> None:
    term = GentleTerm(limit=0.4)
    worth = evaluate(program_of(term), {"turning_rate": -1.5} | parameters_of(term))
    assert worth == pytest.approx(1.1)


def test_a_family_of_an_extension_is_a_pool_that_is_drawn_from_its_seed() -> None:
    pool: Any = complete(PostFamily, AddedArenaPool)
    assert list(pool.model_fields) == ["name", "difficulty", "maps", "own_maps", "map_sampling", "seed", "movers", "radius"]
    config = pool(radius=0.5)
    arena = generate_arena(config, 0.5, 3)
    assert arena.name == "lab.post-0.5-3"
    np.testing.assert_array_equal(arena.circles, [[0.0, 0.0, 0.5]])
    assert "lab.post" not in FAMILIES


def test_a_function_pays_every_robot_that_drives_and_must_answer_for_each() -> None:
    """Steps of the attempt so far, times a weight of 0.5, beside what a compiled term pays."""
    terms = (TimeTerm(weight=-1.0), CountedTerm(weight=0.5))
    task = TaskConfig().model_copy(update={"reward": RewardConfig.model_construct(terms=terms)})
    world = World(task, build_arenas(task.arena), 2)
    world.reset(poses=np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]]), targets=np.array([[4.0, 0.0], [4.0, 2.0]]))
    for steps in (1, 2, 3):
        world.step(np.array([[0.5, 0.0], [0.5, 0.0]], np.float32))
        np.testing.assert_allclose(world.robots.rewards, 0.5 * steps - task.control_period, rtol=1e-6)
    with pytest.raises(FormulaError, match="should be 2 finite numbers, one a robot"):
        world.step(np.array([[0.5, 0.0], [0.5, 0.0]], np.float32))
