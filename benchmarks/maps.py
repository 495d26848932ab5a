"""What it takes to draw the maps of a training, by family, and until robots stand in them: milliseconds a map.

Each family's maps are drawn one after the other, on one core, at difficulty 1; beside them those of *Through rooms and
mazes*, 4,096 of seven families, and all that its environment makes ready before its first step. What was drawn is told by a
hash, since maps must stay what they are.

    python -m benchmarks.maps --maps 200
"""

import hashlib
import time
from collections.abc import Sequence

from benchmarks.field.suites import FAMILIES
from benchmarks.report import finish, parser
from sim.arenas import Arena
from sim.arenas.build import build_arenas, build_task_arenas
from sim.config import GeneratedArenaConfig
from sim.envs.vector import NavigationVectorEnv
from workers.shipped.recipes import recipe


def drawn(arenas: Sequence[Arena]) -> str:
    """The beginning of a hash of all that stands in them."""
    return hashlib.sha256(b"".join(arena.circles.tobytes() + arena.boxes.tobytes() for arena in arenas)).hexdigest()[:12]


def main() -> None:
    """Draw, and print how long it took."""
    options = parser(__doc__)
    options.add_argument("--maps", type=int, default=200, help="of each family")
    arguments = options.parse_args()
    build_arenas(GeneratedArenaConfig(name="clutter", maps=1))  # compiled
    found: dict[str, object] = {"maps": arguments.maps}
    for family in FAMILIES:
        begun = time.perf_counter()
        arenas = build_arenas(GeneratedArenaConfig(name=family, difficulty=1.0, maps=arguments.maps))
        found[f"{family}, ms"] = round(1e3 * (time.perf_counter() - begun) / arguments.maps, 2)
        found[f"{family}, hash"] = drawn(arenas)
    task = recipe("rooms").training.task
    begun = time.perf_counter()
    arenas = build_task_arenas(task)
    found["pool of Through rooms and mazes, s"] = round(time.perf_counter() - begun, 1)
    found["pool of Through rooms and mazes, hash"] = drawn(arenas)
    begun = time.perf_counter()
    NavigationVectorEnv(task, 512, seed=0).reset()
    found["until its robots stand, s"] = round(time.perf_counter() - begun, 1)
    finish("maps", found, check=arguments.check)


if __name__ == "__main__":
    main()
