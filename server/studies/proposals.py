"""Which values a study tries next, and which of its settings mattered: Optuna by ask and tell.

Optuna's study lives in memory for one question and is made anew of our rows for the next: its own tables would collide with
ours and go round our writes. Every trial is drawn with a seed of its own, made of the study's and the trial's number. So
what comes next depends on what is in the rows, and not on how often a server was started meanwhile.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from server.studies.designs import grid_point, quasi_point
from server.studies.space import ListedSetting, RangedSetting, Space, Value, Values

if TYPE_CHECKING:
    import optuna

SamplerName = Literal["tpe", "random", "quasi", "grid"]
Outcome = Literal["running", "complete", "pruned", "failed"]

LEAST_FOR_IMPORTANCES = 8
"""Complete trials before importances say anything."""


@dataclass(frozen=True)
class Told:
    """A trial as the sampler is told of it.

    Attributes:
        values: that it tried.
        outcome: a failed one is told as that, not as a low score.
        score: of a complete one; higher is better.
        rungs: of a pruned one, its success on the way by number of evaluation, from 1.
    """

    values: Values
    outcome: Outcome
    score: float | None = None
    rungs: Mapping[int, float] = field(default_factory=dict)


def propose(space: Space, sampler: SamplerName, seed: int, told: Sequence[Told]) -> Values:
    """The values of the next trial.

    Args:
        space: that is searched.
        sampler: that chooses.
        seed: of the study.
        told: every trial until now, by number.
    """
    number = len(told)
    if sampler == "grid":
        return grid_point(space, seed, number)
    if sampler == "quasi":
        return quasi_point(space, seed, number)
    study, distributions = _study(space, told if sampler == "tpe" else (), _sampler(sampler, seed, number))
    params = study.ask(distributions).params
    return {setting.path: _from_optuna(setting, params[setting.path]) for setting in space.settings}


def importances(space: Space, told: Sequence[Told]) -> dict[str, float]:
    """How much each setting has to do with being among the best trials (PED-ANOVA, Watanabe et al. 2023); they sum to 1.

    Empty before `LEAST_FOR_IMPORTANCES` complete trials, or where all of them did alike.
    """
    complete = [one for one in told if one.outcome == "complete"]
    if len(complete) < LEAST_FOR_IMPORTANCES or len({one.score for one in complete}) == 1:
        return {}
    from optuna.importance import get_param_importances

    study, _ = _study(space, complete, _sampler("random", 0, 0))
    found = get_param_importances(study)
    return {path: float(share) for path, share in found.items()}


def trial_seed(seed: int, number: int) -> int:
    """The seed that a trial is drawn with, of 32 bits."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0])


def _sampler(name: Literal["tpe", "random"], seed: int, number: int) -> "optuna.samplers.BaseSampler":
    import optuna  # A second, which a server's start need not take.

    drawn = trial_seed(seed, number)
    if name == "random":
        return optuna.samplers.RandomSampler(seed=drawn)
    return optuna.samplers.TPESampler(seed=drawn, multivariate=True, constant_liar=True)


def _study(
    space: Space, told: Sequence[Told], sampler: "optuna.samplers.BaseSampler"
) -> tuple["optuna.Study", dict[str, "optuna.distributions.BaseDistribution"]]:
    import optuna
    from optuna.trial import TrialState, create_trial

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    states = {
        "running": TrialState.RUNNING,
        "complete": TrialState.COMPLETE,
        "pruned": TrialState.PRUNED,
        "failed": TrialState.FAIL,
    }
    distributions = _distributions(space)
    study = optuna.create_study(direction="maximize", sampler=sampler)
    for one in told:
        study.add_trial(
            create_trial(
                state=states[one.outcome],
                params={setting.path: _to_optuna(setting, one.values[setting.path]) for setting in space.settings},
                distributions=distributions,
                value=one.score if one.outcome == "complete" else None,
                intermediate_values=dict(one.rungs),
            )
        )
    return study, distributions


def _distributions(space: Space) -> dict[str, "optuna.distributions.BaseDistribution"]:
    from optuna.distributions import (
        BaseDistribution,
        CategoricalDistribution,
        FloatDistribution,
        IntDistribution,
    )

    found: dict[str, BaseDistribution] = {}
    for setting in space.settings:
        if isinstance(setting, ListedSetting):
            found[setting.path] = CategoricalDistribution(tuple(_to_optuna(setting, value) for value in setting.values))
            continue
        low, high = (-setting.high, -setting.low) if setting.mirrored else (setting.low, setting.high)
        if space.is_whole(setting):
            found[setting.path] = IntDistribution(int(low), int(high), log=setting.log)
        else:
            found[setting.path] = FloatDistribution(low, high, log=setting.log)
    return found


def _to_optuna(setting: RangedSetting | ListedSetting, value: Value) -> bool | int | float | str:
    """A value as Optuna knows it: lists as text, and by its amount what is below 0 on a logarithmic scale."""
    if isinstance(value, list):
        return json.dumps(value)
    if isinstance(setting, RangedSetting) and setting.mirrored and isinstance(value, int | float):
        return -value
    return value


def _from_optuna(setting: RangedSetting | ListedSetting, param: bool | int | float | str) -> Value:
    """The other way round."""
    if isinstance(setting, ListedSetting):
        return next((value for value in setting.values if _to_optuna(setting, value) == param), param)
    return _to_optuna(setting, param)
