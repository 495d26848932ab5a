"""The commands for the policies that ship with the project."""

from pathlib import Path
from typing import Annotated

import typer

from workers.errors import WorkerError
from workers.export.command import ExportFormat, export
from workers.shipped.library import ShippedPolicy, shipped_policies, shipped_policy

app = typer.Typer(help="The trained policies that ship with Mapless.", no_args_is_help=True)


@app.command(name="list")
def list_policies() -> None:
    """Show them, and how they did on frozen suites."""
    for policy in shipped_policies():
        card = policy.card
        typer.echo(f"{card.name}: {card.description}\n  {policy.archive}\n  made by: {card.command}")
        for result in card.results:
            found, interval = result.figures, result.figures.success_interval
            typer.echo(
                f"  {result.suite}: {found.success:.1%} success [{interval.low:.1%}, {interval.high:.1%}] of "
                f"{found.episodes}, {found.collision:.1%} collisions, {found.timeout:.1%} time-outs, SPL {found.spl:.2f}"
            )


@app.command(name="export")
def export_policy(
    name: Annotated[str, typer.Argument(help="As `mapless policies list` shows it.")],
    export_format: Annotated[
        ExportFormat | None,
        typer.Option("--format", help="onnx, onnx-scan or bundle (see mapless export); the checkpoint itself without it."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write.")] = None,
) -> None:
    """Copy a policy's checkpoint, or export it."""
    policy = _named(name)
    if export_format is not None:
        export(policy.archive, export_format, out or Path(f"{name}{export_format.suffix}"))
        return
    path = out or Path(f"{name}.zip")
    path.write_bytes(policy.archive.read_bytes())
    typer.echo(str(path))


def _named(name: str) -> ShippedPolicy:
    try:
        return shipped_policy(name)
    except WorkerError as error:
        typer.echo(f"mapless: {error}", err=True)
        raise typer.Exit(1) from None
