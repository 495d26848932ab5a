"""Training, evaluation and export from the command line: the same code as in the service, without it."""

import signal
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, Literal

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from sim.config.refusals import to_tell
from sim.errors import SimError
from workers.config import TrainingConfig
from workers.errors import WorkerError
from workers.export.command import export
from workers.frames import Frame
from workers.presets import PRESETS, preset
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.reproduction.command import reproduce
from workers.runtime.worker import worker
from workers.shipped.command import app as policies
from workers.start import StartFrom
from workers.statistics.seeds import failed_seeds, success_rate

app = typer.Typer(help="Train, evaluate and export policies on this machine.", no_args_is_help=True)
app.command()(export)
app.add_typer(policies, name="policies")

_console = Console()


class ConsoleReporter:
    """A reporter that draws a progress bar, and stops the training at Ctrl-C."""

    def __init__(self, progress: Progress, total_steps: int) -> None:
        self._progress = progress
        self._task = progress.add_task("training", total=total_steps, success="", speed="")
        self._stop = False
        self.last: Path | None = None

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """See `Reporter.metrics`."""
        fields: dict[str, str] = {}
        if "time/steps_per_second" in values:
            fields["speed"] = f"{values['time/steps_per_second']:,.0f} steps/s"
        if "train/success_rate" in values:
            fields["success"] = f"{values['train/success_rate']:.1%} training success"
        self._progress.update(self._task, completed=step, **fields)  # type: ignore[arg-type]

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """See `Reporter.event`."""
        self._progress.console.print(f"[{level}] step {step:,}: {message}", markup=False)

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """See `Reporter.checkpoint`."""
        self.last = archive
        if evaluation is not None:
            self._progress.console.print(f"step {step:>10,}  {describe(evaluation)}  {archive}", highlight=False)

    def frames(self, frames: Sequence[Frame]) -> None:
        """Nobody watches."""

    @property
    def watch(self) -> WatchRequest | None:
        """Nobody watches."""
        return None

    @property
    def stop_requested(self) -> bool:
        """Whether Ctrl-C was pressed."""
        return self._stop

    def request_stop(self, _signal: int, _frame: FrameType | None) -> None:
        """A signal handler: finish this update, write a checkpoint, leave; a second signal interrupts at once."""
        self._stop = True
        signal.signal(signal.SIGINT, signal.default_int_handler)


def describe(result: EvaluationResult) -> str:
    """An evaluation in one line."""
    count = len(result.episodes)
    arrivals = [episode for episode in result.episodes if episode.outcome == "arrival"]
    success = success_rate([len(arrivals)], [count])
    steps = f"{sum(e.steps for e in arrivals) / len(arrivals):6.1f} steps" if arrivals else "     - steps"
    reward = sum(episode.reward for episode in result.episodes) / max(1, sum(e.steps for e in result.episodes))
    return (
        f"{success.value:6.1%} success [{success.low:.1%}, {success.high:.1%}] of {count} on {result.suite}, "
        f"{steps} per target, {reward:6.2f} reward per step"
    )


def describe_seeds(results: Sequence[EvaluationResult]) -> str:
    """Several seeds of one training on one suite, in one line: what they say of all seeds, and what they leave open."""
    arrivals = [sum(episode.outcome == "arrival" for episode in result.episodes) for result in results]
    episodes = [len(result.episodes) for result in results]
    success = success_rate(arrivals, episodes)
    each = [one / count for one, count in zip(arrivals, episodes, strict=True)]
    return (
        f"{success.value:6.1%} success [{success.low:.1%}, {success.high:.1%}] over {len(results)} seeds on "
        f"{results[0].suite} ({', '.join(f'{rate:.1%}' for rate in each)}). {failed_seeds(each).sentence}"
    )


app.command()(worker)


