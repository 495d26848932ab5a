"""The command that takes a checkpoint's policy away."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from workers.errors import WorkerError


class ExportFormat(StrEnum):
    """What `mapless export` writes."""

    ONNX = "onnx"
    ONNX_SCAN = "onnx-scan"
    BUNDLE = "bundle"

    @property
    def suffix(self) -> str:
        """What a checkpoint's name gets in place of '.zip'."""
        return {ExportFormat.ONNX: ".onnx", ExportFormat.ONNX_SCAN: "-scan.onnx", ExportFormat.BUNDLE: "-bundle.zip"}[self]


def export(
    checkpoint: Annotated[Path, typer.Argument(help="A checkpoint archive.", exists=True, dir_okay=False)],
    export_format: Annotated[
        ExportFormat,
        typer.Option(
            "--format",
            help="onnx: from the observation; onnx-scan: from scan, pose and target; bundle: both, with a ROS 2 node.",
        ),
    ] = ExportFormat.BUNDLE,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write; beside the checkpoint without it.")] = None,
) -> None:
    """Export a checkpoint's policy, after comparing it with torch over random observations."""
    # Only now: torch and onnx take seconds to import, which `--help` should not.
    from workers.export.bundle import bundle, export_checkpoint

    path = out or checkpoint.with_name(checkpoint.stem + export_format.suffix)
    try:
        exported = export_checkpoint(checkpoint)
        if export_format is ExportFormat.BUNDLE:
            data = bundle(exported)
        else:
            data = exported.by_observation if export_format is ExportFormat.ONNX else exported.by_scan
        path.write_bytes(data)
    except (WorkerError, OSError) as error:
        typer.echo(f"mapless: {error}", err=True)
        raise typer.Exit(1) from None
    report = exported.report
    typer.echo(
        f"{path}: equal to torch within {report.policy_difference:.0e} (actions) and "
        f"{report.observation_difference:.0e} (observations) over {report.rows:,} random rows"
    )
