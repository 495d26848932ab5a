"""Makes deployment bundles, each in a process of its own: exporting compares with torch, which the server never imports."""

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from server.checkpoints.service import CheckpointService
from server.errors import ExportFailedError, ExportTimeoutError
from server.processes import ProcessFailedError, ProcessTimeoutError, run_module
from server.services import Services

# Imports take most of the three seconds that an export needs; a machine that is busy training needs longer.
_TIMEOUT = 120.0


@dataclass(frozen=True)
class BundleFile:
    """A finished bundle in a directory of its own; `discard` once it is sent."""

    path: Path
    file_name: str

    def discard(self) -> None:
        """Remove the file and its directory."""
        shutil.rmtree(self.path.parent, ignore_errors=True)


class ExportService:
    """Turns checkpoints into bundles."""

    def __init__(self, services: Services) -> None:
        self._checkpoints = CheckpointService(services)

    def bundle(self, checkpoint_id: str) -> BundleFile:
        """The checkpoint's deployment bundle, compared with torch just now.

        Raises:
            NotFoundError: there is no such checkpoint, or its file is gone.
            ExportFailedError: the archive can't be exported, or the export does not equal the trained policy.
            ExportTimeoutError: it took too long.
        """
        download = self._checkpoints.download(checkpoint_id)
        with tempfile.TemporaryDirectory(prefix="mapless-checkpoint-") as scratch:
            archive = Path(scratch) / "checkpoint.zip"
            download.save(archive)
            return bundle_of(archive, f"{download.file_name.removesuffix('.zip')}-bundle.zip")


def bundle_of(archive: Path, file_name: str) -> BundleFile:
    """An archive's deployment bundle, under the name that a browser should give it.

    Raises:
        ExportFailedError: the archive can't be exported, or the export does not equal the trained policy.
        ExportTimeoutError: it took too long.
    """
    directory = Path(tempfile.mkdtemp(prefix="mapless-export-"))
    try:
        out = directory / "bundle.zip"
        _run(archive, out)
    except BaseException:
        shutil.rmtree(directory, ignore_errors=True)
        raise
    return BundleFile(out, file_name)


def _run(archive: Path, out: Path) -> None:
    try:
        run_module("workers.export", str(archive), "--format", "bundle", "--out", str(out), timeout=_TIMEOUT)
    except ProcessTimeoutError as error:
        raise ExportTimeoutError(
            f"Exporting took longer than {_TIMEOUT:.0f} s: the machine is busy; try again, or download the checkpoint "
            "and run `mapless export` on it elsewhere."
        ) from error
    except ProcessFailedError as error:
        raise ExportFailedError(f"The policy was not exported: {error}") from error
