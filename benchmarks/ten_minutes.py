"""From *Launch* to a policy for buildings, mazes and thickets: *Through rooms and mazes*, one seed on every core.

    python -m benchmarks.ten_minutes --check
    python -m benchmarks.ten_minutes --scenarios 10 --steps 32768    # a look at whether it works

Starts the service, launches the recipe through the API as the form does, with a seed that is none of those that ship or are
shown, and waits for its end. Then its last checkpoint drives scenarios of the six families for which there are aims, each in
a map of its own that no training, suite or choice of a recipe has met, with the patience of `benchmarks.field`. Caches are
warm: a service that has been up for a while, compiled kernels on disk. The machine has to be idle.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.field.__main__ import FAMILY_TARGETS
from benchmarks.field.suites import FAMILIES, PATIENCE
from benchmarks.new_places import archive_of, launch, shortened, success
from benchmarks.report import finish, parser
from benchmarks.service import get, running_service
from sim.suites import SuiteRules, suite_in, suite_places
from workers.shipped.recipes import recipe

# A worker prepares its trainer in the background; "warm" means that this is over.
_WARM_SECONDS = 15.0
_SEED = 100
_FIRST_MAP = 960_000
"""Of those kept for suites."""
TARGET_SECONDS = 600.0


def main() -> None:
    """Launch, wait, drive, and print."""
    options = parser(__doc__)
    options.add_argument("--scenarios", type=int, default=200, help="of each family")
    options.add_argument("--steps", type=int, help="of the training; else the recipe's")
    arguments = options.parse_args()
    made_from = recipe("rooms")
    training = shortened(made_from.training, arguments.steps)
    with running_service(workers=1) as client, TemporaryDirectory() as directory:
        time.sleep(_WARM_SECONDS)
        launched_at, made = launch(client, made_from.title, training, [_SEED])
        (run,) = made["runs"]
        seconds = get(client, f"/api/runs/{run['id']}")["finished_at"] - launched_at
        print(f"ended after {seconds:.1f} s", flush=True)
        checkpoints = get(client, f"/api/runs/{run['id']}/checkpoints?limit=200")["items"]
        archive = archive_of(client, max(checkpoints, key=lambda each: int(each["step"])), Path(directory))
        arrivals: dict[str, object] = {}
        for family in FAMILIES:
            if family in FAMILY_TARGETS:
                places = suite_places(family, 1.0, arguments.scenarios, first=_FIRST_MAP)
                suite = suite_in(f"ten-minutes-{family}", places, arguments.scenarios, SuiteRules(patience=PATIENCE))
                arrivals[family] = round(100.0 * success(archive, suite), 1)
                print(f"{family}: {arrivals[family]} % of {arguments.scenarios}", flush=True)
    figures = {"steps": training.steps, "scenarios": arguments.scenarios, **arrivals, "seconds": round(seconds, 1)}
    finish(
        "ten_minutes",
        figures,
        at_least={family: FAMILY_TARGETS[family] for family in arrivals},
        at_most={"seconds": TARGET_SECONDS},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
