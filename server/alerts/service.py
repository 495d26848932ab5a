"""What a person may do with alerts: keep rules, try them, and read what they have said."""

import secrets
import time

from server.alerts import happenings
from server.alerts.addresses import RefusedAddressError, check_url, is_public, literal
from server.alerts.repository import AlertRepository, Said
from server.alerts.schemas import (
    MAX_RULES,
    Alert,
    AlertChannels,
    AlertNews,
    AlertPage,
    AlertRule,
    AlertRuleCreate,
    AlertRuleEdit,
    AlertRulePage,
    NewAlertRule,
)
from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, ForbiddenError, RefusedFieldError
from server.http.paging import Window
from server.ids import new_id
from server.people.repository import PeopleRepository
from server.projects.repository import ProjectRepository
from server.security.principal import Principal
from server.services import Services

_SECRET_BYTES = 24
_NEWS = 20
# A receiver is not to be flooded by a button.
_TEST_SECONDS = 10.0
_TARGET = ("body", "target")


class AlertService:
    """Keeps one person's rules; every method is about those of who asks."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def channels(self, principal: Principal) -> AlertChannels:
        """How alerts can be sent to who asks."""
        return AlertChannels(
            mail=self._services.settings.smtp_host is not None,
            own_address=None if principal.administrates else self._own_address(principal),
            chooses_address=principal.administrates,
        )

    def rules(self, principal: Principal, window: Window) -> AlertRulePage:
        """Some of the rules, the oldest first."""
        with self._services.database.read() as session:
            found, total = AlertRepository(session).rules(principal.user_id, window)
        return AlertRulePage(items=[_rule(rule, name) for rule, name in found], total=total)

    def add(self, principal: Principal, wanted: AlertRuleCreate) -> NewAlertRule:
        """Add a rule.

        Raises:
            RefusedFieldError: nothing can be sent there.
            NotFoundError: the project may not be seen.
            ForbiddenError: the disk is an administrator's matter.
            ConflictError: there are too many already.
        """
        if wanted.project_id is not None:
            principal.require("viewer", wanted.project_id)
        if wanted.event == "disk" and not principal.administrates:
            raise ForbiddenError("The server's disk is the matter of its administrators.")
        self._check_target(principal, wanted)
        rule = tables.AlertRule(
            id=new_id(),
            user_id=principal.user_id,
            project_id=wanted.project_id,
            event=wanted.event,
            threshold=wanted.threshold,
            channel=wanted.channel,
            target=wanted.target,
            format=wanted.format,
            secret=secrets.token_hex(_SECRET_BYTES) if wanted.channel == "webhook" else None,
            enabled=True,
            created_at=time.time(),
        )
        with self._services.database.write() as session:
            repository = AlertRepository(session)
            if repository.count(principal.user_id) >= MAX_RULES:
                raise ConflictError(f"You have {MAX_RULES} rules already: delete some first.")
            name = ProjectRepository(session).get(rule.project_id).name if rule.project_id is not None else None
            repository.add(rule)
            # Addresses of webhooks are secrets themselves.
            AuditRepository(session).add(
                "alert_rule.made", target=rule.id, name=rule.event, project_id=rule.project_id, details=rule.channel
            )
        return NewAlertRule(**_rule(rule, name).model_dump(), secret=rule.secret)

    def edit(self, principal: Principal, rule_id: str, wanted: AlertRuleEdit) -> AlertRule:
        """Switch a rule on or off.

        Raises:
            NotFoundError: one has no such rule.
        """
        with self._services.database.write() as session:
            rule = AlertRepository(session).rule(principal.user_id, rule_id)
            rule.enabled = wanted.enabled
            name = ProjectRepository(session).get(rule.project_id).name if rule.project_id is not None else None
        return _rule(rule, name)

    def delete(self, principal: Principal, rule_id: str) -> None:
        """Delete a rule, and what it has said.

        Raises:
            NotFoundError: one has no such rule.
        """
        with self._services.database.write() as session:
            repository = AlertRepository(session)
            rule = repository.rule(principal.user_id, rule_id)
            AuditRepository(session).add("alert_rule.deleted", target=rule.id, name=rule.event, project_id=rule.project_id)
            repository.remove(rule)

    def test(self, principal: Principal, rule_id: str) -> None:
        """Let a rule say something; what comes of it is on the list.

        Raises:
            NotFoundError: one has no such rule.
            ConflictError: it was tried a moment ago.
        """
        now = time.time()
        with self._services.database.write() as session:
            repository = AlertRepository(session)
            rule = repository.rule(principal.user_id, rule_id)
            # One key for so many seconds: who presses twice is told once.
            said = Said(rule, happenings.tried(rule.event, f"{now // _TEST_SECONDS:.0f}"))
            if not repository.say(said, said.happening.words(), now):
                raise ConflictError("This rule was tried a moment ago: see the list below.")

    def alerts(self, principal: Principal, window: Window) -> AlertPage:
        """Some of what the rules have said, the newest first."""
        with self._services.database.read() as session:
            found, total = AlertRepository(session).alerts(principal.user_id, window)
        return AlertPage(items=[_alert(alert, rule) for alert, rule in found], total=total)

    def news(self, principal: Principal, after: int | None) -> AlertNews:
        """What the browser is to show after it showed alert `after`; None for one that asks for the first time."""
        with self._services.database.read() as session:
            repository = AlertRepository(session)
            newest = repository.newest(principal.user_id)
            found = [] if after is None or after >= newest else repository.news(principal.user_id, after, _NEWS)
        return AlertNews(items=[_alert(alert, rule) for alert, rule in reversed(found)], newest=newest)

    def _check_target(self, principal: Principal, wanted: AlertRuleCreate) -> None:
        if wanted.channel == "webhook":
            try:
                address = literal(check_url(wanted.target or "").hostname or "")
            except RefusedAddressError as error:  # the schema has looked at it
                raise RefusedFieldError(_TARGET, str(error)) from error
            if address is not None and not is_public(address) and not self._services.settings.alerts_private_addresses:
                raise RefusedFieldError(
                    _TARGET, "This address is in a private network: MAPLESS_ALERTS_PRIVATE_ADDRESSES=true would allow it."
                )
        if wanted.channel == "mail":
            if self._services.settings.smtp_host is None:
                raise RefusedFieldError(_TARGET, "This server sends no mail: its administrator can set MAPLESS_SMTP_HOST.")
            own = self._own_address(principal)
            if not principal.administrates and (wanted.target or "").lower() != (own or "").lower():
                raise RefusedFieldError(_TARGET, f"Mail goes to your own address: {own or 'your account has none'}.")

    def _own_address(self, principal: Principal) -> str | None:
        if principal.user_id is None:
            return None
        with self._services.database.read() as session:
            return PeopleRepository(session).get(principal.user_id).email


def _rule(rule: tables.AlertRule, project: str | None) -> AlertRule:
    return AlertRule(
        id=rule.id,
        event=rule.event,
        project_id=rule.project_id,
        project=project,
        threshold=rule.threshold,
        channel=rule.channel,
        target=rule.target,
        format=rule.format,
        enabled=rule.enabled,
        created_at=rule.created_at,
    )


def _alert(alert: tables.Alert, rule: tables.AlertRule) -> Alert:
    return Alert(
        id=alert.id,
        rule_id=rule.id,
        event=rule.event,
        channel=rule.channel,
        target=rule.target,
        created_at=alert.created_at,
        title=alert.title,
        text=alert.text,
        experiment_id=alert.experiment_id,
        run_id=alert.run_id,
        state=alert.state,
        tries=alert.tries,
        next_at=alert.next_at if alert.state == "waiting" else None,
        sent_at=alert.sent_at,
        outcome=alert.outcome,
    )
