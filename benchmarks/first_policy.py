"""How long from *Launch* to a first metric, a first live frame and a good policy: the default training, watched.

Starts the service, launches the default training on the simple arena through the API with the live view open, and prints
the seconds from the launch to the first metric, to the first frame and to the first checkpoint whose policy reaches 99 % of
1,000 targets (deterministic, random starts, none of the frozen suite's). The checkpoints are measured after the training, so
that measuring does not slow it. Caches are warm: a service that has been up for a while, compiled kernels on disk.

    python -m benchmarks.first_policy --check
"""

import threading
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import numpy as np
import viser
from websockets.sync.client import connect

from benchmarks.report import finish, parser
from benchmarks.service import get, running_service, wait_for
from sim.envs.vector import NavigationVectorEnv
from workers.checkpoints import read_policy

WORKERS = 2
# A worker prepares its trainer in the background; "warm" means that this is over.
WARM_SECONDS = 15.0
EPISODES = 1_000
TARGET_SUCCESS = 0.99
# Unlike every seed that trainings use by default.
EPISODE_SEED = 20_261_121


def watch(client: httpx.Client, run: str, stop: threading.Event) -> None:
    """Look at a run as a browser does, until `stop`: everything that the live view sends is read."""
    base = client.base_url
    origin = f"{base.scheme}://{base.netloc.decode()}"
    with connect(
        f"ws://{base.netloc.decode()}/live/{run}",
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        additional_headers={"Authorization": client.headers["Authorization"], "Origin": origin},
        compression=None,
        max_size=None,
    ) as socket:
        while not stop.is_set():
            try:
                socket.recv(timeout=0.2)
            except TimeoutError:
                continue


def success_rate(archive: Path) -> float:
    """Arrivals over first targets of 1,000 robots, each at a random place, driven without noise; 0 to 1."""
    manifest, policy = read_policy(archive)
    env = NavigationVectorEnv(manifest.training.task, EPISODES, seed=EPISODE_SEED)
    observations, _ = env.reset()
    outcomes = np.zeros(EPISODES, dtype=np.uint8)
    while not outcomes.all():
        observations, *_ = env.step(policy(observations))
        outcomes = np.where(outcomes == 0, env.outcomes, outcomes)
    return float((outcomes == 1).mean())


def launch(client: httpx.Client, directory: Path) -> dict[str, Any]:
    """Launch the default training once; returns its figures."""
    body = get(client, "/api/training/form")["defaults"] | {"name": "first policy"}
    stop = threading.Event()
    launched_at, launched = time.time(), time.monotonic()
    response = client.post("/api/experiments", json=body)
    response.raise_for_status()
    run = response.json()["runs"][0]["id"]
    watcher = threading.Thread(target=watch, args=(client, run, stop))
    watcher.start()
    try:
        first: dict[str, float] = {}

        def both_seen() -> bool:
            if "metric" not in first and get(client, f"/api/runs/{run}/metrics")["series"]:
                first["metric"] = time.monotonic() - launched
            if "frame" not in first and get(client, f"/api/runs/{run}/live")["status"]["receiving"]:
                first["frame"] = time.monotonic() - launched
            return len(first) == 2

        wait_for(both_seen, seconds=60.0)
        wait_for(lambda: get(client, f"/api/runs/{run}")["state"] in ("completed", "failed"), seconds=300.0, interval=0.5)
        finished = time.monotonic() - launched
    finally:
        stop.set()
        watcher.join()
    good_at = None
    rates = []
    for checkpoint in sorted(
        get(client, f"/api/runs/{run}/checkpoints?limit=200")["items"], key=lambda row: int(row["step"])
    ):
        archive = directory / f"{checkpoint['id']}.zip"
        archive.write_bytes(client.get(f"/api/checkpoints/{checkpoint['id']}/download").content)
        rates.append(success_rate(archive))
        if good_at is None and rates[-1] >= TARGET_SUCCESS:
            good_at = checkpoint["created_at"] - launched_at
    print(
        f"  metric {first['metric']:.1f} s, frame {first['frame']:.1f} s, 99 % {good_at} s, end {finished:.1f} s: {rates}",
        flush=True,
    )
    return {"metric": first["metric"], "frame": first["frame"], "good": good_at, "finished": finished, "final": rates[-1]}


def main() -> None:
    """Measure, several times in one service, and print the medians."""
    options = parser(__doc__)
    options.add_argument("--repeats", type=int, default=5)
    arguments = options.parse_args()
    with running_service(workers=WORKERS) as client, TemporaryDirectory() as directory:
        time.sleep(WARM_SECONDS)
        rows = []
        for _ in range(arguments.repeats):
            rows.append(launch(client, Path(directory)))
            # The worker's next trainer warms up before the next launch.
            time.sleep(WARM_SECONDS)
    good = [row["good"] if row["good"] is not None else float("inf") for row in rows]
    finish(
        "first_policy",
        {
            "launches": len(rows),
            "first_metric_seconds": round(median(row["metric"] for row in rows), 2),
            "first_frame_seconds": round(median(row["frame"] for row in rows), 2),
            "success_99_seconds": round(median(good), 2),
            "slowest_success_99_seconds": round(max(good), 2),
            "training_seconds": round(median(row["finished"] for row in rows), 2),
            "final_success": [row["final"] for row in rows],
        },
        at_most={"first_metric_seconds": 5.0, "first_frame_seconds": 5.0, "success_99_seconds": 30.0},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
