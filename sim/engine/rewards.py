"""A reward as the kernels read it: the kinds and weights of its terms, and the programs of its formulas."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.arrays import Floats
from sim.config import FormulaTerm, ProgressTerm, RewardConfig, SmoothnessTerm, TaskConfig, term_key
from sim.errors import FormulaError
from sim.extending.discovery import implementation
from sim.extending.expression import FUNCTIONS, OPERATIONS, QUANTITIES, Step, depth, operands, parse
from sim.extending.parts import RewardTerm as AddedTerm
from sim.kernels import rewards as kernels
from sim.kernels.bundles import Robots
from sim.kernels.options import bound
from sim.kernels.records import FORMULA_TERM, TERM_KINDS
from sim.kernels.room import MAX_TERMS

assert OPERATIONS.index("clip") == kernels.CLIP
assert len(OPERATIONS) == kernels.CLIP + 1


def term_names(reward: RewardConfig) -> tuple[str, ...]:
    """The names under which the terms are logged, in order: the columns of `Robots.terms`."""
    return tuple(term_key(term) for term in reward.terms)


def pack_terms(reward: RewardConfig) -> dict[str, object]:
    """Those fields of `sim.kernels.records.PARAMETERS` that say what a step is worth."""
    kinds = [FORMULA_TERM if isinstance(term, AddedTerm) else TERM_KINDS.index(term.name) for term in reward.terms]
    weights = [term.weight for term in reward.terms]
    options = [
        float(term.exponential) if isinstance(term, ProgressTerm) else getattr(term, "margin", 0.0) for term in reward.terms
    ]
    values: dict[str, object] = {"terms": len(kinds), "tabulates": FORMULA_TERM in kinds}
    for name, column in (("term_kinds", kinds), ("term_weights", weights), ("term_options", options)):
        values[name] = np.pad(np.array(column, np.float64), (0, MAX_TERMS - len(column)))
    return values


def constants(task: TaskConfig) -> dict[str, float]:
    """What formulas may read of a task, see `sim.extending.expression.CONSTANTS`."""
    return {
        "period": task.control_period,
        "lidar_range": task.lidar.range,
        "arrival_distance": task.arrival_distance,
        "collision_distance": task.collision_distance,
        "step_limit": float(task.step_limit),
        "max_speed": task.robot.max_linear_speed,
        "max_turning_rate": task.robot.max_angular_speed,
        "pi": float(np.pi),
    }


def reads_changes(reward: RewardConfig) -> bool:
    """Whether a reward depends on the velocities of the step before."""
    return any(isinstance(term, SmoothnessTerm | FormulaTerm | AddedTerm) for term in reward.terms)


def program_of(term: FormulaTerm | AddedTerm) -> tuple[Step, ...]:
    """The program of a term's formula."""
    return parse(term.formula) if isinstance(term, FormulaTerm) else parse(term.formula, term.parameter_names())


def parameters_of(term: FormulaTerm | AddedTerm) -> dict[str, float]:
    """What a term's formula may read besides quantities and constants."""
    return {} if isinstance(term, FormulaTerm) else term.parameters


@dataclass(frozen=True, eq=False)
class _Formula:
    """One compiled formula: its term's name, weight and column, and its program."""

    label: str
    text: str
    steps: tuple[Step, ...]
    weight: np.float32
    column: int
    codes: NDArray[np.int32]
    numbers: NDArray[np.float32]
    stack: NDArray[np.float32]

    def inputs(self, robots: Robots) -> tuple[object, ...]:
        """What its kernel takes."""
        return self.codes, self.numbers, self.stack, self.weight, self.column, robots


@dataclass(frozen=True, eq=False)
class _Function:
    """A term that an extension computes: its name, weight and column, and its function with the term and the constants."""

    label: str
    weight: np.float32
    column: int
    compute: Callable[[Mapping[str, Floats]], Floats]


