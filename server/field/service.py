"""What a person may ask of the matrix: all of it, with the evaluations that they may see."""

from collections.abc import Collection, Iterable, Mapping, Sequence

from server.database import tables
from server.estimates import success_estimate
from server.field.schemas import FieldCell, FieldDriver, FieldMatrix, FieldSight
from server.leaderboards.asked import AskedTogether, together
from server.leaderboards.repository import LeaderboardRepository, Seed
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
        repository = LeaderboardRepository(session, visible)
        rows_asked = repository.evaluations_named(suites)
        asked = _asked(rows_asked, repository.seeds_of(rows_asked), suites, families)
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


def _asked(
    rows: list[tables.PolicyEvaluation], seeds: Mapping[str, Seed], suites: dict[str, str], families: list[str]
) -> list[FieldDriver]:
    """The newest evaluations of each policy in each family, a training's seeds together; `rows` are the newest first."""
    # By its hash, since scenarios of two versions are not counted together.
    alike: dict[tuple[str, str | None], list[tables.PolicyEvaluation]] = {}
    for row in rows:
        alike.setdefault((row.suite or "", row.suite_hash), []).append(row)
    found: dict[tuple[str, bool], dict[str, AskedTogether]] = {}
    for (suite, _), some in alike.items():
        for each in together(some, seeds):
            key = each.training[0] if each.training else each.title, each.trained
            found.setdefault(key, {}).setdefault(suites[suite], each)
    drivers = [
        _driver(
            _title(list(own.values())), None, trained, {family: _measured(each) for family, each in own.items()}, families
        )
        for (_, trained), own in found.items()
    ]
    return sorted(drivers, key=lambda driver: (driver.cells.count(None), -_mean(driver)))


def _title(measured: Sequence[AskedTogether]) -> str:
    """A training's name, unless it is one and the same checkpoint everywhere."""
    titles = {each.title for each in measured}
    training = measured[0].training
    return training[1] if training and len(titles) > 1 else titles.pop()


def _measured(asked: AskedTogether) -> FieldCell:
    figures = asked.figures
    return FieldCell(
        success=asked.success,
        collision=sum(each.collision for each in figures) / len(figures),
        worst_tenth_spl=sum(each.worst_tenth_spl for each in figures) / len(figures),
        evaluation=asked.rows[0].id,
        suite_hash=asked.rows[0].suite_hash,
    )


def _driver(title: str, policy: str | None, trained: bool, cells: Cells, families: list[str]) -> FieldDriver:
    return FieldDriver(title=title, policy=policy, trained=trained, cells=[cells.get(family) for family in families])


def _mean(driver: FieldDriver) -> float:
    rates = [cell.success.value for cell in driver.cells if cell]
    return sum(rates) / len(rates)
