"""How long a worker waits for the run that it takes up, over HTTP: of short runs and of long ones.

    python -m benchmarks.dashboard.claims --check
    python -m benchmarks.dashboard.claims --points 1000 --long-points 500000

Makes runs that were stopped, serves them, resumes them and claims them: one by one, then ten at once. Each goes on from a
checkpoint before its end, so that a twentieth of its points is dropped. A claim is timed by who asks, until all of the
answer is there.
"""

import statistics
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.dashboard.data import Lab, Sizes, make
from benchmarks.dashboard.server import WORKER_TOKEN, Server, serving
from benchmarks.report import finish, parser
from workers.protocol import Claim

# Of a claim that nobody else disturbs.
_MOST_MS = 20.0
_CLAIMS = 10


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and with `--check` fail where a claim took too long."""
    options = parser(__doc__)
    options.add_argument("--points", type=int, default=1_000, help="of each of the 20 series of a short run")
    options.add_argument("--long-points", type=int, default=100_000, help="of each series of a long run")
    chosen = options.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="mapless-claims-") as scratch:
        sizes = Sizes(
            experiments=12, points=chosen.points, long_experiments=5, long_points=chosen.long_points, checkpoints=50, live=0
        )
        lab = make(Path(scratch), sizes)
        with serving(Path(scratch)) as server:
            figures = measure_claims(server, lab)
    finish("claims", figures, at_most=claim_targets(), check=chosen.check)


def measure_claims(server: Server, lab: Lab) -> dict[str, object]:
    """Time the claims of a lab's stopped runs, and print a row for each kind."""
    long, together = lab.stopped[:_CLAIMS], lab.stopped[_CLAIMS : 2 * _CLAIMS]
    print(f"{'a claim':<28}{'median ms':>10}{'worst ms':>10}")
    figures: dict[str, object] = {}
    for name, run_ids, at_once in (
        ("short run", lab.stopped_short[:_CLAIMS], False),
        ("long run", long, False),
        ("long run, ten at once", together, True),
    ):
        took = _time_claims(server, run_ids, at_once=at_once)
        if took:
            median, worst = statistics.median(took), max(took)
            print(f"{name:<28}{median:>10.1f}{worst:>10.1f}", flush=True)
            figures |= {f"claim, {name} median_ms": round(median, 1), f"claim, {name} worst_ms": round(worst, 1)}
    return figures


def claim_targets() -> dict[str, float]:
    """What the figures of `measure_claims` must not exceed."""
    return {"claim, short run worst_ms": _MOST_MS, "claim, long run worst_ms": _MOST_MS}


def claim(server: Server, run_id: str) -> Claim:
    """Take up a queued run as a worker would."""
    with server.client() as people:
        attempt = people.get(f"/api/runs/{run_id}").raise_for_status().json()["attempt"]
    return _claim(server, run_id, attempt)[0]


def _time_claims(server: Server, run_ids: Sequence[str], *, at_once: bool) -> list[float]:
    """Resume the runs and take them up; milliseconds that each of the claims took."""
    with server.client() as people:
        attempts = [people.post(f"/api/runs/{run_id}/resume").raise_for_status().json()["attempt"] for run_id in run_ids]
    with ThreadPoolExecutor(_CLAIMS if at_once else 1) as pool:
        return list(pool.map(lambda run_id, attempt: _claim(server, run_id, attempt)[1], run_ids, attempts))


def _claim(server: Server, run_id: str, attempt: int) -> tuple[Claim, float]:
    """A run's claim, and the milliseconds that it took over a connection that is open."""
    with server.client(WORKER_TOKEN) as worker:
        worker.post("/api/worker/heartbeat", json={"worker": f"bench-{run_id}", "queue": "cpu"}).raise_for_status()
        began = time.perf_counter()
        answer = worker.post(
            f"/api/worker/runs/{run_id}/claim", json={"worker": f"bench-{run_id}", "published_attempt": attempt}
        )
        took = 1000.0 * (time.perf_counter() - began)
        return Claim.model_validate_json(answer.raise_for_status().content), took


if __name__ == "__main__":
    main()
