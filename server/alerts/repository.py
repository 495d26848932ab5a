"""Rules of alerts, and alerts, in SQL."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Row, delete, func, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from server.alerts.happenings import Happening
from server.database import tables
from server.errors import NotFoundError
from server.http.paging import Window

_AT_ONCE = 500


@dataclass(frozen=True, slots=True)
class Said:
    """A rule's words about something that happened."""

    rule: tables.AlertRule
    happening: Happening

    @property
    def key(self) -> str:
        """Under which it is said once."""
        return f"{self.rule.id} {self.happening.key}"


class AlertRepository:
    """Reads and writes rules and alerts within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def enabled(self) -> Sequence[tables.AlertRule]:
        """All rules that are on."""
        return self._session.scalars(select(tables.AlertRule).where(tables.AlertRule.enabled)).all()

    def count(self, user_id: str | None) -> int:
        """How many rules somebody has."""
        return self._session.scalar(select(func.count()).select_from(tables.AlertRule).where(_of(user_id))) or 0

    def add(self, rule: tables.AlertRule) -> None:
        """Add a rule."""
        self._session.add(rule)
        self._session.flush()

    def rule(self, user_id: str | None, rule_id: str) -> tables.AlertRule:
        """One of somebody's own rules.

        Raises:
            NotFoundError: there is none.
        """
        found = self._session.scalar(select(tables.AlertRule).where(tables.AlertRule.id == rule_id, _of(user_id)))
        if found is None:
            raise NotFoundError.of("rule", rule_id)
        return found

    def rules(self, user_id: str | None, window: Window) -> tuple[Sequence[Row[tables.AlertRule, str | None]], int]:
        """Some of somebody's rules with the names of their projects, the oldest first, and how many there are."""
        query = (
            select(tables.AlertRule, tables.Project.name)
            .outerjoin(tables.Project, tables.Project.id == tables.AlertRule.project_id)
            .where(_of(user_id))
            .order_by(tables.AlertRule.created_at, tables.AlertRule.id)
            .limit(window.limit)
            .offset(window.offset)
        )
        return self._session.execute(query).all(), self.count(user_id)

    def remove(self, rule: tables.AlertRule) -> None:
        """Remove a rule with all that it has said."""
        self._session.execute(delete(tables.Alert).where(tables.Alert.rule_id == rule.id))
        self._session.delete(rule)

    def alerts(self, user_id: str | None, window: Window) -> tuple[Sequence[Row[tables.Alert, tables.AlertRule]], int]:
        """Some of what somebody's rules have said, the newest first, and how much there is."""
        query = select(tables.Alert, tables.AlertRule).join(tables.AlertRule).where(_of(user_id))
        counted = select(func.count()).select_from(tables.Alert).join(tables.AlertRule).where(_of(user_id))
        query = query.order_by(tables.Alert.id.desc()).limit(window.limit).offset(window.offset)
        return self._session.execute(query).all(), self._session.scalar(counted) or 0

    def newest(self, user_id: str | None) -> int:
        """The id of the newest alert of somebody's for the browser; 0 where there is none."""
        query = select(func.max(tables.Alert.id)).join(tables.AlertRule)
        return self._session.scalar(query.where(_of(user_id), tables.AlertRule.channel == "browser")) or 0

    def news(self, user_id: str | None, after: int, limit: int) -> Sequence[Row[tables.Alert, tables.AlertRule]]:
        """The newest of somebody's alerts for the browser after one of them, the newest first."""
        query = select(tables.Alert, tables.AlertRule).join(tables.AlertRule)
        query = query.where(
            tables.Alert.id > after, _of(user_id), tables.AlertRule.channel == "browser", tables.Alert.state == "sent"
        )
        return self._session.execute(query.order_by(tables.Alert.id.desc()).limit(limit)).all()

    def known(self, keys: Collection[str]) -> set[str]:
        """Those of the keys that were said already."""
        wanted = sorted(keys)
        found: set[str] = set()
        for start in range(0, len(wanted), _AT_ONCE):
            some = wanted[start : start + _AT_ONCE]
            found.update(self._session.scalars(select(tables.Alert.key).where(tables.Alert.key.in_(some))))
        return found

    def lately(self, rule_ids: Collection[str], since: float) -> dict[str, int]:
        """How much each of the rules has said since a moment; one that said nothing is absent."""
        query = (
            select(tables.Alert.rule_id, func.count())
            .where(tables.Alert.rule_id.in_(rule_ids), tables.Alert.created_at > since, tables.Alert.state != "withheld")
            .group_by(tables.Alert.rule_id)
        )
        return {row[0]: row[1] for row in self._session.execute(query)}

    def say(self, said: Said, text: str, now: float, withheld: str | None = None) -> bool:
        """Note what a rule has to say, unless it was said before; whether it is new.

        Args:
            said: what is said by which rule.
            text: the happening's words.
            now: in seconds since the epoch.
            withheld: why it is not sent, where it is not.
        """
        happening = said.happening
        state: tables.AlertState = "waiting"
        if withheld is not None:
            state = "withheld"
        elif said.rule.channel == "browser":
            # It is there for whoever asks.
            state = "sent"
        postgres = self._session.get_bind().dialect.name == "postgresql"
        insert = postgresql.insert if postgres else sqlite.insert
        values = {
            "rule_id": said.rule.id,
            "key": said.key,
            "created_at": now,
            "title": happening.title[:200],
            "text": text,
            "project_id": happening.project_id,
            "experiment_id": happening.experiment_id,
            "run_id": happening.run_id,
            "state": state,
            "tries": 0,
            "next_at": now if state == "waiting" else None,
            "sent_at": now if state == "sent" else None,
            "outcome": withheld,
        }
        query = insert(tables.Alert).values(**values).on_conflict_do_nothing().returning(tables.Alert.id)
        return self._session.scalar(query) is not None

    def due(self, now: float, limit: int) -> Sequence[int]:
        """The ids of alerts that are to be sent now, the longest due first."""
        row = tables.Alert
        query = select(row.id).where(row.state == "waiting", row.next_at <= now).order_by(row.next_at).limit(limit)
        return self._session.scalars(query).all()

    def take(self, alert_id: int, now: float, until: float) -> tuple[tables.Alert, tables.AlertRule] | None:
        """Be the one who sends it; None where another one is."""
        row = tables.Alert
        query = (
            update(row)
            .where(row.id == alert_id, row.state == "waiting", row.next_at <= now)
            .values(state="sending", tries=row.tries + 1, next_at=until)
        )
        if not self._session.execute(query).rowcount:  # type: ignore[attr-defined]
            return None
        found = self._session.execute(
            select(row, tables.AlertRule).join(tables.AlertRule).where(row.id == alert_id)
        ).one_or_none()
        return (found[0], found[1]) if found else None

    def settle(self, alert_id: int, state: tables.AlertState, outcome: str | None, at: float | None) -> None:
        """What came of sending it: `at` is when it was sent, or when it is due again."""
        sent, due = (at, None) if state == "sent" else (None, at)
        query = update(tables.Alert).where(tables.Alert.id == alert_id, tables.Alert.state == "sending")
        self._session.execute(query.values(state=state, outcome=outcome, sent_at=sent, next_at=due))

    def give_up_unclear(self, now: float, outcome: str) -> None:
        """Those whose sender ended while it sent them: nobody can tell whether they arrived."""
        query = update(tables.Alert).where(tables.Alert.state == "sending", tables.Alert.next_at < now)
        self._session.execute(query.values(state="unclear", outcome=outcome, next_at=None))

    def has_unclear(self, now: float) -> bool:
        """Whether there are any."""
        query = select(tables.Alert.id).where(tables.Alert.state == "sending", tables.Alert.next_at < now)
        return self._session.scalar(query.limit(1)) is not None

    def forget(self, before: float) -> None:
        """Remove what is old."""
        self._session.execute(delete(tables.Alert).where(tables.Alert.created_at < before))


def _of(user_id: str | None) -> ColumnElement[bool]:
    owner = tables.AlertRule.user_id
    return owner.is_(None) if user_id is None else owner == user_id
