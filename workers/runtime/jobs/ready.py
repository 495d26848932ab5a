"""Everything that jobs need, imported: loaded once by the nursery, which job processes are forked from."""

import workers.bags.job
import workers.export.bundle
import workers.live.playing
import workers.live.viewer
import workers.replays.film
import workers.replays.record
import workers.training.evaluation  # noqa: F401 - each is needed by a job
from workers import onnx_runtime

onnx_runtime.load()
