"""Is a study worth it? TPE against random search at equal budget, and against a grid that was measured before.

    python -m benchmarks.studies --results studies.jsonl
    python -m benchmarks.studies --results tiny.jsonl --grid 2 --trials 3 --repetitions 1 --seeds 1 --steps 9000

On two tasks two settings are searched. First a grid of them is trained, every point with every tuning seed, and the score
that its best 5 % reach is noted. Then each sampler searches the same ranges, once with each of several seeds of its own,
and the best of each search is trained anew with five fresh seeds. Told are the trial with which a search came among the best
5 %, and what its best was worth on fresh seeds. Proposals and scores are those of the service (`server.studies`), without
early stops, so that equally many trials are equally many steps.

Every training is a line of the results' file as soon as it is through, and is not done again: all of this is decided by
seeds, so an interrupted benchmark goes on where it was. It takes hours: `--processes` trains several at once. Intervals are
over the searches.
"""

import json
import multiprocessing
import tempfile
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np

from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from server.studies.advance import fresh_seeds
from server.studies.designs import grid_point, grid_size
from server.studies.proposals import SamplerName, Told, propose
from server.studies.rules import score
from server.studies.space import RangedSetting, Space, Values
from sim.config import ArenaConfig, ArenaName, TaskConfig
from workers.config import EvaluationConfig, TrainingConfig
from workers.reporting import EvaluationResult
from workers.statistics.differences import Rates, difference_of_rates
from workers.statistics.seeds import interquartile_mean, success_rate

STEPS: dict[ArenaName, int] = {"simple": 60_000, "complex": 200_000}
"""Few enough that settings matter."""
BEST_SHARE = 0.05
WITHIN = 30
"""Trials within which a search is to come among the best."""
SHARE_OF_SEEDS = 0.9
"""Of the sampler's seeds, with which it is to."""
_EPISODES = 200
"""Of an evaluation, on the frozen suites of both arenas."""

Key = tuple[str, int, str, int]
"""Of a training: arena, steps, its searched values as JSON, seed."""


@dataclass(frozen=True)
class Result:
    """What came of a training: success rate, and seconds to the target of those that arrived."""

    success: float
    seconds: float | None


Train = Callable[[TrainingConfig, int], Result]


class Kept(Silent):
    """A reporter that keeps the last evaluation."""

    def __init__(self) -> None:
        self.evaluation: EvaluationResult | None = None

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """The last one comes with its evaluation."""
        self.evaluation = evaluation


def train(config: TrainingConfig, seed: int) -> Result:
    """Train and measure; some seconds to minutes of one core."""
    import torch

    from workers.live.viewing import Unwatched
    from workers.training.trainer import REPORT_INTERVAL, Training

    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    kept = Kept()
    with tempfile.TemporaryDirectory() as directory:
        Training(config, seed, kept, Path(directory), Unwatched(), REPORT_INTERVAL).run()
    assert kept.evaluation is not None
    arrived = [each.steps for each in kept.evaluation.episodes if each.outcome == "arrival"]
    seconds = float(np.mean(arrived)) * config.task.control_period if arrived else None
    return Result(len(arrived) / len(kept.evaluation.episodes), seconds)


@dataclass
class Trainings:
    """Trainings that are done once.

    Attributes:
        file: where each is noted, a line of JSON.
        train: how one is done.
        pool: of processes that do several; None to do them here.
    """

    file: Path
    train: Train = train
    pool: ProcessPoolExecutor | None = None
    known: dict[Key, Result] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.file.exists():
            for line in self.file.read_text().splitlines():
                arena, steps, values, seed, success, seconds = json.loads(line)
                self.known[arena, steps, values, seed] = Result(success, seconds)

    def of(self, space: Space, wanted: Sequence[tuple[Values, int]]) -> list[Result]:
        """What comes of these values with these seeds."""
        configs = [space.training(values) for values, _ in wanted]
        keys = [_key(config, values, seed) for config, (values, seed) in zip(configs, wanted, strict=True)]
        missing = {key: config for key, config in zip(keys, configs, strict=True) if key not in self.known}
        work = list(missing.values()), [key[-1] for key in missing]
        results: Iterable[Result] = self.pool.map(self.train, *work) if self.pool else map(self.train, *work)
        with self.file.open("a") as file:
            for key, result in zip(missing, results, strict=True):
                self.known[key] = result
                file.write(json.dumps([*key, result.success, result.seconds]) + "\n")
                file.flush()
        return [self.known[key] for key in keys]

    def scores(self, space: Space, points: Sequence[Values], seeds: Sequence[int]) -> list[float]:
        """The score of each point over the seeds, as the service has it."""
        results = self.of(space, [(values, seed) for values in points for seed in seeds])
        task = space.training({}).task
        found = []
        for start in range(0, len(results), len(seeds)):
            some = results[start : start + len(seeds)]
            times = [one.seconds for one in some if one.seconds is not None]
            success = interquartile_mean([one.success for one in some])
            seconds = interquartile_mean(times) if times else None
            found.append(score(success, seconds, task.step_limit * task.control_period))
        return found


