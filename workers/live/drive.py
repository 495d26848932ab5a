"""`python -m workers.live.drive CHECKPOINT`: robots that drive by a finished policy, for whoever watches.

Reads one JSON line per wish from standard input, a `workers.reporting.WatchRequest` or `null` for nobody, and writes frames
to standard output, each after its length as four bytes, little-endian. Ends with its input.
"""

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from pydantic import TypeAdapter

from sim.arenas import with_maps_of
from workers.checkpoints import read_policy
from workers.frames import Frame
from workers.live.viewer import LiveViewer
from workers.reporting import EvaluationResult, EventLevel, WatchRequest

_WISH: TypeAdapter[WatchRequest | None] = TypeAdapter(WatchRequest | None)
LENGTH_BYTES = 4
"""Of the number before each frame."""


class _Output:
    """A reporter that writes frames to a stream."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self.watch: WatchRequest | None = None

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """There are none."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Says why the view has stopped."""
        sys.stderr.write(f"{level}: {message}\n")

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """There are none."""

    def frames(self, frames: Sequence[Frame]) -> None:
        """See `Reporter.frames`."""
        for frame in frames:
            data = frame.encode()
            self._stream.write(len(data).to_bytes(LENGTH_BYTES, "little") + data)
        self._stream.flush()

    @property
    def stop_requested(self) -> bool:
        """Never."""
        return False


def drive(archive: Path, wishes: Iterable[bytes], stream: BinaryIO) -> None:
    """Drives by an archive's policy as long as there are wishes to come.

    Args:
        archive: the checkpoint.
        wishes: lines; each is in force until the next.
        stream: takes the frames.

    Raises:
        ArchiveError: it is not an archive that this release reads.
    """
    manifest, policy = read_policy(archive)
    output = _Output(stream)
    viewer = LiveViewer(with_maps_of(manifest.training.task, manifest.seed), output)
    try:
        for line in wishes:
            wish = _WISH.validate_json(line)
            # There are no training robots any more.
            output.watch = None if wish is None else wish.model_copy(update={"mode": "policy"})
            viewer.on_weights(lambda: policy, manifest.step)
    finally:
        viewer.close()


if __name__ == "__main__":
    drive(Path(sys.argv[1]), sys.stdin.buffer, sys.stdout.buffer)
