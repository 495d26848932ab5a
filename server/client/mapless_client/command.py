"""`mapless runs`, `launch`, `search`, `watch`, `pull`, `compare` and whole projects: a server from any command line."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, get_args

import typer

if TYPE_CHECKING:
    from pydantic import BaseModel

    from mapless_client.client import Client, TableForm
    from mapless_client.models import ComparedExperiment, Estimate, Run, SeedMean

app = typer.Typer(
    name="mapless",
    help="Launch, watch and compare the trainings of a Mapless server, and take their policies home.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

AsJson = Annotated[bool, typer.Option("--json", help="For programs: JSON.")]
Url = Annotated[str | None, typer.Option(help="Of the server [MAPLESS_URL, http://127.0.0.1:8400].")]
_COMMA = ","


def main() -> None:
    """Run the command; a refusal is one line on standard error and exit status 1."""
    app(prog_name="mapless")


@app.command()
def runs(
    query: Annotated[list[str] | None, typer.Argument(help="As in the table of trainings: 'algorithm = ppo'.")] = None,
    limit: Annotated[int, typer.Option(min=1, help="Trainings at most.")] = 50,
    sort: Annotated[str, typer.Option(help="A key; with a minus before it the largest first.")] = "-created",
    column: Annotated[list[str] | None, typer.Option(help="A setting or a metric to show; may be given again.")] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """List a server's trainings, or those that a query finds."""
    from itertools import islice

    with _server(url) as client:
        columns = column or []
        found = client.experiments(" ".join(query or []), sort=sort, columns=columns)
        for training in islice(found, limit):
            if as_json:
                _json(training)
                continue
            shown = [_value(training.settings.get(each, training.metrics.get(each))) for each in columns]
            success = _estimate(training.success)
            cells = [f"{training.id:16}", f"{training.state:9}", f"{training.progress:4.0%}", f"{success:20}", *shown]
            typer.echo("  ".join([*cells, training.name]))


