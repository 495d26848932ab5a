"""`mapless arena`: import arenas, list them, show one."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

if TYPE_CHECKING:
    from server.arenas.store import ArenaStore
    from sim.config import ArenaFile

app = typer.Typer(help="Import arenas from files, and look at them.", no_args_is_help=True)

DataDir = Annotated[Path | None, typer.Option(help="Where everything is kept [MAPLESS_DATA_DIR, data].")]

# Characters of a hash that tell arenas apart at a glance.
_SHORT = 12


@app.command("import")
def import_arenas(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Our own YAML, Gazebo worlds (.world, .sdf) with their keyframes (NAME.keyframes.yaml) or plugins' sources "
            "beside them, or the YAML of ROS maps, each with its image beside it.",
            show_default=False,
        ),
    ],
    data_dir: DataDir = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Import without asking.")] = False,
) -> None:
    """Draw what was understood of arenas' files, ask, and import them; they are in the gallery at once.

    Where nobody can answer, it draws and imports.
    """
    from server.errors import ServiceError
    from sim.arenas.drawing import draw
    from sim.arenas.files import load_arena
    from sim.errors import ArenaFileError

    store = _store(data_dir)
    refused = 0
    for file in files:
        try:
            document = load_arena(file)
            typer.echo(draw(document))
            if not yes and sys.stdin.isatty() and not typer.confirm(f"Import {_line(document)}?", default=True):
                continue
            store.add(document)
        except (ArenaFileError, ServiceError, OSError) as error:
            sys.stderr.write(f"mapless: {error}\n")
            refused += 1
            continue
        typer.echo(_line(document))
    if refused:
        raise typer.Exit(1)


@app.command("list")
def list_arenas(data_dir: DataDir = None) -> None:
    """List the imported arenas."""
    for stored in _store(data_dir).all():
        typer.echo(_line(stored.document))


@app.command()
def show(
    arena: Annotated[str, typer.Argument(help="Its name, or the beginning of its hash.", show_default=False)],
    data_dir: DataDir = None,
) -> None:
    """Print an imported arena in our own YAML, to edit and import again."""
    from server.errors import ServiceError
    from sim.arenas.files import write_own

    try:
        document = _store(data_dir).find(arena).document
    except ServiceError as error:
        _refuse(f"{error} `mapless arena list` shows all.")
    typer.echo(write_own(document), nl=False)


def _line(document: "ArenaFile") -> str:
    count = len(document.circles) + len(document.boxes)
    moving = f", {len(document.movers)} moving" if document.movers else ""
    size = f"{document.width:g} x {document.height:g} m"
    return f"{document.sha256[:_SHORT]}  {document.name}  {size}, {count} obstacles{moving}"


def _store(data_dir: Path | None) -> "ArenaStore":
    from server.arenas.store import ArenaStore
    from server.settings import Settings

    settings = Settings() if data_dir is None else Settings(data_dir=data_dir)
    return ArenaStore(settings.arenas_dir)


def _refuse(message: str) -> NoReturn:
    sys.stderr.write(f"mapless: {message}\n")
    raise typer.Exit(1)
