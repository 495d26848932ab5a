"""`mapless extension`: begin one, and see those that are installed."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    help="Add algorithms, rewards, arenas and baselines of your own, as a Python package.", no_args_is_help=True
)


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="Of the extension: small letters, digits and _.")],
    directory: Annotated[Path, typer.Option("--in", help="Where its folder is made.")] = Path(),
) -> None:
    """Write a package with one small example of each kind of part, and its tests."""
    from workers.extending.new import write_package

    try:
        folder = write_package(name, directory)
    except (ValueError, OSError) as error:
        typer.echo(f"mapless: {error}", err=True)
        raise typer.Exit(1) from None
    typer.echo(f"{folder} is written; its README.md says how to install it")


@app.command("list")
def list_extensions() -> None:
    """Show the extensions of this environment, and those that are refused; exit status 1 if there are any of these."""
    from sim.extending.discovery import installed

    found = installed()
    for extension in found.extensions:
        typer.echo(f"{extension.name} {extension.version}")
        for part in extension.parts:
            typer.echo(f"  {part.kind:<13} {part.part_name()}")
    for refused in found.refused:
        typer.echo(f"{refused.name} is refused: {refused.reason}")
    if not found.extensions and not found.refused:
        typer.echo("none")
    if found.refused:
        raise typer.Exit(1)
