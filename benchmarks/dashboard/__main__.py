"""What every page costs with a lab's worth of trainings behind it: cold and alone, then while runs report and others look.

    python -m benchmarks.dashboard --check
    python -m benchmarks.dashboard --experiments 20 --long-points 10000 --checkpoints 200 --live 5 --tabs 3 --seconds 10

Makes a database (as large as asked for), serves it, opens each page in headless Chromium in a profile that has seen nothing,
and prints what that took: processor time of the server, until all is drawn, the longest task, memory of the tab. Then runs
report twenty series twice a second each while other tabs look on: the same pages again, and how long a report takes to the
screen. Last, stopped runs are resumed and claimed, one by one and ten at once.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from benchmarks.dashboard.browser import Cost, Tabs, seen, tabs
from benchmarks.dashboard.claims import claim_targets, measure_claims
from benchmarks.dashboard.data import Lab, Sizes, ask_sizes, make
from benchmarks.dashboard.pages import PAGES, Visit, visits, warming
from benchmarks.dashboard.reporters import reporting
from benchmarks.dashboard.server import Server, serving
from benchmarks.report import finish, parser

# Targets of every page, beside those of its own (`PAGES`).
_SERVER_MS = 100.0
_TAB_MB = 150.0
_MEMORY_MB = 500.0
_BYTES_A_POINT = 3.5
_UPDATE_SECONDS = 2.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and with `--check` fail where a target is missed."""
    options = _options(arguments)
    figures: dict[str, object] = {}
    with tempfile.TemporaryDirectory(prefix="mapless-dashboard-") as scratch:
        data_dir = options.data_dir or Path(scratch)
        sizes = Sizes(
            experiments=options.experiments,
            points=options.points,
            long_experiments=options.long_experiments,
            long_points=options.long_points,
            checkpoints=options.checkpoints,
            live=options.live,
        )
        _say(f"making {sizes}")
        lab = make(data_dir, sizes)
        _say(f"{lab.points:,} points in {lab.seconds:.0f} s")
        figures |= {**asdict(sizes), "points_in_all": lab.points, "bytes_a_point": round(lab.bytes / lab.points, 2)}
        with serving(data_dir) as server, tabs(server) as opened:
            # What Python and the browser do only once is not the pages': other trainings are looked at first.
            for visit in warming(lab):
                opened.visit(visit.path, visit.ready)
            _say("cold and alone")
            figures |= _measure("", opened, lab, options, with_server=True)
            figures["server_mb"] = round(server.memory_mb())
            if lab.live:
                _say(f"{len(lab.live)} runs report, {options.tabs} tabs look on")
                figures |= _under_load(server, opened, lab, options)
            figures |= measure_claims(server, lab)
    finish("dashboard", figures, at_most=_targets(options.pages), check=options.check)


def _measure(prefix: str, opened: Tabs, lab: Lab, options: argparse.Namespace, *, with_server: bool) -> dict[str, object]:
    """Visit every page, each time another training where there are more, and print a row for each."""
    print(f"{'page':<28}{'server ms':>10}{'drawn ms':>10}{'longest ms':>11}{'tab MB':>8}{'kB':>8}")
    figures: dict[str, object] = {}
    for visit in visits(lab, options.pages):
        costs = [opened.visit(visit.at(index), visit.ready) for index in range(options.repeats)]
        cost = Cost(*(statistics.median(each) for each in zip(*(asdict(one).values() for one in costs), strict=True)))
        print(
            f"{prefix + visit.name:<28}{cost.server_ms:>10.0f}{cost.drawn_ms:>10.0f}{cost.longest_ms:>11.0f}"
            f"{cost.tab_mb:>8.0f}{cost.kb:>8.0f}",
            flush=True,
        )
        name = f"{prefix}{visit.name}"
        figures |= {f"{name} drawn_ms": round(cost.drawn_ms), f"{name} longest_ms": round(cost.longest_ms)}
        figures |= {f"{name} tab_mb": round(cost.tab_mb), f"{name} kb": round(cost.kb)}
        if with_server:
            figures[f"{name} server_ms"] = round(cost.server_ms)
    return figures


