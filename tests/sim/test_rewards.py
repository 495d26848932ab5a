"""Rewards as lists of terms: reading old ones, formulas and what they may say, and what a step is worth."""

import math
import time
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim.config import FormulaTerm, ProgressTerm, RewardConfig, RewardTerm, SmoothnessTerm, TaskConfig, preset_terms
from sim.engine.rewards import Formulas, constants, evaluate, term_names
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.errors import FormulaError
from sim.extending.expression import CONSTANTS, MAX_DEPTH, QUANTITIES, parse


def formula(text: str, weight: float = 1.0) -> RewardConfig:
    return RewardConfig(terms=(ProgressTerm(), FormulaTerm(label="mine", weight=weight, formula=text)))


def driven(reward: RewardConfig, steps: int = 5) -> NavigationVectorEnv:
    env = NavigationVectorEnv(task=TaskConfig(reward=reward), num_envs=16, seed=1)
    env.reset(seed=1)
    for _ in range(steps):
        env.step(np.full((16, 2), 0.5, np.float32))
    return env


def test_rewards_stored_when_they_had_a_name_are_read_as_their_terms() -> None:
    old = {"name": "clearance", "arrival": 90.0, "collision": -80.0, "progress": 400.0, "penalty": 3.0}
    read = TaskConfig.model_validate({"reward": old}).reward
    assert read == RewardConfig(terms=preset_terms("clearance", arrival=90.0, collision=-80.0, progress=400.0, penalty=3.0))
    assert [(term.name, term.weight) for term in read.terms] == [
        ("arrival", 90.0), ("collision", -80.0), ("progress", 400.0), ("clearance", -3.0)
    ]  # fmt: skip
    assert TaskConfig.model_validate({"reward": {"name": "basic", "penalty": 7.0}}).reward == RewardConfig()
    assert TaskConfig.model_validate({"reward": {"collision": -1000.0}}).reward == RewardConfig.preset(
        "basic", collision=-1000.0
    )
    assert RewardConfig.model_validate_json(read.model_dump_json()) == read


@pytest.mark.parametrize(
    ("reward", "in_short"),
    [
        (RewardConfig.preset("basic", progress=3.0), "basic"),
        (RewardConfig.preset("clearance"), "clearance"),
        (RewardConfig.preset("alignment"), "alignment"),
        (RewardConfig(terms=(SmoothnessTerm(),)), "1 term"),
        (RewardConfig(terms=(*preset_terms("basic"), SmoothnessTerm())), "4 terms"),
    ],
)
def test_a_reward_in_short(reward: RewardConfig, in_short: str) -> None:
    assert reward.in_short == in_short


def test_what_was_never_a_reward_is_refused() -> None:
    documents: tuple[dict[str, object], ...] = (
        {"name": "sparse"},
        {"arrival": "much"},
        {"terms": []},
        {"terms": [{"name": "arrival"}] * 2},
    )
    for document in documents:
        with pytest.raises(ValidationError):
            RewardConfig.model_validate(document)


@pytest.mark.parametrize(
    ("text", "values", "expected"),
    [
        ("1 + 2 * 3 - 4 / 8", {}, 6.5),
        ("-distance ** 2", {"distance": 3.0}, -9.0),
        ("min(0, clearance - 0.3) * speed", {"clearance": 0.1, "speed": 0.25}, -0.05),
        ("2 if ahead > 0.5 else -1", {"ahead": 0.5}, -1.0),
        ("(steps >= 10) - (steps < 3)", {"steps": 12.0}, 1.0),
        ("clip(distance, 0, 1) + abs(-pi)", {"distance": 5.0}, 1.0 + math.pi),
        ("sqrt(exp(log(16)))", {}, 4.0),
    ],
)
def test_a_formula_means_what_it_says(text: str, values: dict[str, float], expected: float) -> None:
    assert evaluate(parse(text), constants(TaskConfig()) | values) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("speed +", "not a formula"),
        ("", "at least 1 character"),
        ("velocity * 2", "no quantity 'velocity'"),
        ("floor(speed)", "no function 'floor'"),
        ("min(speed)", "min takes 2 values"),
        ("__import__('os').system('true')", "not allowed"),
        ("speed.__class__", "not allowed"),
        ("[speed for speed in (1, 2)]", "not allowed"),
        ("(lambda: 1)()", "not allowed"),
        ("speed and ahead", "not allowed"),
        ("0 < speed < 1", "not allowed"),
        ("'speed'", "not allowed"),
        ("True", "not allowed"),
        ("1e400", "numbers are at most"),
        ("+".join(["speed"] * 33), "at most 64"),
        ("(" * 250 + "1" + ")" * 40, "not a formula"),
        ("1+(" * 17 + "1" + ")" * 17, f"at most {MAX_DEPTH}"),
        ("1" * 301, "at most 300 characters"),
    ],
)
def test_anything_else_is_refused_in_words(text: str, complaint: str) -> None:
    with pytest.raises(ValidationError, match=complaint):
        FormulaTerm(formula=text)


