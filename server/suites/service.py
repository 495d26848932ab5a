"""What a person may do with suites of one's own."""

from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, UnusableArenaError
from server.ids import new_id
from server.services import Services
from server.suites.repository import SuiteRepository
from server.suites.schemas import MAX_SUITES, OwnScenario, OwnSuite
from sim.arenas.review import why_no_scenario
from sim.config import ArenaFile
from workers.job_protocol import MAX_SCENARIOS
from workers.wording import counted

MAX_OBSTACLES = 20_000
"""Of all scenarios of a suite: what a worker is sent at once, 2 MB."""


def every(services: Services) -> list[OwnSuite]:
    """All of them, by name."""
    with services.database.read() as session:
        return [_view(suite) for suite in SuiteRepository(session).all()]


def make(services: Services, name: str) -> OwnSuite:
    """A suite without a scenario.

    Raises:
        ConflictError: there is one of this name, or there are too many.
    """
    with services.database.write() as session:
        repository = SuiteRepository(session)
        names = [suite.name for suite in repository.all()]
        if name in names:
            raise ConflictError(f"There is a suite {name!r} already: add to it, or choose another name.")
        if len(names) >= MAX_SUITES:
            raise ConflictError(f"There are {MAX_SUITES} suites already: delete some first.")
        suite = tables.OwnSuite(id=new_id(), name=name, scenarios=[])
        repository.add(suite)
        AuditRepository(session).add("suite.made", target=suite.id, name=name)
        return _view(suite)


def add_scenario(services: Services, suite_id: str, sha256: str) -> OwnSuite:
    """An arena's start and target as the last scenario of a suite; one that it has already stays where it is.

    Raises:
        NotFoundError: there is no such suite, or no such arena.
        UnusableArenaError: the arena has no start and target, or the default robot can't drive from one to the other.
        ConflictError: the suite is full.
    """
    document = services.arenas.get(sha256).document
    if reason := why_no_scenario(document):
        raise UnusableArenaError(f"This is no scenario. {reason}")
    with services.database.read() as session:
        known = [one["sha256"] for one in SuiteRepository(session).get(suite_id).scenarios]
    obstacles = sum(_obstacles(services.arenas.get(each).document) for each in known) + _obstacles(document)
    with services.database.write() as session:
        suite = SuiteRepository(session).get(suite_id)
        if any(one["sha256"] == sha256 for one in suite.scenarios):
            return _view(suite)
        if len(suite.scenarios) >= MAX_SCENARIOS or obstacles > MAX_OBSTACLES:
            raise ConflictError(
                f"A suite has at most {MAX_SCENARIOS} scenarios with {counted(MAX_OBSTACLES)} obstacles in all: "
                "make another one."
            )
        suite.scenarios = [*suite.scenarios, {"sha256": sha256, "name": document.name}]
        return _view(suite)


def remove_scenario(services: Services, suite_id: str, sha256: str) -> OwnSuite:
    """The suite without one of its scenarios; what was measured with it stays.

    Raises:
        NotFoundError: there is no such suite.
    """
    with services.database.write() as session:
        suite = SuiteRepository(session).get(suite_id)
        suite.scenarios = [one for one in suite.scenarios if one["sha256"] != sha256]
        return _view(suite)


def delete(services: Services, suite_id: str) -> None:
    """Forget a suite; its arenas, and what was measured on it, stay.

    Raises:
        NotFoundError: there is no such suite.
    """
    with services.database.write() as session:
        repository = SuiteRepository(session)
        suite = repository.get(suite_id)
        AuditRepository(session).add("suite.deleted", target=suite_id, name=suite.name)
        repository.delete(suite)


def _obstacles(document: ArenaFile) -> int:
    return len(document.circles) + len(document.boxes)


def _view(suite: tables.OwnSuite) -> OwnSuite:
    return OwnSuite(
        id=suite.id,
        name=suite.name,
        created_at=suite.created_at,
        scenarios=[OwnScenario(sha256=one["sha256"], name=one["name"]) for one in suite.scenarios],
    )