def _under_load(server: Server, opened: Tabs, lab: Lab, options: argparse.Namespace) -> dict[str, object]:
    """How long reports take to the screen, what the pages cost meanwhile, and what the server needs for all of it."""
    with reporting(server, lab.live) as reporters:
        watched = lab.live[0]
        run = Visit.of_run(watched)
        pages = [opened.open(run.path, run.ready)]
        others = visits(lab, options.pages)
        for index in range(1, options.tabs):
            # Half of the others look at a run that reports too, the rest at lists, trainings and comparisons.
            other = Visit.of_run(lab.live[index % len(lab.live)]) if index % 2 else others[index // 2 % len(others)]
            pages.append(opened.open(other.path, other.ready))
        # They look on: what it takes to open twenty at once is no part of how long a report takes.
        for page in pages:
            opened.drawn(page)
        began, cpu, acknowledged = time.time(), server.cpu_ms(), reporters.acknowledged
        while time.time() < began + options.seconds:
            pages[0].wait_for_timeout(200)
        ended = time.time()
        shown = seen(pages[0])
        sent = {step: at for step, at in reporters.sent[watched].items() if began <= at <= ended - 2 * _UPDATE_SECONDS}
        figures: dict[str, object] = {
            "busy_server_share": round((server.cpu_ms() - cpu) / 1000 / (ended - began), 2),
            "acknowledged_a_second": round((reporters.acknowledged - acknowledged) / (ended - began), 1),
            **_delays("update", sent, [(at, step) for at, step, _ in shown], ended),
            **_delays("curve_update", sent, [(at, step) for at, _, step in shown], ended),
        }
        figures |= _measure("busy: ", opened, lab, options, with_server=False)
        figures["busy_server_mb"] = round(server.memory_mb())
        for page in pages:
            page.context.close()
    return figures


def _delays(name: str, sent: dict[int, float], shown: Sequence[tuple[float, int]], ended: float) -> dict[str, object]:
    """Seconds from each report to the first time that the screen showed it, or a later one."""
    delays = [
        next((at for at, newest in shown if newest >= step and at >= reported), ended) - reported
        for step, reported in sent.items()
    ]
    if not delays:
        return {}
    return {f"{name}_median_s": round(statistics.median(delays), 2), f"{name}_worst_s": round(max(delays), 2)}


def _targets(pages: Sequence[str]) -> dict[str, float]:
    targets = {"server_mb": _MEMORY_MB, "bytes_a_point": _BYTES_A_POINT, **claim_targets()}
    targets |= {"update_worst_s": _UPDATE_SECONDS, "curve_update_worst_s": _UPDATE_SECONDS}
    for name in pages:
        drawn, longest = PAGES[name]
        targets |= {f"{name} drawn_ms": drawn, f"{name} longest_ms": longest}
        targets |= {f"{name} server_ms": _SERVER_MS, f"{name} tab_mb": _TAB_MB}
    return targets


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    options = parser(__doc__)
    sizes = ask_sizes(options)
    options.add_argument("--checkpoints", type=int, default=sizes.checkpoints, help="of the run that has many")
    options.add_argument("--live", type=int, default=sizes.live, help="runs that report")
    options.add_argument("--tabs", type=int, default=20, help="that look on meanwhile")
    options.add_argument("--seconds", type=float, default=60.0, help="of watching while runs report")
    options.add_argument("--repeats", type=int, default=1, help="visits of a page; medians count")
    options.add_argument("--pages", nargs="+", choices=PAGES, default=list(PAGES), help="that are measured")
    options.add_argument("--data-dir", type=Path, help="where the database is made; it stays there")
    return options.parse_args(arguments)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