operators = st.sampled_from(["+", "-", "*", "<", "<=", ">", ">="])
leaves = st.sampled_from([*QUANTITIES, *CONSTANTS, "0.5", "2", "-3"])
formulas = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, operators, inner),
        st.builds("({} if {} else {})".format, inner, inner, inner),
        st.builds("{}({})".format, st.sampled_from(["abs", "sin", "cos", "tanh"]), inner),
        st.builds("sqrt(abs({}))".format, inner),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner),
        st.builds("clip({}, -1, 1)".format, inner),
        st.builds("({} / (1 + abs({})))".format, inner, inner),
    ),
    max_leaves=8,
)


@settings(max_examples=60)
@given(formulas)
def test_the_compiled_formula_is_the_plain_one(text: str) -> None:
    task = WORLD.task.model_copy(update={"reward": formula(text)})
    robots = WORLD.robots._replace(
        terms=np.zeros((16, 2), np.float32),
        rewards=np.zeros(16, np.float32),
        records=WORLD.robots.records.copy(),
        quantities=np.random.default_rng(0).uniform(-2.0, 2.0, (len(QUANTITIES), 16)).astype(np.float32),
    )
    Formulas(task, 16).add(robots)
    for i in range(16):
        values = constants(task) | dict(zip(QUANTITIES, robots.quantities[:, i].astype(float).tolist(), strict=True))
        expected = evaluate(parse(text), values)
        near = any(operator in text for operator in "<>") or " if " in text  # a comparison may round to either side
        assert near or robots.terms[i, 1] == pytest.approx(expected, rel=1e-3, abs=1e-3)


WORLD = World(TaskConfig(), NavigationVectorEnv(num_envs=1).arenas, 16, seed=0)


def test_every_term_is_logged_and_their_sum_is_the_reward() -> None:
    env = driven(formula("speed - 2 * abs(turning_rate) / max_turning_rate", weight=0.5))
    assert env.reward_term_names == ("progress", "mine") == term_names(env.task.reward)
    assert env.reward_terms[:, 1] == pytest.approx(np.full(16, 0.5 * (0.125 - 2 * 0.5)), rel=1e-5)
    _, rewards, *_ = env.step(np.full((16, 2), 0.5, np.float32))
    assert rewards == pytest.approx(env.reward_terms.sum(axis=1), rel=1e-6)


def test_smoothness_is_paid_for_changes_of_the_command_only() -> None:
    env = NavigationVectorEnv(task=TaskConfig(reward=RewardConfig(terms=(SmoothnessTerm(weight=-2.0),))), num_envs=4, seed=1)
    env.reset(seed=1)
    _, first, *_ = env.step(np.full((4, 2), 0.5, np.float32))
    _, second, *_ = env.step(np.full((4, 2), 0.5, np.float32))
    assert first == pytest.approx(np.full(4, -2.0 * 0.5))  # from rest: 0.5² + 0.5²
    assert second == pytest.approx(np.zeros(4))


def test_a_formula_that_is_no_number_says_where() -> None:
    with pytest.raises(FormulaError, match=r"'mine', 1 / \(speed - 0\.125\), is not a finite number where speed = 0\.125"):
        driven(formula("1 / (speed - 0.125)"))


def test_a_reward_goes_on_from_a_state_bit_for_bit() -> None:
    reward = RewardConfig(terms=(*preset_terms("alignment"), SmoothnessTerm(), FormulaTerm(formula="last_speed - speed")))
    env, other = driven(reward), driven(reward, steps=0)
    other.set_state(env.get_state())
    actions = np.random.default_rng(0).uniform(0, 1, (20, 16, 2)).astype(np.float32)
    for action in actions:
        assert np.array_equal(env.step(action)[1], other.step(action)[1])


def test_a_formula_never_seen_is_ready_at_once() -> None:
    driven(formula("speed"))
    before = time.process_time()
    driven(formula("clip(bearing * 0.123, -1, 1) if mover < 3 else tanh(distance)"))
    assert time.process_time() - before < 2.0


def test_the_documented_lines_run() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rewards.md").read_text("utf-8")
    lines = page.split("```python\n")[1].split("```")[0]
    names: dict[str, object] = {}
    exec(lines, names)
    task = names["task"]
    assert isinstance(task, TaskConfig)
    assert term_names(task.reward) == ("arrival", "collision", "progress", "time", "near_and_fast")
    for term in get_args(get_args(RewardTerm)[0]):
        assert f"`{term.model_fields['name'].default}`" in page
