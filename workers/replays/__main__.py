"""`python -m workers.replays CHECKPOINT --out FILE`: records an evaluation, as a process of its own."""

from pathlib import Path
from typing import Annotated

import typer

from sim.errors import SimError
from workers.errors import WorkerError


def main(
    checkpoint: Annotated[Path, typer.Argument(help="A checkpoint archive.", exists=True, dir_okay=False)],
    out: Annotated[Path, typer.Option(help="File to write.")],
    suite: Annotated[str | None, typer.Option(help="A frozen suite; that of the checkpoint's own task without it.")] = None,
) -> None:
    """Drive a checkpoint's policy through a suite and keep every moment."""
    # Only now: torch and numba take seconds to import, which `--help` should not.
    from workers.replays.record import record

    try:
        record(checkpoint, suite).save(out)
    except (WorkerError, SimError, OSError) as error:
        typer.echo(f"mapless: {error}", err=True)
        raise typer.Exit(1) from None


if __name__ == "__main__":
    typer.run(main)
