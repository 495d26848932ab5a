"""What a person may ask of the matrix: all of it, with the evaluations that they may see."""

from collections.abc import Collection, Iterable

from server.database import tables
from server.estimates import success_estimate
from server.evaluations.schemas import EvaluationFigures
from server.field.schemas import FieldCell, FieldDriver, FieldMatrix, FieldSight
from server.leaderboards.repository import LeaderboardRepository
from server.services import Services
from workers.shipped.field import FieldRow, field

_ASKED = "{family}-1-200"  # what `sim.suites.suite_for` calls the suite of a family at difficulty 1

Cells = dict[str, FieldCell]


def matrix(services: Services, visible: Collection[str] | None) -> FieldMatrix:
    """Success in every family.

    Args:
        services: of the application.
        visible: projects that may be seen; None for all.
    """
    measured = field()
    rows = [row for row in measured.rows if row.part == "families"]
    best: dict[str, float] = {}
    for row in rows:
        best[row.suite] = max(best.get(row.suite, 0.0), row.success if row.policy else 0.0)
    families = sorted(best, key=lambda family: (best[family], family))
    suites = {_ASKED.format(family=family): family for family in families}
    with services.database.read() as session:
        asked = _asked(LeaderboardRepository(session, visible).evaluations_named(suites), suites, families)
    return FieldMatrix(
        families=families,
        sights=[
            FieldSight(
                rays=rays,
                field_of_view=view,
                drivers=_drivers((row for row in rows if (row.field_of_view, row.rays) == (view, rays)), families),
            )
            for view, rays in sorted({(row.field_of_view, row.rays) for row in rows})
        ],
        asked=asked,
        command=measured.command,
        date=measured.date,
    )


def _drivers(rows: Iterable[FieldRow], families: list[str]) -> list[FieldDriver]:
    """What sees equally much: policies, their seeds together, and baselines."""
    seeds: dict[tuple[str, str | None], dict[str, list[FieldRow]]] = {}
    for row in rows:
        seeds.setdefault((row.driver, row.policy), {}).setdefault(row.suite, []).append(row)
    found = [
        _driver(title, policy, policy is not None, {suite: _cell(each) for suite, each in own.items()}, families)
        for (title, policy), own in seeds.items()
    ]
    return sorted(found, key=lambda driver: (not driver.trained, -_mean(driver)))


def _cell(rows: list[FieldRow]) -> FieldCell:
    episodes = [row.episodes for row in rows]
    return FieldCell(
        success=success_estimate([row.arrivals for row in rows], episodes, trained=rows[0].policy is not None),
        collision=sum(row.collisions for row in rows) / sum(episodes),
        worst_tenth_spl=sum(row.worst_tenth_spl for row in rows) / len(rows),
        evaluation=None,
    )


def _asked(rows: list[tables.PolicyEvaluation], suites: dict[str, str], families: list[str]) -> list[FieldDriver]:
    """The newest evaluation of each policy in each family; `rows` are the newest first."""
    found: dict[tuple[str, bool], Cells] = {}
    for row in rows:
        figures = EvaluationFigures.model_validate(row.figures)
        cell = FieldCell(
            success=figures.success,
            collision=figures.collision,
            worst_tenth_spl=figures.worst_tenth_spl,
            evaluation=row.id,
        )
        trained = row.policy["source"] != "baseline"
        found.setdefault((row.title, trained), {}).setdefault(suites[row.suite or ""], cell)
    return [_driver(title, None, trained, cells, families) for (title, trained), cells in found.items()]


def _driver(title: str, policy: str | None, trained: bool, cells: Cells, families: list[str]) -> FieldDriver:
    return FieldDriver(title=title, policy=policy, trained=trained, cells=[cells.get(family) for family in families])


def _mean(driver: FieldDriver) -> float:
    rates = [cell.success.value for cell in driver.cells if cell]
    return sum(rates) / len(rates)
