"""The matrices in Markdown, as they stand in docs/generalisation.md."""

from collections.abc import Callable
from pathlib import Path

from benchmarks.field.candidates import KNOWS_THE_MAP
from benchmarks.field.suites import FAMILIES, FROZEN
from workers.shipped.field import Field, FieldRow
from workers.statistics.seeds import mean_interval, success_rate

DOCS = Path(__file__).parents[2] / "docs" / "generalisation.md"
BEGIN, END = "<!-- python -m benchmarks.field --write -->", "<!-- end of the benchmark's output -->"

Group = list[FieldRow]
"""One candidate on one suite, a row for each training seed."""


def written(docs: str, field: Field) -> str:
    """The page with its tables replaced by these."""
    head, rest = docs.split(BEGIN)
    _, tail = rest.split(END)
    return f"{head}{BEGIN}\n\n{tables(field)}\n\n{END}{tail}"


def tables(field: Field) -> str:
    """All matrices that something was measured of."""
    parts = [
        _families(field),
        *(_barn(field, suite) for suite in FROZEN["barn"]),
        *(_people(field, suite) for suite in FROZEN["people"]),
    ]
    return "\n\n".join(part for part in parts if part)


def success(group: Group) -> str:
    """Percent with the 95 % interval: over one driver's episodes, or its worlds where it drives each again, or seeds."""
    (first, *others) = group
    if first.worlds and not others:
        by_world = [arrivals for arrivals, worlds in enumerate(first.worlds) for _ in range(worlds)]
        interval = success_rate(by_world, [first.episodes // len(by_world)] * len(by_world))
    else:
        interval = success_rate([row.arrivals for row in group], [row.episodes for row in group])
    return f"{100 * interval.value:.1f} [{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def _families(field: Field) -> str:
    groups = _groups(field, "families")
    if not groups:
        return ""
    names = [name for name in FAMILIES if any(row.suite == name for row in field.rows)]
    sights = sorted({(group[0].field_of_view, group[0].rays) for group in groups})
    names.sort(key=lambda name: max((row.success for row in field.rows if row.policy and row.suite == name), default=0.0))
    lines = ["Success, %, in families at difficulty 1, beside it the SPL of the worst tenth of the episodes.", ""]
    lines += ["| | N | seeds | " + " | ".join(names) + " |", "|---|---|---|" + "---|" * len(names)]
    for view, rays in sights:
        lines.append(f"| **{view:g} degrees, {rays} rays** | | |" + " |" * len(names))
        own = [group for group in groups if (group[0].field_of_view, group[0].rays) == (view, rays)]
        for driver in sorted(dict.fromkeys(_name(group[0]) for group in own), key=lambda name: name.startswith("*")):
            cells = {group[0].suite: group for group in own if _name(group[0]) == driver}
            counts = sorted({group[0].episodes for group in cells.values()})
            seeds = max(len(group) for group in cells.values()) if driver.startswith("*") else ""
            shown = [f"{success(cells[name])}; {_tenth(cells[name])}" if name in cells else "" for name in names]
            lines.append(
                f"| {driver} | {' to '.join(map(str, dict.fromkeys((counts[0], counts[-1]))))} | {seeds} | "
                + " | ".join(shown)
                + " |"
            )
    return "\n".join(lines)


def _barn(field: Field, suite: str) -> str:
    columns: dict[str, Callable[[Group], str]] = {
        "score, of 0.5": lambda group: _mean(group, "score", 3),
        "success, %": success,
        "collisions, %": lambda group: _share(group, "collisions"),
        "time, s": lambda group: _mean(group, "seconds", 1),
    }
    return _table(field, suite, f"`{suite}`, by the challenge's rules.", columns, lambda group: -(group[0].score or 0.0))


def _people(field: Field, suite: str) -> str:
    columns: dict[str, Callable[[Group], str]] = {
        "success, %": success,
        "collisions, %": lambda group: _share(group, "collisions"),
        "the robot's, %": lambda group: _share(group, "at_fault"),
        "time, s": lambda group: _mean(group, "seconds", 1),
        "intrusion, s": lambda group: _mean(group, "intrusion", 2),
        "delay, s": lambda group: _mean(group, "delay", 1),
        "detour, m/m": lambda group: _mean(group, "detour", 3),
    }
    seen = "who give way to the robot" if suite == "people-500" else "who do not see the robot"
    return _table(field, suite, f"`{suite}`: among people {seen}.", columns, lambda group: -group[0].success)


def _table(
    field: Field, suite: str, title: str, columns: dict[str, Callable[[Group], str]], merit: Callable[[Group], float]
) -> str:
    groups = sorted((group for group in _groups(field) if group[0].suite == suite), key=merit)
    groups.sort(key=lambda group: group[0].driver != KNOWS_THE_MAP)
    if not groups:
        return ""
    lines = [title, "", "| | N | seeds | " + " | ".join(columns) + " |", "|---" * (len(columns) + 3) + "|"]
    for group in groups:
        seeds = str(len(group)) if group[0].policy else ""
        cells = [_name(group[0]), str(group[0].episodes), seeds, *(column(group) for column in columns.values())]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _groups(field: Field, part: str | None = None) -> list[Group]:
    """Rows of the same candidate on the same suite, its training seeds together; what ships first."""
    together: dict[tuple[object, ...], Group] = {}
    for row in field.rows:
        if part in (None, row.part):
            together.setdefault((row.suite, row.driver, row.rays, row.field_of_view), []).append(row)
    return [sorted(group, key=lambda row: row.seed or 0) for group in together.values()]


def _name(row: FieldRow) -> str:
    return f"*{row.driver}*" if row.policy else row.driver


def _tenth(group: Group) -> str:
    return f"{mean_interval([row.worst_tenth_spl for row in group]).value:.2f}"


def _share(group: Group, name: str) -> str:
    return f"{100.0 * sum(getattr(row, name) for row in group) / sum(row.episodes for row in group):.1f}"


def _mean(group: Group, name: str, decimals: int) -> str:
    values = [value for row in group if (value := getattr(row, name)) is not None]
    return f"{sum(values) / len(values):.{decimals}f}" if values else "-"
