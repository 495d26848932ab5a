"""A run's row as JSON shows it."""

from collections.abc import Callable, Collection, Mapping

from server.database import tables
from server.experiments.stored import read_training
from server.metrics.views import thinned_view
from server.runs.schemas import Run, RunDetail
from workers.config import TrainingConfig

SPEED = "time/steps_per_second"
TRAIN_SUCCESS = "train/success_rate"
EVAL_SUCCESS = "eval/success_rate"
# The metrics that a run's row shows.
SHOWN = (SPEED, TRAIN_SUCCESS, EVAL_SUCCESS)


def run_view(run: tables.Run, training: TrainingConfig, latest: Mapping[str, float]) -> Run:
    """The run in JSON; `latest` holds the newest value of each of `SHOWN` that there is."""
    speed = latest.get(SPEED) if run.state == "running" else None
    return Run(
        id=run.id,
        experiment_id=run.experiment_id,
        seed=run.seed,
        state=run.state,
        attempt=run.attempt,
        step=run.step,
        total_steps=training.steps,
        steps_per_second=speed,
        seconds_left=max(0, training.steps - run.step) / speed if speed else None,
        success_rate=latest.get(TRAIN_SUCCESS),
        eval_success_rate=latest.get(EVAL_SUCCESS),
        worker=run.worker,
        error=run.error,
        created_at=run.created_at,
        started_at=run.started_at,
        finished_at=run.finished_at,
        thins_at=run.thins_at,
        thinned=thinned_view(run),
    )


def run_detail(
    run: tables.Run, latest: Mapping[str, float], takers: Callable[[TrainingConfig], Collection[str]]
) -> RunDetail:
    """The run in JSON with what it trains; `takers` are the workers that would take up a run of a training now."""
    stored = read_training(run.experiment.training)
    needed = stored.training.extensions
    waits = run.state == "queued" and bool(needed) and not takers(stored.training)
    return RunDetail(
        **run_view(run, stored.training, latest).model_dump(),
        experiment_name=run.experiment.name,
        training=stored.training,
        unreadable=list(stored.unreadable),
        lacking=list(stored.lacking),
        waits_for=list(needed) if waits else [],
    )
