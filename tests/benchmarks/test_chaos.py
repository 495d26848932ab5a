"""A short form of the chaos benchmark: real processes, one fault of each of the kinds below, and nothing is lost.

How long recovery takes is the benchmark's to say, on a quiet machine; what is asked here holds on a busy one.
"""

from dataclasses import asdict

import pytest

from benchmarks.chaos.__main__ import KINDS, campaign
from benchmarks.chaos.report import NOTHING, figures, table
from benchmarks.chaos.stack import Mode
from tests.conftest import POSTGRES, require_service

# One of each way in which something ends, stands still, falls silent, is cut, is full or lies.
EMBEDDED = (
    "trainer killed",
    "worker killed",
    "link cut",
    "server killed",
    "database locked",
    "spool altered",
    "checkpoint damaged",
    "clock set back",
)
PRODUCTION = (
    "upload cut",
    "claim's answer lost",
    "worker's disk full",
    "server restarted",
    "database killed",
    "broker cut",
)

# Seconds without a sign of life, where other work has the cores, after which a run counts as stuck.
PATIENCE = 150.0
pytestmark = pytest.mark.timeout(600)


def inject(mode: Mode, names: tuple[str, ...]) -> None:
    kinds = tuple(kind for kind in KINDS if kind.name in names)
    assert len(kinds) == len(names)
    outcome, verdict = campaign(
        kinds=kinds,
        faults=len(kinds),
        mode=mode,
        seed=1,
        runs=1,
        steps=120_000,
        lease_seconds=3.0,
        patience=PATIENCE,
        talk=False,
    )
    told = figures(outcome, verdict)
    assert {name: told[name] for name in NOTHING} == dict.fromkeys(NOTHING, 0), f"{outcome}\n{asdict(verdict)}"
    assert {fault.kind.name for fault in outcome.injected} == set(names)
    assert verdict.points > 1_000
    assert verdict.checkpoints > 10
    assert table(outcome.injected).count("\n") == len(names) + 1


def test_nothing_is_lost_in_embedded_mode() -> None:
    inject("embedded", EMBEDDED)


@pytest.mark.services
def test_nothing_is_lost_in_production_mode() -> None:
    # The clusters are the benchmark's own; that the shared one answers says that PostgreSQL and Redis are installed.
    require_service("PostgreSQL", *POSTGRES)
    require_service("Redis", "127.0.0.1", 6379)
    inject("production", PRODUCTION)
