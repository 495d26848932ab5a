"""What a campaign has shown, as a table by kind and as figures with their targets."""

from collections import defaultdict
from collections.abc import Sequence
from statistics import median

from benchmarks.chaos.campaign import Injected, Outcome
from benchmarks.chaos.proof import Verdict

# On a quiet machine: where somebody hears at once that something is gone, and on top of the lease where nobody does.
CLOSED_MEDIAN_SECONDS = 5.0
SILENT_SECONDS = 10.0


def table(injected: Sequence[Injected]) -> str:
    """Markdown: a line a kind, with how often it hit and how long recovery took."""
    by_kind: dict[str, list[Injected]] = defaultdict(list)
    for fault in injected:
        by_kind[fault.kind.name].append(fault)
    lines = ["| fault | what is done | times | recovery: median | worst |", "|---|---|---:|---:|---:|"]
    for name, faults in by_kind.items():
        times = [fault.seconds for fault in faults if fault.seconds is not None]
        figures = f"{median(times):.1f} s | {max(times):.1f} s" if len(times) == len(faults) else "never | never"
        lines.append(f"| {name} | {faults[0].kind.what} | {len(faults)} | {figures} |")
    return "\n".join(lines)


def figures(outcome: Outcome, verdict: Verdict) -> dict[str, object]:
    """Everything that was counted and measured."""
    closed, silent = (
        [fault.seconds for fault in outcome.injected if fault.kind.heard == heard and fault.seconds is not None]
        for heard in ("closed", "silent")
    )
    return {
        "faults": len(outcome.injected),
        "kinds": len({fault.kind.name for fault in outcome.injected}),
        "runs": verdict.runs,
        "points": verdict.points,
        "lost": verdict.lost,
        "doubled": verdict.doubled,
        "altered": verdict.altered,
        "events": verdict.events,
        "events_wrong": verdict.events_wrong,
        "checkpoints": verdict.checkpoints,
        "checkpoints_torn": verdict.torn,
        "checkpoints_damaged_on_purpose": len(outcome.damaged),
        "runs_stuck": len(outcome.stuck),
        "runs_failed": len(outcome.failed),
        "runs_that_differ": len(verdict.differing),
        "processes_that_ended_by_themselves": len(outcome.revived),
        "recovery_closed_median_seconds": round(median(closed), 2) if closed else 0.0,
        "recovery_silent_worst_seconds": round(max(silent), 2) if silent else 0.0,
    }


NOTHING = (
    "lost",
    "doubled",
    "altered",
    "events_wrong",
    "checkpoints_torn",
    "runs_stuck",
    "runs_failed",
    "runs_that_differ",
    "processes_that_ended_by_themselves",
)
"""Figures of which the target is zero, on any machine."""


def targets(lease_seconds: float) -> dict[str, float]:
    """What no figure may exceed on a quiet machine."""
    return {
        **dict.fromkeys(NOTHING, 0.0),
        "recovery_closed_median_seconds": CLOSED_MEDIAN_SECONDS,
        "recovery_silent_worst_seconds": lease_seconds + SILENT_SECONDS,
    }