def _key(config: TrainingConfig, values: Values, seed: int) -> Key:
    return str(getattr(config.task.arena, "name", "")), config.steps, json.dumps(values, sort_keys=True), seed


def space_of(arena: ArenaName, steps: int, points: int) -> Space:
    """Step size and discount on an arena, with so many points of each in the grid."""
    training = TrainingConfig(
        task=TaskConfig(arena=ArenaConfig(name=arena)), steps=steps, evaluation=EvaluationConfig(every_steps=NEVER)
    )
    return Space(
        training.model_dump(mode="json"),
        [
            RangedSetting(kind="range", path="algorithm.learning_rate", low=3e-5, high=3e-2, log=True, points=points),
            RangedSetting(kind="range", path="algorithm.gamma", low=0.9, high=0.999, points=points),
        ],
    )


@dataclass(frozen=True)
class Search:
    """What a search has found.

    Attributes:
        scores: of its trials, in their order.
        best: the values of the best one.
    """

    scores: list[float]
    best: Values

    def among(self, threshold: float) -> int | None:
        """The trial, from 1, with which it first reached a score; None where it never did."""
        return next((number for number, one in enumerate(self.scores, start=1) if one >= threshold), None)


def search(trainings: Trainings, space: Space, sampler: SamplerName, seed: int, seeds: Sequence[int], trials: int) -> Search:
    """One search, trial after trial."""
    told: list[Told] = []
    for _ in range(trials):
        values = propose(space, sampler, seed, told)
        (reached,) = trainings.scores(space, [values], seeds)
        told.append(Told(values, "complete", reached))
    scores = [one.score or 0.0 for one in told]
    return Search(scores, told[int(np.argmax(scores))].values)


def measure(trainings: Trainings, space: Space, seeds: Sequence[int], trials: int, repetitions: int) -> dict[str, Any]:
    """Grid, then searches, on one task."""
    points = [grid_point(space, 0, number) for number in range(grid_size(space))]
    grid = sorted(trainings.scores(space, points, seeds), reverse=True)
    threshold = grid[max(1, round(BEST_SHARE * len(grid))) - 1]
    figures: dict[str, Any] = {"grid_points": len(grid), "grid_best": grid[0], "grid_best_5_percent_from": threshold}
    judgements: dict[str, Rates] = {}
    for sampler in ("tpe", "random"):
        searches = [search(trainings, space, sampler, seed, seeds, trials) for seed in range(repetitions)]
        among = [one.among(threshold) for one in searches]
        judges = fresh_seeds(seeds)
        judged = [
            float(np.mean([one.success for one in trainings.of(space, [(each.best, seed) for seed in judges])]))
            for each in searches
        ]
        episodes = [float(_EPISODES * len(judges))] * len(judged)
        judgements[sampler] = Rates([rate * driven for rate, driven in zip(judged, episodes, strict=True)], episodes)
        fresh = success_rate(judgements[sampler].arrivals, episodes)
        figures[sampler] = {
            "among_best_5_percent_with_trial": among,
            "share_within": sum(trial is not None and trial <= WITHIN for trial in among) / len(among),
            "best_score": [max(one.scores) for one in searches],
            "success_on_fresh_seeds": judged,
            "mean_on_fresh_seeds": [round(one, 4) for one in (fresh.value, fresh.low, fresh.high)],
        }
        print(json.dumps({sampler: figures[sampler]}), flush=True)
    if repetitions > 1:
        apart = difference_of_rates(judgements["tpe"], judgements["random"])
        figures["tpe_less_random_on_fresh_seeds"] = [round(one, 4) for one in (apart.value, apart.low, apart.high)]
    return figures


def main() -> None:
    """Train, search and tell."""
    options = parser(__doc__)
    options.add_argument("--results", type=Path, required=True, help="file that every training is noted in")
    options.add_argument("--arenas", nargs="+", default=list(STEPS), choices=get_args(ArenaName))
    options.add_argument("--grid", type=int, default=10, help="points of each setting")
    options.add_argument("--trials", type=int, default=WITHIN, help="of a search")
    options.add_argument("--repetitions", type=int, default=10, help="searches of each sampler, with a seed each")
    options.add_argument("--seeds", type=int, default=3, help="tuning seeds of each trial")
    options.add_argument("--steps", type=int, help="of a training; else those that suit the arena")
    options.add_argument("--processes", type=int, default=1)
    arguments = options.parse_args()
    figures: dict[str, Any] = {}
    with ProcessPoolExecutor(arguments.processes, multiprocessing.get_context("spawn")) as pool:
        trainings = Trainings(arguments.results, pool=pool if arguments.processes > 1 else None)
        for arena in arguments.arenas:
            space = space_of(arena, arguments.steps or STEPS[arena], arguments.grid)
            seeds = range(arguments.seeds)
            figures[arena] = measure(trainings, space, seeds, arguments.trials, arguments.repetitions)
    figures["least_share_within"] = min(figures[arena]["tpe"]["share_within"] for arena in arguments.arenas)
    finish("studies", figures, at_least={"least_share_within": SHARE_OF_SEEDS}, check=arguments.check)


if __name__ == "__main__":
    main()
