"""Trains shipped policies from their recipes, measures them, and writes the files that ship.

    python -m workers.shipped.build NAME ...     # these policies
    python -m workers.shipped.build NAME ... --measure  # these again, as they are: what they are told has changed
    python -m workers.shipped.build --baselines  # what they are compared with
    python -m workers.shipped.build NAME --seed 1 --folder elsewhere  # what another seed would have made

The same recipe gives the same files on the same machine; another processor rounds otherwise, and trains another policy.
"""

import argparse
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from pydantic import BaseModel

from sim.arrays import Floats
from sim.baselines.named import TABLED, controller_of
from sim.config import TaskConfig
from sim.suite_rules import SuiteLidar
from sim.suites import EpisodeTable, Situation, Suite, SuiteRules, load_suite, run_controller, suite_named, suite_names
from workers.checkpoints import copy_policy, read_policy
from workers.frames import Frame
from workers.policy import torch_policy
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.shipped.figures import figures
from workers.shipped.library import (
    ARCHIVE,
    BASELINES,
    CARD,
    FOLDER,
    Baseline,
    Baselines,
    Card,
    SuiteFigures,
)
from workers.shipped.recipes import RECIPES, Recipe, recipe
from workers.training.evaluation import evaluate, to_result
from workers.training.trainer import train


def controller(name: str, task: TaskConfig) -> Callable[[Situation], Floats]:
    """A baseline for a task; one for each run, since some remember."""
    return controller_of(TABLED[name], task)


def _driven(name: str) -> Callable[[Suite], EpisodeTable]:
    def drive(suite: Suite) -> EpisodeTable:
        task = suite.rules.task()
        return run_controller(controller(name, task), task, suite)

    return drive


CONTROLLERS: dict[str, Callable[[Suite], EpisodeTable]] = {name: _driven(name) for name in TABLED}
"""The baselines, each with the task that a suite's rules ask for, the default one's where they ask for nothing."""

_COMMAND = "python -m workers.shipped.build"
_DECIMALS = 4  # of lengths and rewards in the files: tenths of a millimetre


_EVERY_SECONDS = 30.0


