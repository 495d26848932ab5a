"""Faults of every kind against a whole service that trains, and the proof that nothing is lost, doubled or altered.

Server, workers and trainers run as processes of their own; in production mode so do a PostgreSQL and a Redis that belong to
the benchmark. Small trainings run all the time. Each fault hits one of them, or the whole service, and the next one comes
when every run that was hit has recovered: something that was reported after the fault is in the database, and a new
checkpoint where an attempt was lost. In the end every number that a worker spooled is looked for in the database, and the
final state of every run is compared with that of a run that nobody disturbed.

    python -m benchmarks.chaos --faults 500 --mode embedded --check
    python -m benchmarks.chaos --faults 500 --mode production --check
"""

import math
import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.chaos.campaign import STUCK_SECONDS, Campaign, Outcome
from benchmarks.chaos.kinds import Kind
from benchmarks.chaos.proof import Proof, Verdict
from benchmarks.chaos.report import figures, table, targets
from benchmarks.chaos.run_faults import RUN_FAULTS
from benchmarks.chaos.service_faults import SERVICE_FAULTS
from benchmarks.chaos.stack import Mode, Stack
from benchmarks.chaos.training import small_training
from benchmarks.report import finish, parser

KINDS: tuple[Kind, ...] = (*RUN_FAULTS, *SERVICE_FAULTS)


def campaign(
    *,
    kinds: tuple[Kind, ...],
    faults: int,
    mode: Mode,
    seed: int,
    runs: int,
    steps: int,
    lease_seconds: float,
    seconds: float = math.inf,
    patience: float = STUCK_SECONDS,
    talk: bool,
) -> tuple[Outcome, Verdict]:
    """Inject faults, wait for the end of all runs, and compare.

    Args:
        kinds: to inject.
        faults: how many.
        mode: of the service.
        seed: of what is left to chance.
        runs: trainings side by side; there is one more worker.
        steps: of each training.
        lease_seconds: of the service.
        seconds: after which no more faults come.
        patience: as of a campaign.
        talk: whether to tell each fault on standard error.
    """
    with TemporaryDirectory(prefix="mapless-chaos-") as directory:
        stack = Stack(Path(directory), mode, runs + 1, lease_seconds)
        try:
            stack.start()
            outcome = Campaign(
                stack, kinds, faults, seed, small_training(steps), seconds=seconds, patience=patience, talk=talk
            ).run()
            stack.recorder.close()
            proof = Proof(stack.database_url, stack.data / "checkpoints", stack.recorder.attempts(), outcome.damaged)
            try:
                for run_id, run_seed in outcome.runs.items():
                    if run_id not in outcome.failed and run_id not in outcome.stuck:
                        proof.check(run_id, outcome.references[run_seed])
            finally:
                proof.close()
            return outcome, proof.verdict
        finally:
            stack.close()


def main() -> None:
    """Measure and print."""
    options = parser(__doc__)
    options.add_argument("--faults", type=int, default=500)
    options.add_argument(
        "--minutes", type=float, default=math.inf, help="after which no more faults come; as long as it takes"
    )
    options.add_argument(
        "--patience",
        type=float,
        default=STUCK_SECONDS,
        help="seconds beyond the lease before a run counts as stuck; more on a busy machine",
    )
    options.add_argument("--mode", choices=("embedded", "production"), default="embedded")
    options.add_argument("--seed", type=int, default=0, help="of the faults' order and victims")
    options.add_argument("--runs", type=int, default=2, help="trainings side by side")
    options.add_argument("--steps", type=int, default=300_000, help="of each training")
    options.add_argument("--lease", type=float, default=5.0, help="seconds after which a silent worker loses its run")
    options.add_argument("--only", nargs="*", default=[], metavar="KIND", help="kinds to inject; all that the mode has")
    arguments = options.parse_args()
    names = {kind.name for kind in KINDS}
    if unknown := set(arguments.only) - names:
        options.error(f"no such kind: {', '.join(sorted(unknown))}; there are: {', '.join(sorted(names))}")

    # What was started is ended, and what was mounted unmounted, however this ends.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    outcome, verdict = campaign(
        kinds=tuple(kind for kind in KINDS if not arguments.only or kind.name in arguments.only),
        faults=arguments.faults,
        mode=arguments.mode,
        seed=arguments.seed,
        runs=arguments.runs,
        steps=arguments.steps,
        lease_seconds=arguments.lease,
        seconds=60.0 * arguments.minutes,
        patience=arguments.patience,
        talk=True,
    )
    print(table(outcome.injected))
    for run_id, reason in outcome.failed.items():
        sys.stderr.write(f"run {run_id} {reason}\n")
    finish(
        "chaos",
        {"mode": arguments.mode, "seed": arguments.seed, **figures(outcome, verdict)},
        at_most=targets(arguments.lease),
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