@app.command()
def train(
    preset_name: Annotated[
        str, typer.Option("--preset", help=f"Where to start from: {', '.join(p.id for p in PRESETS)}.")
    ] = "default",
    config: Annotated[
        Path | None,
        typer.Option(help="A training as JSON (as in a checkpoint's manifest), instead of a preset.", exists=True),
    ] = None,
    arena: Annotated[str | None, typer.Option(help="simple or complex.")] = None,
    observation: Annotated[str | None, typer.Option(help="improved or paper.")] = None,
    reward: Annotated[str | None, typer.Option(help="basic, clearance or alignment.")] = None,
    algorithm: Annotated[str | None, typer.Option(help="ppo, ddpg, td3 or sac.")] = None,
    network: Annotated[str | None, typer.Option(help="mlp, resblock, or another that is known.")] = None,
    steps: Annotated[int | None, typer.Option(help="Environment steps of all robots together.")] = None,
    seed: Annotated[int, typer.Option(help="Of weights, exploration and environment.")] = 0,
    out: Annotated[Path, typer.Option(help="Directory for the checkpoints.")] = Path("checkpoints"),
    resume: Annotated[Path | None, typer.Option(help="A checkpoint to continue from, with its own configuration.")] = None,
    start_from: Annotated[
        str | None, typer.Option(help="A checkpoint, or the name of a shipped policy, whose weights to begin with.")
    ] = None,
) -> None:
    """Train a policy, with a progress bar; Ctrl-C writes a checkpoint first."""
    changes = _changes(arena, observation, reward, algorithm, network, steps)
    try:
        # Only now: torch and numba take two seconds to import, which `--help` should not.
        from workers.checkpoints import read_manifest
        from workers.training.trainer import train as run

        beginning: Path | None = None
        if resume is not None:
            manifest = read_manifest(resume)
            training, seed = _changed(manifest.training, changes), manifest.seed
        else:
            start = (
                preset(preset_name).training if config is None else TrainingConfig.model_validate_json(config.read_text())
            )
            training = _changed(start, changes)
            if start_from is not None:
                training, beginning = _starting_from(training, start_from)
        columns = "[progress.percentage]{task.percentage:>3.0f}%", "{task.fields[speed]}", "{task.fields[success]}"
        with Progress(BarColumn(), *map(TextColumn, columns), TimeRemainingColumn(), console=_console) as progress:
            reporter = ConsoleReporter(progress, training.steps)
            signal.signal(signal.SIGINT, reporter.request_stop)
            outcome = run(training.as_installed(), seed, reporter, out, resume, beginning)
    except ValidationError as error:
        lines = (f"  {'.'.join(map(str, problem['loc']))}: {problem['msg']}" for problem in to_tell(error.errors()))
        _fail("\n".join(("not a valid training:", *lines)))
    except (WorkerError, SimError, KeyError) as error:
        _fail(str(error.args[0]))
    _console.print(f"{outcome}: {reporter.last}")


@app.command()
def evaluate(
    checkpoints: Annotated[
        list[Path] | None, typer.Argument(help="Checkpoint archives.", exists=True, dir_okay=False)
    ] = None,
    suite: Annotated[
        str | None, typer.Option(help="A suite by name; that of each checkpoint's own task without it.")
    ] = None,
    baseline: Annotated[
        str | None,
        typer.Option(help="In place of checkpoints: random, go-to-goal, dynamic-window, or one of an extension's."),
    ] = None,
) -> None:
    """Drive each checkpoint's policy, or a baseline, through a frozen suite and print how it did.

    The 95 % interval of a checkpoint is over the episodes of its one policy (exact). Where the checkpoints are several seeds
    of one training, a last line has the interval over seeds (Student's t), of the newest checkpoint of each.
    """
    if (baseline is None) == (not checkpoints):
        _fail("name checkpoints, or a --baseline and its --suite")
    try:
        if baseline is not None:
            _evaluate_baseline(baseline, suite or "complex-200")
            return
        from sim.suites import load_suite, suite_for
        from workers.checkpoints import read_policy
        from workers.training.evaluation import evaluate as run

        newest: dict[int, tuple[int, EvaluationResult]] = {}
        alike = set()
        assert checkpoints
        for checkpoint in checkpoints:
            manifest, policy = read_policy(checkpoint)
            task = manifest.training.task
            result = run(policy, task, suite_for(task) if suite is None else load_suite(suite))
            name = f"{checkpoint}: " if len(checkpoints) > 1 else ""
            _console.print(name + describe(result), highlight=False, markup=False, soft_wrap=True)
            alike.add((manifest.training.model_dump_json(), result.suite_hash))
            if manifest.seed not in newest or manifest.step > newest[manifest.seed][0]:
                newest[manifest.seed] = manifest.step, result
        if len(alike) == 1 and len(newest) > 1:
            seeds = [result for _, (_, result) in sorted(newest.items())]
            _console.print(describe_seeds(seeds), highlight=False, markup=False, soft_wrap=True)
    except ValidationError as error:
        _fail("\n".join(problem["msg"] for problem in error.errors()))
    except (WorkerError, SimError, KeyError) as error:
        _fail(str(error.args[0]))