class Formulas:
    """The formulas of a task's reward, and the functions of extensions, for so many robots."""

    def __init__(self, task: TaskConfig, robots: int) -> None:
        rows = list(QUANTITIES)
        self._formulas: list[_Formula] = []
        self._functions: list[_Function] = []
        self._add_formula: Callable[..., Any] | None = None
        for column, term in enumerate(task.reward.terms):
            if not isinstance(term, FormulaTerm | AddedTerm):
                continue
            if not term.formula:
                assert isinstance(term, AddedTerm)
                compute = partial(implementation(term), term, constants=constants(task))
                self._functions.append(_Function(term_key(term), np.float32(term.weight), column, compute))
                continue
            known = constants(task) | parameters_of(term)
            steps = program_of(term)
            codes = [OPERATIONS.index("number" if step.operation == "constant" else step.operation) for step in steps]
            numbers = [_operand(step, known, rows) for step in steps]
            self._formulas.append(
                _Formula(
                    label=term_key(term),
                    text=term.formula,
                    steps=steps,
                    weight=np.float32(term.weight),
                    column=column,
                    codes=np.array(codes, np.int32),
                    numbers=np.array(numbers, np.float32),
                    stack=np.zeros((depth(steps), robots), np.float32),
                )
            )

    def __len__(self) -> int:
        return len(self._formulas) + len(self._functions)

    def add(self, robots: Robots) -> None:
        """Add the formulas and functions of the step that was just driven to its rewards.

        Raises:
            FormulaError: one of them is not a finite number for a robot, or a function's answer is of another shape.
        """
        for formula in self._formulas:
            if self._add_formula is None:
                self._add_formula = bound(kernels.add_formula, *formula.inputs(robots))
            failed = self._add_formula(*formula.inputs(robots))
            if failed >= 0:
                seen = dict(zip(QUANTITIES, robots.quantities[:, failed].tolist(), strict=True))
                read = {step.name for step in formula.steps if step.operation == "quantity"}
                values = ", ".join(f"{name} = {seen[name]:.6g}" for name in QUANTITIES if name in read)
                raise FormulaError(
                    f"the reward's formula {formula.label!r}, {formula.text}, is not a finite number where "
                    f"{values or 'it is'}: "
                    "guard divisions, roots and logarithms with max(), min() or 'a if b else c'"
                )
        if self._functions:
            quantities = dict(zip(QUANTITIES, _read_only(robots.quantities), strict=True))
            for function in self._functions:
                _add(function, quantities, robots)


def _add(function: _Function, quantities: Mapping[str, Floats], robots: Robots) -> None:
    values = np.asarray(function.compute(quantities), np.float32)
    driving = ~robots.records["parked"].astype(bool)
    if values.shape != robots.rewards.shape or not np.isfinite(values[driving]).all():
        raise FormulaError(
            f"the reward's term {function.label!r} should be {len(driving)} finite numbers, one a robot, and its function "
            f"returns {values.shape} of which {np.count_nonzero(~np.isfinite(values))} are not finite"
        )
    terms = np.where(driving, function.weight * values, np.float32(0.0))
    robots.terms[:, function.column] = terms
    robots.rewards[:] += terms
    robots.records["attempt_reward"] += terms


def _read_only(array: Floats) -> Floats:
    view = array.view()
    view.flags.writeable = False
    return view


def _operand(step: Step, known: dict[str, float], rows: list[str]) -> float:
    if step.operation == "quantity":
        return float(rows.index(step.name))
    return known[step.name] if step.operation == "constant" else step.number


_PLAIN: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "**": lambda a, b: a**b,
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "negative": lambda a: -a,
    "if": lambda a, b, c: b if a else c,
    "abs": abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "min": min,
    "max": max,
    "clip": lambda a, b, c: min(max(a, b), c),
}
assert _PLAIN.keys() >= FUNCTIONS.keys()


def evaluate(steps: Iterable[Step], values: Mapping[str, float]) -> float:
    """A formula for one robot, computed plainly: what the compiled one must agree with.

    Args:
        steps: its program.
        values: of all quantities and constants that it reads.
    """
    waiting: list[float] = []
    for step in steps:
        if step.operation == "number":
            waiting.append(step.number)
        elif step.operation in ("quantity", "constant"):
            waiting.append(values[step.name])
        else:
            count = operands(step.operation)
            taken = waiting[-count:]
            del waiting[-count:]
            waiting.append(float(_PLAIN[step.operation](*taken)))
    return waiting[0]
