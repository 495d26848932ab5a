"""What a frame of a live view costs the server: processor time a frame of a view with one watcher, and where it goes.

The same runs report with and without somebody who watches them; the difference, over the frames that the workers sent, is
what a frame costs. The event loop receives frames, decodes them, and sends what browsers get; other threads draw. What it
takes to decode a frame, and to draw it and to write down what has changed, is measured once more by itself, in this process.

    python -m benchmarks.load.frames --check
"""

import asyncio
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from benchmarks.load.plan import Plan, ViewsTold, WorkersTold
from benchmarks.load.served import TOKEN, WORKER_TOKEN, Part, cores, launch, server_on_a_core
from benchmarks.load.workers import made_up_frame
from benchmarks.report import finish, parser
from server.live.artist import ARTIST
from server.live.settings import LiveSettings
from server.live.view import LiveView
from sim.config import TaskConfig
from workers.frames import Frame
from workers.reporting import WatchRequest

MAX_FRAME_MILLISECONDS = 0.35
# Scenes are built, links opened.
SETTLING_SECONDS = 10.0
_FRAMES_PER_SECOND = 30.0
_DRAWN = 2_000


@dataclass(frozen=True)
class Spent:
    """Of a settled server: seconds that went by, and processor seconds of its event loop and of its other threads."""

    seconds: float
    loop: float
    others: float
    views: ViewsTold


def _threads(process: psutil.Process) -> tuple[float, float]:
    """Processor seconds of the first thread, which runs the event loop, and of all others that are there."""
    spent = {thread.id: thread.user_time + thread.system_time for thread in process.threads()}
    loop = spent.pop(process.pid)
    return loop, sum(spent.values())


def serve(runs: int, seconds: float, *, watched: bool) -> Spent:
    """A server to which so many runs report a little, and send frames where they are watched."""
    own, others = cores()
    with (
        TemporaryDirectory(prefix="mapless-frames-") as directory,
        server_on_a_core(Path(directory), "sqlite", (own, others)) as (url, pid),
        ExitStack() as started,
    ):
        run_ids, experiment_ids = launch(url, runs)
        plan = Plan(
            server_url=url,
            token=TOKEN,
            worker_token=WORKER_TOKEN,
            run_ids=run_ids,
            experiment_ids=experiment_ids,
            series=5,
            batches=0.2,
            browsers=0,
            page_seconds=10.0,
            views=runs if watched else 0,
            seconds=SETTLING_SECONDS + seconds,
            settling_seconds=SETTLING_SECONDS,
        )
        parts = [Part(plan, others, 0, f"benchmarks.load.{name}") for name in ("workers", "views")]
        for part in parts:
            started.callback(part.kill)
        for part in parts:
            part.await_readiness()
        end = time.time() + plan.seconds
        for part in parts:
            part.begin(end)
        process = psutil.Process(pid)
        time.sleep(SETTLING_SECONDS)
        begun, before = time.monotonic(), _threads(process)
        # What is measured is over before the load is.
        time.sleep(max(0.0, end - 1.0 - time.time()))
        after, elapsed = _threads(process), time.monotonic() - begun
        parts[0].told(WorkersTold, 60.0)
        views = parts[1].told(ViewsTold, 60.0)
    return Spent(elapsed, after[0] - before[0], after[1] - before[1], views)


async def alone() -> dict[str, float]:
    """Milliseconds of this thread that decoding and drawing one frame take, of robots that drive in circles."""
    view = LiveView(TaskConfig(), "light", LiveSettings())
    ARTIST.remove(view)
    try:
        sight = view.look()
        encoded = [made_up_frame(WatchRequest(), 0, number / _FRAMES_PER_SECOND).encode() for number in range(_DRAWN)]
        begun = time.thread_time()
        frames = [Frame.decode(each) for each in encoded]
        decoded = time.thread_time()
        for frame in frames:
            view.show(frame)
            view.draw(time.monotonic())
        drawn = time.thread_time()
        sight.close()
    finally:
        view.close()
    return {
        "decode_milliseconds": round(1000.0 * (decoded - begun) / _DRAWN, 4),
        "draw_milliseconds": round(1000.0 * (drawn - decoded) / _DRAWN, 4),
    }


def main() -> None:
    """Measure and print."""
    options = parser(__doc__)
    options.add_argument("--views", type=int, default=20)
    options.add_argument("--seconds", type=float, default=30.0, help="of each of the two halves")
    arguments = options.parse_args()
    idle = serve(arguments.views, arguments.seconds, watched=False)
    busy = serve(arguments.views, arguments.seconds, watched=True)
    frames = arguments.views * _FRAMES_PER_SECOND
    # Milliseconds a frame that threads spend more than where nobody watches.
    loop = 1000.0 * (busy.loop / busy.seconds - idle.loop / idle.seconds) / frames
    others = 1000.0 * (busy.others / busy.seconds - idle.others / idle.seconds) / frames

    finish(
        "load.frames",
        {
            "views": arguments.views,
            "frame_milliseconds": round(loop + others, 3),
            "event_loop_milliseconds": round(loop, 3),
            "other_threads_milliseconds": round(others, 3),
            **asyncio.run(alone()),
            "view_frames_per_second": round(busy.views.messages / busy.views.seconds, 1),
            "bytes_per_frame": round(busy.views.bytes / max(1, busy.views.messages)),
            "core_percent_unwatched": round(100.0 * (idle.loop + idle.others) / idle.seconds, 1),
            "core_percent_watched": round(100.0 * (busy.loop + busy.others) / busy.seconds, 1),
        },
        at_least={"view_frames_per_second": 27.0},
        at_most={"frame_milliseconds": MAX_FRAME_MILLISECONDS},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
