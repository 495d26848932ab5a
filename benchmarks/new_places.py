"""From *Launch* to policies for places that none of them has met: the preset *New places*, five seeds launched at once.

    python -m benchmarks.new_places --check
    python -m benchmarks.new_places --seeds 2 --scenarios 20 --steps 20000    # a look at whether it works

Starts the service with a worker for each core, launches the preset through the API as the form does, and waits until all
seeds have ended. Then every checkpoint drives 1,000 scenarios of clutter at difficulty 0.5, each in a map of its own that no
training, suite or choice of a recipe has met, with 1 cm of noise, one ray in a hundred lost and commands a period late, as
in training. Checkpoints are driven after the training, so that measuring does not slow it. Caches are warm: a service that
has been up for a while, compiled kernels on disk.
"""

import os
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx

from benchmarks.report import finish, parser
from benchmarks.service import get, running_service, wait_for
from sim.drivers import Driver
from sim.suites import Suite, run_controller, suite_in, suite_places
from workers.checkpoints import read_policy
from workers.config import EvaluationConfig, TrainingConfig
from workers.policy import torch_policy
from workers.presets import NEW_PLACES

# A worker prepares its trainer in the background; "warm" means that this is over.
_WARM_SECONDS = 15.0
_DIFFICULTY = 0.5
_FIRST_MAP = 200_000
"""Of those kept for suites."""
TARGET_SUCCESS = 0.97
TARGET_SECONDS = 60.0
_ARRIVAL = 1


def scenarios(count: int) -> Suite:
    """As many scenarios of the preset's family, each in a map of its own."""
    return suite_in("new-places", suite_places("clutter", _DIFFICULTY, count, first=_FIRST_MAP), count)


def success(archive: Path, suite: Suite) -> float:
    """The share of scenarios in which a checkpoint's policy arrives, with all that disturbs it in its training; 0 to 1."""
    manifest, policy = read_policy(archive)
    driver = Driver(torch_policy(policy), len(suite))
    driven = run_controller(
        lambda situation: driver(situation.observations, situation.robots), manifest.training.task, suite
    )
    return float((driven.outcomes == _ARRIVAL).mean())


def launch(client: httpx.Client, title: str, training: TrainingConfig, seeds: Sequence[int]) -> tuple[float, dict[str, Any]]:
    """Launch a training with these seeds and wait for their end; when that was begun, and the experiment."""
    launched_at = time.time()
    body = {"name": title, "seeds": list(seeds), "training": training.model_dump(mode="json")}
    made = client.post("/api/experiments", json=body).raise_for_status().json()
    over = ("completed", "failed", "stopped")
    wait_for(
        lambda: all(get(client, f"/api/runs/{run['id']}")["state"] in over for run in made["runs"]),
        seconds=3_600.0,
        interval=0.2,
    )
    return launched_at, made


def shortened(training: TrainingConfig, steps: int | None) -> TrainingConfig:
    """A training of so many steps in place of its own, where that is said."""
    if steps is None:
        return training
    return training.model_copy(update={"steps": steps, "evaluation": EvaluationConfig(every_steps=steps)})


def archive_of(client: httpx.Client, checkpoint: dict[str, Any], directory: Path) -> Path:
    """A checkpoint's archive, downloaded."""
    archive = directory / f"{checkpoint['id']}.zip"
    archive.write_bytes(client.get(f"/api/checkpoints/{checkpoint['id']}/download").raise_for_status().content)
    return archive


def measure(client: httpx.Client, run_id: str, launched_at: float, suite: Suite, directory: Path) -> dict[str, Any]:
    """One seed's checkpoints: seconds from the launch to the end and to the first good one, and what the last is worth."""
    run = get(client, f"/api/runs/{run_id}")
    rates, good_at = [], None
    found = get(client, f"/api/runs/{run_id}/checkpoints?limit=200")["items"]
    for checkpoint in sorted(found, key=lambda each: int(each["step"])):
        rates.append(success(archive_of(client, checkpoint, directory), suite))
        if good_at is None and rates[-1] >= TARGET_SUCCESS:
            good_at = round(checkpoint["created_at"] - launched_at, 1)
    ended = round(run["finished_at"] - launched_at, 1)
    print(f"  seed {run['seed']}: ended after {ended} s, 97 % after {good_at} s; checkpoints arrive in {rates}", flush=True)
    return {"ended": ended, "good": good_at, "rates": rates}


def main() -> None:
    """Launch, wait, drive, and print."""
    options = parser(__doc__)
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--scenarios", type=int, default=1_000)
    options.add_argument("--steps", type=int, help="of each training; else the preset's")
    arguments = options.parse_args()
    with running_service(workers=os.cpu_count() or 1) as client, TemporaryDirectory() as directory:
        time.sleep(_WARM_SECONDS)
        training = shortened(NEW_PLACES.training, arguments.steps)
        launched_at, made = launch(client, NEW_PLACES.title, training, range(arguments.seeds))
        suite = scenarios(arguments.scenarios)
        found = [measure(client, run["id"], launched_at, suite, Path(directory)) for run in made["runs"]]
    last = [each["rates"][-1] for each in found]
    figures: dict[str, object] = {
        "seeds": len(found),
        "scenarios": len(suite),
        "steps": made["training"]["steps"],
        "success": last,
        "worst_success": min(last),
        "seconds_to_the_end_of_all": max(each["ended"] for each in found),
        "seconds_to_97_percent": [each["good"] for each in found],
    }
    finish(
        "new_places",
        figures,
        at_least={"worst_success": TARGET_SUCCESS},
        at_most={"seconds_to_the_end_of_all": TARGET_SECONDS},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
