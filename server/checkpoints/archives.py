"""Removes archives that no checkpoint names: uploads that were cut off, and what a deletion left behind.

An archive's id is written down before its first byte, and crossed out in the transaction that registers its checkpoint; so
the database knows what it has brought into the store, and nothing else is ever removed. Several installations may share a
store. What was never registered is doomed an hour after it began, in a transaction of its own: from then on it can't be
registered any more, whatever the clock says, and its file may go. What a training began with stays for as long as that
training does, whatever became of the checkpoint.
"""

import logging
import time
from collections.abc import AsyncIterator, Collection, Iterable
from contextlib import asynccontextmanager

from sqlalchemy import Select, delete, select, update
from sqlalchemy.orm import Session

from server.background import kept_up
from server.checkpoints.hold import removing
from server.database import tables
from server.errors import DatabaseAwayError, DatabaseBusyError
from server.jobs.names import recordings_prefix
from server.services import Services

logger = logging.getLogger(__name__)

GRACE_SECONDS = 3_600.0
"""An upload that takes longer is begun anew."""
_PAUSE_SECONDS = 600.0
_AT_ONCE = 100


class LooseArchives:
    """The archives of this database that no checkpoint names, within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def begin(self, archive_id: str) -> None:
        """An archive is about to be brought."""
        self._session.add(tables.LooseArchive(id=archive_id, since=time.time(), doomed=False))

    def register(self, archive_id: str) -> bool:
        """A checkpoint names it now; whether it may: one that is doomed, or was not announced, must come again."""
        row = self._session.get(tables.LooseArchive, archive_id, with_for_update=True)
        if row is None or row.doomed:
            return False
        self._session.delete(row)
        return True

    def let_go(self, archive_ids: Collection[str]) -> set[str]:
        """Their checkpoints are gone: so shall they be, but for those that a training begins with; the ids of the others."""
        now = time.time()
        begun = set(self._session.scalars(_begun_with().where(tables.ExperimentKey.text.in_(archive_ids))))
        self._session.add_all(
            tables.LooseArchive(id=archive_id, since=now, doomed=archive_id not in begun) for archive_id in archive_ids
        )
        return {archive_id for archive_id in archive_ids if archive_id not in begun}

    def doom_older(self, moment: float) -> list[str]:
        """Doom what began before `moment`; the ids of some that are doomed, by now or earlier."""
        loose = tables.LooseArchive
        old = update(loose).where(loose.since < moment, loose.id.not_in(_begun_with()))
        self._session.execute(old.values(doomed=True))
        return list(self._session.scalars(select(loose.id).where(loose.doomed).order_by(loose.since).limit(_AT_ONCE)))

    def give_up(self, archive_ids: Collection[str]) -> list[str]:
        """Doom those of them that are still loose; the ids of these. What a checkpoint names by now stays."""
        loose = tables.LooseArchive
        self._session.execute(update(loose).where(loose.id.in_(archive_ids)).values(doomed=True))
        return list(self._session.scalars(select(loose.id).where(loose.id.in_(archive_ids))))

    def forget(self, archive_ids: Collection[str]) -> None:
        """They are gone from the store."""
        self._session.execute(delete(tables.LooseArchive).where(tables.LooseArchive.id.in_(archive_ids)))


def _begun_with() -> Select[str | None]:
    """The ids of archives that an experiment, in the trash or not, begins with: its runs may be started anew at any time."""
    key = tables.ExperimentKey
    return select(key.text).where(key.key == tables.START_KEY, key.text.is_not(None))


def remove_archives(services: Services, archive_ids: Collection[str]) -> int:
    """Remove what is doomed from the store, then forget it; none while a backup needs it. How many; blocks."""
    with removing(services.settings.data_dir) as allowed:
        if not allowed:
            return 0
        for archive_id in archive_ids:
            services.files.delete(archive_id)
    with services.database.write() as session:
        LooseArchives(session).forget(archive_ids)
    return len(archive_ids)


def forget_recordings(services: Services, sha256s: Iterable[str]) -> None:
    """Remove what is kept of their episodes, which nobody can ask for any more. Blocks."""
    for sha256 in sha256s:
        services.results.forget(recordings_prefix(sha256))


def give_up_archives(services: Services, archive_ids: Collection[str]) -> None:
    """Remove archives whose registration did not come to its end, as far as anybody knows. Blocks.

    A commit whose answer was lost may have registered them all the same: the database is asked, and where it can't be, the
    sweep finds out later.
    """
    try:
        with services.database.write() as session:
            doomed = LooseArchives(session).give_up(archive_ids)
        remove_archives(services, doomed)
    except (DatabaseAwayError, DatabaseBusyError, OSError):
        logger.info("archives that may not have been registered are left to the sweep: %s", ", ".join(sorted(archive_ids)))


def sweep_archives(services: Services, now: float) -> int:
    """Remove what has been loose for too long; how many were removed. Blocks."""
    with services.database.write() as session:
        doomed = LooseArchives(session).doom_older(now - GRACE_SECONDS)
    return remove_archives(services, doomed)


@asynccontextmanager
async def keep_swept(services: Services) -> AsyncIterator[None]:
    """Sweep the store at start and every ten minutes, for as long as the block lasts."""
    async with kept_up(
        lambda: sweep_archives(services, time.time()),
        at_once=_AT_ONCE,
        pause=_PAUSE_SECONDS,
        failed="archives that no checkpoint names could not be removed: the next sweep tries again",
    ):
        yield
