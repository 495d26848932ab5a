"""The `mapless` command. Its own imports are light: `mapless --help` must not wait for torch or for a database driver."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from pydantic import ValidationError

import mapless_client.command
from server.arenas.cli import app as arena_app
from server.people.cli import app as people_app
from workers.extension_cli import app as extension_app

if TYPE_CHECKING:
    from server.settings import Settings

app = typer.Typer(
    name="mapless",
    help="Train LiDAR navigation policies, watch the robots learn, take the policy away.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.add_typer(arena_app, name="arena")
app.add_typer(people_app, name="people")
app.add_typer(extension_app, name="extension")
# Those of the client, which speak to a server that runs anywhere.
app.registered_commands.extend(mapless_client.command.app.registered_commands)

_OF_WORKERS = ("train", "evaluate", "export", "policies", "reproduce", "worker")
# Everything after the command's name belongs to the workers' own command line, --help included.
_PASSED_ON: dict[str, Any] = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}

Host = Annotated[str | None, typer.Option(help="Address to bind [MAPLESS_HOST, 127.0.0.1].")]
Port = Annotated[int | None, typer.Option(help="Port to bind, 0 for a free one [MAPLESS_PORT, 8400].")]
DataDir = Annotated[Path | None, typer.Option(help="Where everything is kept [MAPLESS_DATA_DIR, data].")]


def main(arguments: list[str] | None = None) -> None:
    """Run the command; a refusal is one line on standard error and exit status 1."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        app(arguments, prog_name="mapless")
    except Exception as error:
        from sim.parts import explain  # which loads Gymnasium: only where something went wrong

        explain(error, "worker" if given and given[0] in _OF_WORKERS else "server")
        raise


@app.callback(invoke_without_command=True)
def _options(
    show_version: Annotated[
        bool, typer.Option("--version", help="Show version and commit, and exit.", is_eager=True)
    ] = False,
) -> None:
    if show_version:
        show_version_and_exit()


def show_version_and_exit() -> NoReturn:
    """Print version and commit, and exit."""
    from server.version import commit, version

    typer.echo(f"mapless {version()}" + (f" ({commit()})" if commit() else ""))
    raise typer.Exit


@app.command()
def version() -> None:
    """Show version and commit."""
    show_version_and_exit()


@app.command()
def serve(host: Host = None, port: Port = None, data_dir: DataDir = None) -> None:
    """Start the server alone; workers are started elsewhere."""
    # First of all, so that a wrong setting is answered before the server's imports are waited for.
    settings = _settings(host=host, port=port, data_dir=data_dir)
    from server.errors import ServiceError
    from server.processes.serve import serve as serve_until_interrupted

    try:
        serve_until_interrupted(settings, on_ready=lambda url: typer.echo(f"Mapless is at {url}"))
    except (ServiceError, OSError) as error:
        _refuse(str(error))


@app.command()
def up(
    host: Host = None,
    port: Port = None,
    data_dir: DataDir = None,
    workers: Annotated[int | None, typer.Option(min=0, help="Trainings side by side [MAPLESS_WORKERS, one a core].")] = None,
    no_workers: Annotated[
        bool, typer.Option("--no-workers", help="The server alone; workers are started elsewhere.")
    ] = False,
) -> None:
    """Start the server and its workers, and keep them running."""
    settings = _settings(host=host, port=port, data_dir=data_dir, workers=0 if no_workers else workers)
    from server.errors import ServiceError
    from server.processes.supervisor import Supervisor
    from sim.parts import require

    if settings.workers != 0:
        require("worker")

    try:
        Supervisor(settings, say=typer.echo).run()
    except (ServiceError, OSError) as error:
        _refuse(str(error))


@app.command()
def doctor(
    data_dir: DataDir = None,
    as_json: Annotated[bool, typer.Option("--json", help="For programs: one JSON object.")] = False,
) -> None:
    """Look at database, broker, store, clock, versions and disk, and say what to do."""
    settings = _settings(data_dir=data_dir)
    from server.doctor.report import report

    text, well = report(settings, as_json=as_json)
    typer.echo(text)
    if not well:
        raise typer.Exit(1)


