"""The list of experiments, and what it is found, sorted and grouped by."""

from collections.abc import Collection, Sequence

from sqlalchemy.orm import Session

from server.http.paging import Window
from server.services import Services
from server.workbench.fields import ALIASES, ATTRIBUTES, is_series, resolve
from server.workbench.keys import KeyRepository
from server.workbench.language import Text
from server.workbench.listing import grouped, is_setting, listed
from server.workbench.repository import Sorting, Wanted, WorkbenchRepository
from server.workbench.schemas import (
    MAX_AT_ONCE,
    Groups,
    KnownKey,
    KnownKeys,
    ListedPage,
    MatchingIds,
)

# The tables that lists, groups and keys are made of.
MADE_OF = ("experiments", "experiment_keys", "experiment_tags", "runs", "latest_metrics", "projects")


class WorkbenchService:
    """Lists, groups, and names keys."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def state(self) -> tuple[object, ...]:
        """What lists, groups and keys depend on, beside what is asked for."""
        return self._services.database.writes.of(*MADE_OF), self._services.arenas.changed_at

    def page(self, wanted: Wanted, *, sort: str, columns: Sequence[str], window: Window, after: str | None) -> ListedPage:
        """Some of the experiments that are wanted.

        Raises:
            QueryError: the query, the key to sort by or a column makes no sense.
            InvalidRequestError: `after` is no end of a part of this list.
        """
        with self._services.database.read() as session:
            repository = WorkbenchRepository(session)
            matching = repository.matching(wanted)
            settings, metrics = _columns(session, columns)
            found, following = repository.page(matching, Sorting.of(sort), window.limit, window.offset, after)
            items = listed(session, self._services.arenas, found, settings, metrics)
            return ListedPage(items=items, total=repository.count(matching), next=following)

    def ids(self, wanted: Wanted) -> MatchingIds:
        """What is wanted, as many as one action may be about, the newest first.

        Raises:
            QueryError: the query makes no sense.
        """
        with self._services.database.read() as session:
            repository = WorkbenchRepository(session)
            matching = repository.matching(wanted)
            return MatchingIds(ids=repository.ids(matching, MAX_AT_ONCE), total=repository.count(matching))

    def groups(self, wanted: Wanted, *, by: str, columns: Sequence[str], window: Window) -> Groups:
        """The experiments that are wanted by the values of a key.

        Raises:
            QueryError: the query, the key or a column makes no sense.
        """
        with self._services.database.read() as session:
            matching = WorkbenchRepository(session).matching(wanted)
            whole, items, total = grouped(session, matching, by, _columns(session, columns)[1], window)
            return Groups(by=whole, items=items, total=total)

    def keys(self, visible: Collection[str] | None) -> KnownKeys:
        """Everything that a query may ask for: properties, settings, metrics; of `visible` projects."""
        with self._services.database.read() as session:
            repository = KeyRepository(session)
            settings, series = repository.settings(visible), repository.series(visible)
        numbers = dict(settings)
        return KnownKeys(
            items=[
                *(
                    KnownKey(key=key, kind=one.kind, of="property", meaning=one.meaning, values=list(one.values))
                    for key, one in ATTRIBUTES.items()
                ),
                *(
                    KnownKey(
                        key=short, kind="number" if numbers.get(whole) else "text", of="setting", meaning=whole, values=[]
                    )
                    for short, whole in ALIASES.items()
                ),
                *(
                    KnownKey(key=key, kind="number" if number else "text", of="setting", meaning="", values=[])
                    for key, number in settings
                    if key not in ALIASES.values()
                ),
                *(KnownKey(key=name, kind="number", of="metric", meaning="", values=[]) for name in series),
            ]
        )

    def values(self, key: str, part: str, visible: Collection[str] | None) -> list[str]:
        """Values to complete a query with: of a tag or a setting that contain `part`; of another key none.

        Raises:
            QueryError: there is no such key.
        """
        with self._services.database.read() as session:
            repository = KeyRepository(session)
            if key == "tag":
                return repository.tags(part, visible)
            whole = resolve(session, Text(key, 0))
            return repository.values(whole, part, visible) if is_setting(whole) else []


def _columns(session: Session, columns: Sequence[str]) -> tuple[list[str], list[str]]:
    """The settings and the metrics among columns, by their whole names."""
    whole = [resolve(session, Text(column, 0)) for column in columns if column not in ATTRIBUTES]
    return [key for key in whole if not is_series(key)], [key for key in whole if is_series(key)]
