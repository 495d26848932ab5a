"""Notices what happens, and lets each rule say so once.

A look costs what has changed: the runs that ended since the last one, those that workers have, and what waits. Two servers
may look at the same time: the database takes each key once.
"""

import logging
import shutil
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

from sqlalchemy.orm import Session

from server.alerts import happenings
from server.alerts.happenings import Happening
from server.alerts.repository import AlertRepository, Said
from server.alerts.sights import SightRepository
from server.database import tables
from server.diagnoses.service import DiagnosisService
from server.errors import NotFoundError
from server.people.gate import principal_of_account
from server.runs import states
from server.security.principal import OWNER, Principal
from server.services import Services
from workers.diagnoses import Diagnosis

logger = logging.getLogger(__name__)

# Before the first look: what ended while the last server of ours was on its way out.
_FIRST_LOOK_SECONDS = 3_600.0
# A run's end is written down a little after it was noted.
_OVERLAP_SECONDS = 60.0
# Curves are read, run by run, no more often.
_DIAGNOSE_SECONDS = 60.0
_AT_ONCE = 500
# Of one rule within an hour; more is noted, and not sent.
AT_MOST = 30
_HOUR = 3_600.0
_KEPT_SECONDS = 90 * 86_400.0
# Keys that the database need not be asked about again.
_REMEMBERED = 50_000


class AlertWatcher:
    """Looks at what has happened. Used on one thread at a time.

    Args:
        services: of the server.
        clock: seconds since the epoch.
        free: bytes that are left on the disk.
    """

    def __init__(
        self, services: Services, clock: Callable[[], float] = time.time, free: Callable[[], int] | None = None
    ) -> None:
        self._services = services
        self._clock = clock
        self._free = free or (lambda: shutil.disk_usage(services.settings.data_dir).free)
        self._since = clock() - _FIRST_LOOK_SECONDS
        self._forgot_at = 0.0
        self._said: set[str] = set()
        # By run: the step at which its curves were read last, and when.
        self._diagnosed: dict[str, tuple[int, float]] = {}

    def look(self) -> int:
        """One look at everything; how many alerts are new. Blocks."""
        now = self._clock()
        self._forget(now)
        with self._services.database.read() as session:
            rules = _grouped(session, AlertRepository(session).enabled())
            if not rules:
                self._since = now
                return 0
            fresh = {
                said.key: said
                for happening, asked in self._happened(session, rules, now)
                for said in (Said(rule, happening) for rule, principal in asked if _concerns(rule, principal, happening))
                if said.key not in self._said
            }
            known = AlertRepository(session).known(fresh)
        self._remember(known)
        return self._say([said for key, said in fresh.items() if key not in known], now)

    def _say(self, fresh: Sequence[Said], now: float) -> int:
        if not fresh:
            return 0
        # Whatever takes time, before the write lock is taken.
        spoken = [(said, said.happening.words()) for said in fresh]
        new = 0
        with self._services.database.write() as session:
            repository = AlertRepository(session)
            said_lately = repository.lately({said.rule.id for said in fresh}, now - _HOUR)
            for said, text in spoken:
                count = said_lately.get(said.rule.id, 0)
                withheld = f"More than {AT_MOST} within an hour." if count >= AT_MOST else None
                if repository.say(said, text, now, withheld):
                    new += 1
                    said_lately[said.rule.id] = count + 1
        self._remember({said.key for said in fresh})
        return new

    def _happened(
        self, session: Session, rules: "_Rules", now: float
    ) -> Iterator[tuple[Happening, Sequence["tuple[tables.AlertRule, Principal]"]]]:
        sights = SightRepository(session)
        found = lru_cache(self._findings)
        over = sights.ended_since(self._since - _OVERLAP_SECONDS, _AT_ONCE)
        self._since = now if len(over) < _AT_ONCE else over[-1].finished_at or now
        if rules["failed"]:
            for run in over:
                if run.state == "failed":
                    yield happenings.failed(run, lambda run=run: found(run.id)), rules["failed"]  # type: ignore[misc]
        if rules["ended"]:
            last = {run.experiment_id: run for run in over}
            for experiment_id, runs in sights.runs_of(last).items():
                if all(run.state in states.FINISHED for run in runs):
                    run = last[experiment_id]
                    findings = lambda run=run: found(run.id)  # noqa: E731
                    yield happenings.ended(run.experiment, runs, findings), rules["ended"]
        active = sights.active() if rules["success"] or rules["diagnosis"] else []
        for rule, principal in rules["success"]:
            assert rule.threshold is not None
            for run in (*active, *over):
                rate = happenings.success_rate(run)
                if rate is not None and rate >= rule.threshold:
                    yield happenings.succeeded(run, rule.threshold), [(rule, principal)]
        if rules["diagnosis"]:
            for run in self._to_diagnose((*active, *over), now):
                for diagnosis in found(run.id):
                    yield happenings.diagnosed(run, diagnosis), rules["diagnosis"]
        for rule, principal in rules["stuck"]:
            assert rule.threshold is not None
            for experiment, waiting, since in sights.waiting_since(now - 60.0 * rule.threshold, _AT_ONCE):
                yield happenings.stuck(experiment, waiting, since, now), [(rule, principal)]
        if rules["disk"]:
            free = self._free()
            for rule, principal in rules["disk"]:
                if free < (rule.threshold or 0.0) * 2**30:
                    yield happenings.disk_low(free, now), [(rule, principal)]

    def _to_diagnose(self, runs: Sequence[tables.Run], now: float) -> list[tables.Run]:
        due = []
        for run in runs:
            step, at = self._diagnosed.get(run.id, (0, 0.0))
            if run.step != step and (now - at >= _DIAGNOSE_SECONDS or run.state in states.FINISHED):
                due.append(run)
        there = {run.id for run in runs}
        self._diagnosed = {run_id: seen for run_id, seen in self._diagnosed.items() if run_id in there}
        self._diagnosed |= {run.id: (run.step, now) for run in due}
        return due

    def _findings(self, run_id: str) -> Sequence[Diagnosis]:
        try:
            return DiagnosisService(self._services).of_run(run_id).diagnoses
        except NotFoundError:  # deleted a moment ago
            return ()

    def _remember(self, keys: set[str]) -> None:
        if len(self._said) > _REMEMBERED:
            self._said.clear()
        self._said |= keys

    def _forget(self, now: float) -> None:
        if now - self._forgot_at < _HOUR:
            return
        self._forgot_at = now
        with self._services.database.write() as session:
            AlertRepository(session).forget(now - _KEPT_SECONDS)


_Rules = dict[str, list[tuple[tables.AlertRule, Principal]]]


def _grouped(session: Session, rules: Sequence[tables.AlertRule]) -> _Rules:
    """The rules by event, each with what its person may see now; without those whose account is closed."""
    people: dict[str | None, Principal | None] = {None: OWNER}
    grouped: _Rules = defaultdict(list)
    for rule in rules:
        if rule.user_id not in people and rule.user_id is not None:
            people[rule.user_id] = principal_of_account("person", session, rule.user_id, "", "admin", None)
        principal = people[rule.user_id]
        if principal is not None:
            grouped[rule.event].append((rule, principal))
    return grouped


def _concerns(rule: tables.AlertRule, principal: Principal, happening: Happening) -> bool:
    if happening.at is not None and happening.at < rule.created_at:
        return False
    if happening.project_id is None:
        return principal.administrates
    return rule.project_id in (None, happening.project_id) and principal.role_in(happening.project_id) is not None
