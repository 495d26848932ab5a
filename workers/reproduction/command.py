"""`mapless reproduce`: the campaign in a terminal, and the page that comes of it."""

import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from workers.errors import WorkerError

if TYPE_CHECKING:
    from workers.reproduction.outcome import SeedDone, Tick

_REPORT = "report.md"


def reproduce(
    directory: Annotated[Path, typer.Option(help="Of the campaign; one that was interrupted goes on where it was.")] = Path(
        "reproduction"
    ),
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Of each row of the paper's tables; claims need five.")] = 5,
    at_most: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=100,
            help="Rows whose intervals are wider than the stated margins get five seeds more, and more, up to this.",
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, max=256, help="Trainings side by side, one core each.")] = 2,
    effort: Annotated[
        float, typer.Option(min=1e-4, max=1.0, help="Part of the training steps; below 1 it is a trial.")
    ] = 1.0,
    write: Annotated[
        Path | None,
        typer.Option(help="The page, its picture in images/ and its figures beside it; in the directory if not given."),
    ] = None,
    known: Annotated[
        Path | None,
        typer.Option(help="Figures that such a page was made of: what was trained for them is not trained again."),
    ] = None,
) -> None:
    """Train every row of the paper's tables with several seeds, and say which of its claims hold."""
    # Only now: torch and numba take two seconds to import, which `--help` should not.
    from workers.reproduction.campaign import reproduce as run
    from workers.reproduction.kept import read_figures, write_figures
    from workers.reproduction.report import write_report
    from workers.reproduction.rows import ROWS

    console = Console()
    page = write or directory / _REPORT
    columns = "[progress.percentage]{task.percentage:>3.0f}%", "{task.fields[trainings]}", "{task.fields[left]}"
    try:
        with Progress(BarColumn(), *map(TextColumn, columns), console=console) as progress:
            bar = progress.add_task("campaign", total=1.0, trainings="", left="starting")

            def tell(done: "SeedDone") -> None:
                outcome = f"failed: {done.error}"
                if done.trained is not None:
                    measured = done.trained.result.measured
                    outcome = f"{measured.success:6.1%} success, {measured.steps:5.1f} steps per episode"
                progress.console.print(f"{done.row:30} seed {done.seed:2}  {outcome}", highlight=False, markup=False)

            def draw(tick: "Tick") -> None:
                through = f"{tick.finished} of {tick.trainings} trainings"
                progress.update(bar, completed=tick.done, trainings=through, left=_left(tick))

            done, seconds = read_figures(known, ROWS) if known else ((), 0.0)
            outcome = run(directory, seeds, jobs, at_most=at_most, known=done, effort=effort, on_done=tell, on_tick=draw)
    except WorkerError as error:
        sys.stderr.write(f"mapless: {error}\n")
        raise typer.Exit(1) from None
    outcome = outcome.model_copy(update={"seconds": outcome.seconds + seconds})
    page.parent.mkdir(parents=True, exist_ok=True)
    machine = f"{os.cpu_count()} cores, {jobs} side by side"
    command = _command(seeds, at_most, jobs, effort, write)
    write_report(page, outcome, command, datetime.now(UTC).date().isoformat(), machine)
    write_figures(page.with_suffix(".json"), outcome, ROWS)
    console.print(page.read_text(), markup=False, highlight=False, soft_wrap=True)
    console.print(f"Written to {page}", markup=False, highlight=False, soft_wrap=True)


def _left(tick: "Tick") -> str:
    if tick.finished == tick.trainings:
        return ""
    minutes = round(tick.seconds_left / 60)
    return "less than a minute left" if minutes < 1 else f"about {minutes} min left"


def _command(seeds: int, at_most: int | None, jobs: int, effort: float, write: Path | None) -> str:
    """What was typed, but for where it was kept."""
    options = [f"--seeds {seeds}", *([] if at_most is None else [f"--at-most {at_most}"]), f"--jobs {jobs}"]
    if effort < 1.0:
        options.append(f"--effort {effort:g}")
    if write is not None:
        options.append(f"--write {write}")
    return f"mapless reproduce {' '.join(options)}"
