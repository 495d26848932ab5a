"""Makes deployment bundles, each in a process of its own: exporting compares with torch, which the server never imports."""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from threading import BoundedSemaphore

from server.checkpoints.service import CheckpointService
from server.errors import ExportFailedError, ExportTimeoutError
from server.services import Services

_ROOT = Path(__file__).resolve().parents[2]
# Imports take most of the three seconds that an export needs; a machine that is busy training needs longer.
_TIMEOUT = 120.0
# An export takes a core and 0.5 GB; who comes third waits.
_SLOTS = BoundedSemaphore(2)


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
        directory = Path(tempfile.mkdtemp(prefix="mapless-export-"))
        try:
            archive, out = directory / "checkpoint.zip", directory / "bundle.zip"
            with archive.open("wb") as file:
                for block in download.blocks:
                    file.write(block)
            _run(archive, out)
        except BaseException:
            shutil.rmtree(directory, ignore_errors=True)
            raise
        return BundleFile(out, f"{download.file_name.removesuffix('.zip')}-bundle.zip")


def _run(archive: Path, out: Path) -> None:
    path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", "workers.export", str(archive), "--format", "bundle", "--out", str(out)]
    with _SLOTS:
        try:
            subprocess.run(
                command,
                env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                check=True,
                timeout=_TIMEOUT,
            )
        except subprocess.TimeoutExpired as error:
            raise ExportTimeoutError(
                f"Exporting took longer than {_TIMEOUT:.0f} s: the machine is busy; try again, or download the checkpoint "
                "and run `mapless export` on it elsewhere."
            ) from error
        except subprocess.CalledProcessError as error:
            reason = error.stderr.strip().splitlines()[-1:] or [f"exit status {error.returncode}"]
            raise ExportFailedError(f"The policy was not exported: {reason[0].removeprefix('mapless: ')}") from error