app.command()(reproduce)


def _evaluate_baseline(name: str, suite: str) -> None:
    """A baseline with its defaults and the default robot, on a frozen suite."""
    from sim.baselines.named import BASELINES, controller_of
    from sim.config import TaskConfig
    from sim.suites import load_suite, run_controller
    from workers.training.evaluation import to_result

    task, places = TaskConfig(), load_suite(suite)
    table = run_controller(controller_of(BASELINES.validate_python({"name": name}), task), task, places)
    _console.print(describe(to_result(table, places)), highlight=False, markup=False, soft_wrap=True)


def _starting_from(training: TrainingConfig, policy: str) -> tuple[TrainingConfig, Path]:
    """A training that begins with a policy, an archive or the name of a shipped one; and the archive.

    Raises:
        UnknownPolicyError: it is neither.
    """
    from workers.checkpoints import read_manifest, sha256_of
    from workers.shipped.library import shipped_policy

    archive = Path(policy)
    if archive.is_file():
        manifest = read_manifest(archive)
        title = f"{archive.name} (seed {manifest.seed}, step {manifest.step:,})"
    else:
        shipped = shipped_policy(policy)
        archive, title = shipped.archive, shipped.card.title
    with archive.open("rb") as file:
        sha256 = sha256_of(file)
    source: Literal["file", "shipped"] = "file" if archive == Path(policy) else "shipped"
    start = StartFrom(source=source, name=Path(policy).name, sha256=sha256, title=title)
    return training.model_copy(update={"start_from": start}), archive


def _changes(
    arena: str | None,
    observation: str | None,
    reward: str | None,
    algorithm: str | None,
    network: str | None,
    steps: int | None,
) -> dict[str, Any]:
    """The options that were given, as parts of a training's JSON."""
    task: dict[str, Any] = {}
    learner: dict[str, Any] = {}
    if arena is not None:
        task["arena"] = {"name": arena}
    if observation is not None:
        task["observation"] = observation
    if reward is not None:
        task["reward"] = {"name": reward}
    if algorithm is not None:
        learner["name"] = algorithm
    if network is not None:
        learner["network"] = {"name": network}
    return {"task": task, "algorithm": learner} | ({} if steps is None else {"steps": steps})


def _changed(training: TrainingConfig, changes: dict[str, Any]) -> TrainingConfig:
    """A training with some of its parts replaced; a part with another name starts from that name's defaults."""
    return TrainingConfig.model_validate(_merged(training.model_dump(), changes))


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    if "name" in changes and changes["name"] != base.get("name"):
        return changes
    merged = dict(base)
    for key, value in changes.items():
        inner = merged.get(key)
        merged[key] = _merged(inner, value) if isinstance(inner, dict) and isinstance(value, dict) else value
    return merged


def _fail(message: str) -> None:
    Console(stderr=True).print(message, style="red", highlight=False, markup=False)
    raise typer.Exit(2)
