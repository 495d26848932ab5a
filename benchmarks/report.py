"""How every benchmark ends: one line of JSON with its figures, and an exit code that says whether they reach the target."""

import argparse
import json
import os
import platform
import sys
from collections.abc import Mapping
from datetime import UTC, datetime


def machine() -> dict[str, str | int]:
    """What the figures were measured on."""
    return {"cores": os.cpu_count() or 1, "machine": platform.machine(), "python": platform.python_version()}


def parser(description: str | None) -> argparse.ArgumentParser:
    """The options that every benchmark has."""
    options = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--check", action="store_true", help="exit with 1 where a figure falls short of its target")
    return options


def finish(
    name: str,
    figures: Mapping[str, object],
    *,
    at_least: Mapping[str, float] | None = None,
    at_most: Mapping[str, float] | None = None,
    check: bool = False,
) -> None:
    """Print the line of JSON; with `check`, exit with 1 if a figure that has a target misses it.

    Args:
        name: the benchmark's.
        figures: what was measured, by name.
        at_least: targets that the figures of these names must reach.
        at_most: targets that the figures of these names must not exceed.
        check: whether to fail.
    """
    missed = []
    for targets, sign in ((at_least or {}, 1), (at_most or {}, -1)):
        for key, target in targets.items():
            value = figures.get(key)
            if not isinstance(value, int | float) or sign * value < sign * target:
                missed.append(f"{key} is {value}, target {'>=' if sign > 0 else '<='} {target}")
    print(
        json.dumps(
            {
                "benchmark": name,
                "date": datetime.now(UTC).date().isoformat(),
                **machine(),
                **figures,
                "targets": {**(at_least or {}), **(at_most or {})},
                "missed": missed,
            }
        )
    )
    if check and missed:
        sys.exit(1)
