"""The pages on extending: what they show is taken by Mapless, and does what they say."""

import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

from sim.actions import DEFAULT_ACTIONS
from sim.arenas import build_arenas
from sim.arenas.families import generate_arena
from sim.baselines.named import controller_of
from sim.config import AddedArenaPool, AddedObservationPart, ObservationConfig, TaskConfig
from sim.engine.rewards import constants, evaluate, parameters_of, program_of
from sim.engine.world import World
from sim.extending.control import drive, load_suite
from sim.extending.discovery import complete, discover
from sim.extending.expression import QUANTITIES
from sim.observations import observation_layout
from tests.workers.test_trainer import Recorder
from workers.algorithms.added import build_added
from workers.checkpoints import read_policy
from workers.config import AddedAlgorithmConfig, EvaluationConfig, PpoConfig, TrainingConfig
from workers.extending.learning import Learner
from workers.networks.config import NETWORKS, complete_network
from workers.training.trainer import train

PAGES = Path(__file__).parents[1] / "docs" / "extending"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)

Module = Callable[[str, str], ModuleType]


@pytest.fixture
def module() -> Iterator[Module]:
    """Makes a module of code, until the test ends."""
    made = []

    def make(name: str, code: str) -> ModuleType:
        found = sys.modules[name] = ModuleType(name)
        made.append(name)
        exec(code, found.__dict__)
        return found

    yield make
    for name in made:
        del sys.modules[name]


def blocks(page: str) -> list[str]:
    return BLOCK.findall((PAGES / page).read_text(encoding="utf-8"))


def declared(make: Module, page: str, part: str) -> Any:
    """The part that the first lines of a page declare, once Mapless has taken them."""
    extension = make("my_lab", blocks(page)[0]).extension
    found = discover([("my_lab", lambda: extension)])
    assert found.refused == ()
    return extension.part(part)


def test_the_overview_declares_an_extension(module: Module) -> None:
    still = declared(module, "extensions.md", "still")()
    assert [evaluate(program_of(still), {"speed": speed} | parameters_of(still)) for speed in (0.01, 0.1)] == [1.0, 0.0]


def test_add_a_reward(module: Module) -> None:
    gentle = declared(module, "add-a-reward.md", "gentle")()
    assert evaluate(program_of(gentle), {"turning_rate": -0.9} | parameters_of(gentle)) == pytest.approx(0.4)
    jerk = module("my_lab.rewards", blocks("add-a-reward.md")[1]).jerk
    seen = {name: np.zeros(2, np.float32) for name in QUANTITIES} | {"speed": np.array([0.0, 0.1], np.float32)}
    np.testing.assert_allclose(jerk(gentle, seen, constants(TaskConfig())), [0.0, 0.25], rtol=1e-5)


def test_add_an_arena_family(module: Module) -> None:
    pool: Any = complete(declared(module, "add-an-arena-family.md", "posts"), AddedArenaPool)
    arena = generate_arena(pool(radius=0.2), 0.5, 1)
    assert arena.circles.shape == (9, 3)
    np.testing.assert_array_equal(arena.circles[:, 2], 0.2)


def test_add_an_observation(module: Module) -> None:
    """Where the LiDAR sees 3.5 m and nothing is near, a target 4 m away is half a metre farther: a quarter of 2 m."""
    slack: Any = complete(declared(module, "add-an-observation.md", "slack"), AddedObservationPart)
    observation = ObservationConfig.model_construct(parts=(slack(most=2.0),))
    task = TaskConfig().model_copy(update={"observation": observation})
    (number,) = observation_layout(task).numbers
    assert (number.name, number.formula) == ("slack", "(longest ray - target distance) / 2 m")
    world = World(task, build_arenas(task.arena), 1)
    world.reset(poses=np.zeros((1, 3)), targets=np.array([[4.0, 0.0]]))
    np.testing.assert_allclose(world.robots.observations, [[-0.25]])


def test_add_a_baseline(module: Module) -> None:
    task, bold = TaskConfig(), declared(module, "add-a-baseline.md", "bold")
    assert (drive(controller_of(bold(), task), task, load_suite("simple-200")) == "arrival").mean() > 0.9


@pytest.mark.parametrize(("block", "part", "memory"), [(0, "gated", 0), (2, "elman", 32)])
def test_add_a_network(module: Module, tmp_path: Path, block: int, part: str, memory: int) -> None:
    lines = blocks("add-a-network.md")
    extension = module("my_lab", lines[block]).extension
    module("my_lab.networks", lines[1])
    assert discover([("my_lab", lambda: extension)]).refused == ()
    network: Any = complete_network(extension.part(part))
    NETWORKS.add(network)
    try:
        recorder = Recorder()
        training = TrainingConfig(
            algorithm=PpoConfig(network=network(), robots=16, rollout_steps=16, minibatch_size=64),
            steps=1_000,
            evaluation=EvaluationConfig(every_steps=1_000),
        )
        assert train(training, 0, recorder, tmp_path) == "completed"
        manifest, policy = read_policy(recorder.checkpoints[-1][1])
    finally:
        NETWORKS.remove(network)
    assert manifest.network.name == f"my_lab.{part}"
    assert policy.memory_size == memory


def test_every_page_says_how_many_files_it_takes_and_the_overview_leads_to_it() -> None:
    overview = (PAGES / "extensions.md").read_text(encoding="utf-8")
    pages = sorted(PAGES.glob("add-*.md"))
    assert len(pages) == 7
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert text.splitlines()[0].endswith(": 1 file")
        assert f"({page.name}) | 1 |" in overview


def test_add_an_algorithm(module: Module) -> None:
    page = "add-an-algorithm.md"
    config: Any = complete(declared(module, page, "search"), AddedAlgorithmConfig)
    module("my_lab.search", blocks(page)[1])

    def learner() -> Learner:
        built = build_added(config(robots=4, rollout_steps=2), 16, 1, torch.device("cpu"), DEFAULT_ACTIONS)
        assert isinstance(built, Learner)
        return built

    first, nothing = learner(), np.zeros(4, np.bool_)
    for reward in (1.0, 0.5, 2.0):
        for _ in range(first.steps_per_update):
            observations = np.full((4, 16), 0.1, np.float32)
            assert first.act(observations).shape == (4, 2)
            first.record(observations, np.full(4, reward, np.float32), nothing, nothing, observations)
        assert first.update(0.0) == {"search/paid": 2.0 * reward}
    second = learner()
    second.load_state(first.state())
    assert second.state().keys() == first.state().keys()
    for name, array in first.state().items():
        np.testing.assert_array_equal(second.state()[name], array)