class Progress:
    """Says twice a minute how far a training is, on the standard error: some recipes take an hour.

    Args:
        steps: of the training.
        clock: seconds.
    """

    def __init__(self, steps: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._steps, self._clock = steps, clock
        self._begun = self._told = clock()

    def at(self, step: int, success_rate: float | None) -> None:
        """A training has come to a step; of its attempts so many arrived of late, 0 to 1."""
        now = self._clock()
        if now - self._told < _EVERY_SECONDS or step <= 0:
            return
        self._told = now
        left = (now - self._begun) * max(0, self._steps - step) / step
        arrived = "" if success_rate is None else f", {success_rate:.1%} arrive"
        sys.stderr.write(f"step {step:,} of {self._steps:,}{arrived}, {left / 60:.0f} min left\n")
        sys.stderr.flush()


class BestCheckpoint:
    """A reporter that remembers the best of a training's checkpoints: most arrivals, then fewest steps, then the newest."""

    def __init__(self, progress: Progress | None = None) -> None:
        self._progress = progress
        self.archive: Path | None = None
        self.step = 0
        self._merit = (-1.0, 0.0)

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Tells how far it is."""
        if self._progress:
            self._progress.at(step, values.get("train/success_rate"))

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Not of interest."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """See `Reporter.checkpoint`."""
        if evaluation is None:
            return
        arrived = [episode.steps for episode in evaluation.episodes if episode.outcome == "arrival"]
        merit = (evaluation.success_rate, -sum(arrived) / len(arrived) if arrived else float("-inf"))
        if merit >= self._merit:
            self.archive, self.step, self._merit = archive, step, merit

    def frames(self, frames: Sequence[Frame]) -> None:
        """Nobody watches."""

    @property
    def watch(self) -> WatchRequest | None:
        """Nobody watches."""
        return None

    @property
    def stop_requested(self) -> bool:
        """Never."""
        return False


def build(made_from: Recipe, folder: Path = FOLDER, seed: int | None = None) -> Card:
    """Trains a policy, with the recipe's seed or another, and writes its files into `folder`/NAME, whatever was there."""
    command = f"{_COMMAND} {made_from.name}" if seed is None else f"{_COMMAND} {made_from.name} --seed {seed}"
    seed = made_from.seed if seed is None else seed
    target = folder / made_from.name
    with TemporaryDirectory() as scratch:
        best = BestCheckpoint(Progress(made_from.training.steps))
        train(made_from.training, seed, best, Path(scratch))
        assert best.archive is not None  # every training ends with an evaluation
        shutil.rmtree(target, ignore_errors=True)
        target.mkdir(parents=True)
        copy_policy(best.archive, target / ARCHIVE)
        # Checkpoints are their owner's alone; these are everybody's.
        (target / ARCHIVE).chmod(0o644)
    return _measure(made_from, target, command, seed, best.step)


def measure(made_from: Recipe, folder: Path = FOLDER) -> Card:
    """Drives a recipe's suites again with the policy that is in `folder`/NAME, and writes how it did."""
    target = folder / made_from.name
    card = Card.model_validate_json((target / CARD).read_bytes())
    return _measure(made_from, target, card.command, card.seed, card.step)


def _measure(made_from: Recipe, target: Path, command: str, seed: int, step: int) -> Card:
    manifest, policy = read_policy(target / ARCHIVE)
    task = manifest.training.task
    act = torch_policy(policy)
    results = []
    for name in made_from.suites:
        result = _rounded(evaluate(act, task, suite_named(name, task)))
        _write(target / f"{name}.json", result)
        results.append(_suite_figures(result, task))
    card = Card(
        name=made_from.name,
        title=made_from.title,
        description=made_from.description,
        command=command,
        training=made_from.training,
        seed=seed,
        step=step,
        results=tuple(results),
    )
    _write(target / CARD, card, indent=2)
    return card


def measure_baselines(path: Path = BASELINES, *, again: bool = False) -> Baselines:
    """Drives the controllers that need no training through every suite, frozen or a recipe's, and writes how they did.

    Args:
        path: of the file; what it says of a suite of the same hash stands.
        again: measures everything anew.
    """
    old = Baselines.model_validate_json(path.read_bytes()).baselines if path.exists() and not again else ()
    kept = {(each.name, result.suite_hash): result for each in old for result in each.results}
    drawn = {
        name: _on_equal_terms(suite_named(name, each.training.task), each.training.task)
        for each in RECIPES
        for name in each.suites
    }
    suites = [*map(load_suite, suite_names()), *(suite for name, suite in drawn.items() if name not in suite_names())]
    measured = Baselines(
        command=f"{_COMMAND} --baselines",
        baselines=tuple(
            Baseline(
                name=name,
                results=tuple(
                    kept.get((name, suite.hash)) or _suite_figures(to_result(drive(suite), suite), suite.rules.task())
                    for suite in suites
                ),
            )
            for name, drive in CONTROLLERS.items()
        ),
    )
    _write(path, measured, indent=2)
    return measured


def _on_equal_terms(suite: Suite, task: TaskConfig) -> Suite:
    """The suite, a drawn one of another robot than the default one asking for that robot, its LiDAR and its pace."""
    if suite.rules != SuiteRules() or task.robot == TaskConfig().robot:
        return suite
    rules = SuiteRules(
        robot=task.robot,
        lidar=SuiteLidar(**task.lidar.model_dump(), batches=task.observation.batches),
        arrival_distance=task.arrival_distance,
        collision_distance=task.collision_distance,
        control_period=task.control_period,
    )
    return replace(suite, rules=rules)


def _suite_figures(result: EvaluationResult, task: TaskConfig) -> SuiteFigures:
    return SuiteFigures(
        suite=result.suite, suite_hash=result.suite_hash, figures=figures(result.episodes, task.arrival_distance)
    )


def _rounded(result: EvaluationResult) -> EvaluationResult:
    episodes = tuple(
        episode.model_copy(
            update={
                name: round(getattr(episode, name), _DECIMALS)
                for name in ("reward", "path_length", "shortest_path", "min_clearance")
            }
        )
        for episode in result.episodes
    )
    return result.model_copy(update={"episodes": episodes})


def _write(path: Path, content: BaseModel, indent: int | None = None) -> None:
    path.write_text(content.model_dump_json(indent=indent) + "\n", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    known = ", ".join(each.name for each in RECIPES)
    parser = argparse.ArgumentParser(prog=_COMMAND, description="Train, measure and write shipped policies.")
    # No `choices`: Python 3.11 would look for the empty list among them.
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"Which policies: {known}.")
    parser.add_argument("--measure", action="store_true", help="Train nothing: drive the suites again with what is there.")
    parser.add_argument("--baselines", action="store_true", help="Measure what they are compared with, where it is not yet.")
    parser.add_argument("--again", action="store_true", help="Measure all of that anew.")
    parser.add_argument("--seed", type=int, help="Train with another seed than the recipe's; needs --folder.")
    parser.add_argument(
        "--folder", type=Path, default=FOLDER, help="Where the policies' folders go, if not where they ship."
    )
    options = parser.parse_args(arguments)
    if options.seed is not None and options.folder == FOLDER:
        parser.error("what ships has its recipe's seed: name a --folder for another one")
    if options.seed is not None and options.measure:
        parser.error("--measure drives what is there: it has its seed")
    try:
        recipes = [recipe(name) for name in options.names]
    except KeyError as error:
        parser.error(error.args[0])
    if not recipes and not options.baselines:
        parser.error(f"name at least one policy: {known}")
    if options.baselines:
        measure_baselines(again=options.again)
    for made_from in recipes:
        card = measure(made_from, options.folder) if options.measure else build(made_from, options.folder, options.seed)
        for result in card.results:
            found, interval = result.figures, result.figures.success_interval
            sys.stdout.write(
                f"{card.name}, step {card.step:,}, {result.suite}: {found.success:.1%} success "
                f"[{interval.low:.1%}, {interval.high:.1%}], SPL {found.spl:.2f}\n"
            )


if __name__ == "__main__":
    main()