@app.command()
def launch(
    name: Annotated[str, typer.Argument(help="What you will know it by.")],
    seeds: Annotated[str, typer.Option(help="Comma-separated: one run each.")] = "0",
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="A setting and its value: algorithm.gamma=0.99; may be given again.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Configuration as the form's JSON; - for standard input.", allow_dash=True)
    ] = None,
    project: Annotated[str | None, typer.Option(help="Id of the project.")] = None,
    follow: Annotated[bool, typer.Option("--watch", help="And watch it to its end.")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Launch a training on a server, and print its id."""
    training = _training(config, settings or [])
    with _server(url) as client:
        launched = client.launch(name, training, seeds=_seeds(seeds), project=project)
        if as_json:
            _json(launched)
        else:
            typer.echo(launched.id)
        if follow:
            _follow(client, launched.id, as_json=as_json)


@app.command()
def search(
    name: Annotated[str, typer.Argument(help="What you will know it by.")],
    ranges: Annotated[
        list[str] | None,
        typer.Option("--range", help="A number's range: algorithm.gamma=0.9..0.99; with :log at its end by ratio."),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--values", help="The values of a setting: algorithm.epochs=3,6,10, or lists: [64,64],[256]."),
    ] = None,
    trials: Annotated[int, typer.Option(min=1, help="Choices of the settings to train.")] = 30,
    sampler: Annotated[str, typer.Option(help="tpe, random, quasi or grid.")] = "tpe",
    seeds: Annotated[str, typer.Option(help="Comma-separated, three or more: of every trial.")] = "0,1,2",
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Another setting and its value: steps=100000; may be given again.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Configuration as the form's JSON; - for standard input.", allow_dash=True)
    ] = None,
    project: Annotated[str | None, typer.Option(help="Id of the project.")] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Launch a study, which searches settings of a training, and print its id."""
    searched = [_range(each) for each in ranges or []] + [_list(each) for each in values or []]
    training = _training(config, settings or [])
    with _server(url) as client:
        study = client.search(name, searched, training, trials=trials, sampler=sampler, seeds=_seeds(seeds), project=project)
    if as_json:
        _json(study)
    else:
        typer.echo(study.id)


@app.command()
def watch(
    training: Annotated[str, typer.Argument(help="Its id.")],
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Follow a training to its end; exit status 1 where a run has failed."""
    with _server(url) as client:
        _follow(client, training, as_json=as_json)


@app.command()
def pull(
    what: Annotated[str, typer.Argument(help="Id of a training, of a run or of a checkpoint.")],
    to: Annotated[Path, typer.Option(help="Directory.")] = Path(),
    form: Annotated[str, typer.Option("--as", help="archive, bundle or onnx.")] = "archive",
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Take home the best policy of each run, checked by its SHA-256; once more goes on where it broke off."""
    from mapless_client.downloads import FORMS

    form_named = next((each for each in FORMS if each == form), None)
    if form_named is None:
        _refuse(f"--as takes {', '.join(FORMS)}, not {form}.")
    with _server(url) as client:
        for checkpoint_id in _checkpoints(client, what):
            pulled = client.pull(checkpoint_id, to, form_named)
            if as_json:
                _line({"checkpoint": checkpoint_id, "path": str(pulled.path), "size": pulled.size, "sha256": pulled.sha256})
            else:
                typer.echo(str(pulled.path))


@app.command()
def compare(
    trainings: Annotated[list[str], typer.Argument(help="Their ids; the first is what the others are judged by.")],
    margin: Annotated[float, typer.Option(help="Success rates that differ by less are equivalent.")] = 0.02,
    base: Annotated[str | None, typer.Option(help="Id of the one to judge by, in place of the first.")] = None,
    pairs: Annotated[bool, typer.Option("--pairs", help="Judge every pair.")] = False,
    latex: Annotated[bool, typer.Option("--latex", help="The tables in LaTeX (booktabs).")] = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="The tables in Markdown.")] = False,
    html: Annotated[bool, typer.Option("--html", help="The whole comparison as one HTML file.")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Final figures side by side, with intervals, verdicts and the settings that differ."""
    if sum((latex, markdown, html, as_json)) > 1:
        _refuse("One of --latex, --markdown, --html and --json.")
    with _server(url) as client:
        if html:
            typer.echo(client.comparison_report(trainings, margin, base=base, pairs=pairs))
            return
        if latex or markdown:
            from mapless_client.client import Table

            form: TableForm = "latex" if latex else "markdown"
            for table in get_args(Table):
                typer.echo(client.comparison_table(trainings, table, form, margin, base=base, pairs=pairs))
            return
        comparison = client.compare(trainings, margin, base=base, pairs=pairs)
    if as_json:
        _json(comparison)
        return
    for experiment in comparison.experiments:
        typer.echo(
            "  ".join([f"{experiment.id:16}", f"{_estimate(experiment.success):20}", _seeds_of(experiment), experiment.name])
        )
    for verdict in comparison.verdicts:
        beside = f" beside {verdict.base}" if pairs else ""
        typer.echo(f"{verdict.other}{beside} {verdict.measure}: {verdict.word}. {verdict.reason}")
    for difference in comparison.differences:
        typer.echo(f"{difference.path}: {', '.join(json.dumps(value) for value in difference.values)}")
    for warning in comparison.warnings:
        typer.echo(f"warning: {warning}")


@app.command()
def projects(as_json: AsJson = False, url: Url = None) -> None:
    """List a server's projects."""
    with _server(url) as client:
        for project in client.projects():
            if as_json:
                _json(project)
            else:
                typer.echo(f"{project.id:16}  {project.experiments:5}  {project.role:6}  {project.name}")


@app.command()
def export_project(
    project: Annotated[str, typer.Argument(help="Its id.")],
    to: Annotated[Path, typer.Option(help="Directory.")] = Path(),
    url: Url = None,
) -> None:
    """Take a whole project home in one file: trainings, points, checkpoints, evaluations, notes and tags."""
    with _server(url) as client:
        typer.echo(str(client.export_project(project, to)))


@app.command()
def import_project(
    archive: Annotated[Path, typer.Argument(help="What export-project wrote.")],
    project: Annotated[str, typer.Option(help="Id of the project to import into.")] = "default",
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Bring an exported project to another server, with the same ids; exit status 1 where anything was refused."""
    if not archive.is_file():
        _refuse(f"{archive} is no file.")
    with _server(url) as client:
        came = client.import_project(archive, project)
    if as_json:
        _json(came)
    else:
        for run in came.runs:
            typer.echo("  ".join([f"{run.id:16}", f"{run.outcome:8}", *([run.why] if run.why else [])]))
        for thing in came.others:
            typer.echo(
                "  ".join([f"{thing.id:16.16}", f"{thing.outcome:8}", thing.kind, *([thing.why] if thing.why else [])])
            )
    if "refused" in {run.outcome for run in came.runs} | {thing.outcome for thing in came.others}:
        raise typer.Exit(1)


@app.command()
def mcp(url: Url = None) -> None:
    """Serve assistants over standard input and output (Model Context Protocol), within the token's rights."""
    try:
        from mapless_client.assistant import assistant
    except ModuleNotFoundError:
        _refuse("this needs the package mcp, 2.3 or newer: pip install './server/client[mcp]'")
    with _server(url) as client:
        assistant(client).run("stdio")


def _follow(client: Client, experiment_id: str, *, as_json: bool) -> None:
    said: dict[str, str] = {}
    experiment = None
    for experiment in client.watch(experiment_id):
        if as_json:
            _json(experiment)
            continue
        for run in experiment.runs:
            if said.get(run.id) != (line := _run_line(run)):
                said[run.id] = line
                typer.echo(line)
    if experiment is not None and any(run.state == "failed" for run in experiment.runs):
        raise typer.Exit(1)


def _checkpoints(client: Client, identifier: str) -> Iterator[str]:
    """The ids of the checkpoints that are meant; what is neither a training nor a run is one."""
    from mapless_client.errors import NotFoundError

    try:
        run_ids = [run.id for run in client.experiment(identifier).runs]
    except NotFoundError:
        try:
            run_ids = [client.run(identifier).id]
        except NotFoundError:
            yield identifier
            return
    for run_id in run_ids:
        yield client.best_checkpoint(run_id).id


@contextmanager
def _server(url: str | None) -> Iterator[Client]:
    from mapless_client.client import connect
    from mapless_client.errors import ClientError

    try:
        with connect(url) as client:
            yield client
    except ClientError as error:
        _refuse(str(error))


def _training(config: Path | None, settings: list[str]) -> dict[str, Any]:
    training: dict[str, Any] = {}
    if config is not None:
        try:
            training = json.loads(sys.stdin.read() if str(config) == "-" else config.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            _refuse(f"{config}: {error}")
    for setting in settings:
        path, equals, text = setting.partition("=")
        if not equals:
            _refuse(f"--set {setting}: a setting, an equals sign, a value.")
        inner = training
        *folders, last = path.split(".")
        for folder in folders:
            inner = inner.setdefault(folder, {})
            if not isinstance(inner, dict):
                _refuse(f"--set {path}: {folder} has nothing in it.")
        inner[last] = _read(text)
    return training


def _range(text: str) -> dict[str, Any]:
    path, _, ends = text.partition("=")
    ends, colon, scale = ends.partition(":")
    low, _, high = ends.partition("..")
    try:
        found = {"kind": "range", "path": path, "low": float(low), "high": float(high), "log": scale == "log"}
    except ValueError:
        found = {}
    if not found or (colon and scale != "log"):
        _refuse(f"--range {text}: a setting, an equals sign, two numbers with .. between them, :log if by ratio.")
    return found


def _list(text: str) -> dict[str, Any]:
    path, equals, values = text.partition("=")
    if not equals:
        _refuse(f"--values {text}: a setting, an equals sign, values with commas between them.")
    try:
        # Lists in lists have commas of their own: [64, 64], [256].
        found = json.loads(f"[{values}]")
    except ValueError:
        found = [_read(value) for value in values.split(_COMMA)]
    return {"kind": "list", "path": path, "values": found}


def _read(value: str) -> Any:
    try:
        return json.loads(value)
    except ValueError:
        return value


def _seeds(text: str) -> list[int]:
    try:
        return [int(seed) for seed in text.split(_COMMA)]
    except ValueError:
        _refuse(f"--seeds takes whole numbers with commas between them, not {text!r}.")


def _run_line(run: Run) -> str:
    rate = run.eval_success_rate if run.eval_success_rate is not None else run.success_rate
    parts = [f"seed {run.seed}", run.state, f"{run.step:,} of {run.total_steps:,} steps"]
    if rate is not None:
        parts.append(f"{rate:.1%} success")
    if run.seconds_left is not None:
        parts.append(f"{run.seconds_left:.0f} s left")
    if run.error is not None:
        parts.append(run.error)
    return f"{run.id}  {', '.join(parts)}"


def _seeds_of(experiment: ComparedExperiment) -> str:
    return f"{experiment.seeds} {'seed' if experiment.seeds == 1 else 'seeds'}"


def _estimate(estimate: Estimate | None) -> str:
    return "-" if estimate is None else f"{estimate.value:.1%} [{estimate.low:.1%}, {estimate.high:.1%}]"


def _value(value: float | str | SeedMean | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    return f"{value if isinstance(value, float | int) else value.value:.6g}"


def _json(model: BaseModel) -> None:
    typer.echo(model.model_dump_json())


def _line(value: dict[str, Any]) -> None:
    typer.echo(json.dumps(value))


def _refuse(message: str) -> NoReturn:
    typer.echo(f"mapless: {message}", err=True)
    raise typer.Exit(1)