@app.command()
def backup(file: Annotated[Path, typer.Argument(help="To be written.")], data_dir: DataDir = None) -> None:
    """Write everything that can't be made again into one file, while the service runs."""
    settings = _settings(data_dir=data_dir)
    from server.keeping.backup import back_up

    with _refusals():
        back_up(settings, file.absolute(), typer.echo)


@app.command()
def restore(
    file: Annotated[Path, typer.Argument(help="That `mapless backup` wrote.")],
    replace: Annotated[bool, typer.Option("--replace", help="Give up what is there.")] = False,
    data_dir: DataDir = None,
) -> None:
    """Bring back what a backup holds; the service must not run."""
    settings = _settings(data_dir=data_dir)
    from server.keeping.restore import restore as bring_back

    with _refusals():
        bring_back(settings, file, typer.echo, replace=replace)


@app.command()
def move(
    source: Annotated[str, typer.Argument(metavar="FROM", help="URL of the database to read: sqlite:///data/mapless.db")],
    target: Annotated[str, typer.Argument(metavar="TO", help="URL of an empty one: postgresql+psycopg://...")],
    while_running: Annotated[
        bool, typer.Option("--while-running", help="Leave out what a server writes from now on.")
    ] = False,
) -> None:
    """Take every row from one database to another, and compare them."""
    os.umask(0o077)
    from server.keeping.move import move as take_over

    with _refusals():
        take_over(source, target, typer.echo, while_running=while_running)


@app.command()
def move_checkpoints(
    source: Annotated[str, typer.Argument(metavar="FROM", help="Folder or URL of the store to read: data/checkpoints")],
    target: Annotated[str, typer.Argument(metavar="TO", help="Of the one to fill: s3://mapless/checkpoints")],
    data_dir: DataDir = None,
) -> None:
    """Copy every checkpoint from one store to another, and compare them, while the service runs."""
    settings = _settings(data_dir=data_dir)
    from server.keeping.move_checkpoints import move_checkpoints as take_over

    with _refusals():
        take_over(settings, source, target, typer.echo)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def train(context: typer.Context) -> None:
    """Train without the service, with a progress bar."""
    _workers_command("train", context)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def evaluate(context: typer.Context) -> None:
    """Measure checkpoints on a suite."""
    _workers_command("evaluate", context)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def export(context: typer.Context) -> None:
    """Export a checkpoint's policy: ONNX, or a bundle with a ROS 2 node."""
    _workers_command("export", context)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def policies(context: typer.Context) -> None:
    """List and export the trained policies that ship with Mapless."""
    _workers_command("policies", context)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def reproduce(context: typer.Context) -> None:
    """Train every row of the paper's tables, and say which of its claims hold."""
    _workers_command("reproduce", context)


@app.command(context_settings=_PASSED_ON, add_help_option=False)
def worker(context: typer.Context) -> None:
    """Start a worker for a server, here or on another machine."""
    _workers_command("worker", context)


def _workers_command(name: str, context: typer.Context) -> None:
    from workers.cli import app as workers_app

    workers_app([name, *context.args], prog_name="mapless")


def _settings(**given: Any) -> "Settings":
    """The settings of the environment, with what the command line says in their place."""
    from server.settings import Settings

    # Databases, logs and checkpoints are their owner's alone; logs hold the login URL.
    os.umask(0o077)
    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        for problem in error.errors():
            name = f"MAPLESS_{problem['loc'][0]}: ".upper() if problem["loc"] else ""
            sys.stderr.write(f"mapless: {name}{problem['msg'].removeprefix('Value error, ')}\n")
        raise typer.Exit(1) from None


@contextmanager
def _refusals() -> Iterator[None]:
    """What stands in the way of a database's or a store's work is said in a line."""
    from sqlalchemy.exc import ArgumentError, OperationalError

    from server.errors import ServiceError

    try:
        yield
    except OperationalError as error:
        _refuse(str(error.orig).splitlines()[0])
    except (ArgumentError, OSError, ServiceError) as error:
        _refuse(str(error))


def _refuse(message: str) -> NoReturn:
    sys.stderr.write(f"mapless: {message}\n")
    raise typer.Exit(1)
