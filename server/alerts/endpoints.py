"""Routes of alerts: each is about the rules of who asks."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from server.alerts.schemas import (
    AlertChannels,
    AlertNews,
    AlertPage,
    AlertRule,
    AlertRuleCreate,
    AlertRuleEdit,
    AlertRulePage,
    NewAlertRule,
)
from server.alerts.service import AlertService
from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import OWN_ALERTS
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/alerts", tags=["alerts"])


async def _service(services: ServicesDep) -> AlertService:
    return AlertService(services)


AlertServiceDep = Annotated[AlertService, Depends(_service)]


@router.get("", dependencies=[OWN_ALERTS])
def list_alerts(service: AlertServiceDep, principal: PrincipalDep, window: WindowDep) -> AlertPage:
    """What one's rules have said, the newest first, and what came of it."""
    return service.alerts(principal, window)


@router.get("/news", dependencies=[OWN_ALERTS])
def list_alert_news(
    service: AlertServiceDep,
    principal: PrincipalDep,
    after: Annotated[
        int | None, Query(ge=0, le=2**31, description="What came after this alert; nothing if not given.")
    ] = None,
) -> AlertNews:
    """What the browser is to show."""
    return service.news(principal, after)


@router.get("/channels", dependencies=[OWN_ALERTS])
def get_alert_channels(service: AlertServiceDep, principal: PrincipalDep) -> AlertChannels:
    """How alerts can be sent from here."""
    return service.channels(principal)


@router.get("/rules", dependencies=[OWN_ALERTS])
def list_alert_rules(service: AlertServiceDep, principal: PrincipalDep, window: WindowDep) -> AlertRulePage:
    """One's rules, the oldest first."""
    return service.rules(principal, window)


@router.post("/rules", status_code=201, responses=NOT_FOUND | CONFLICT, dependencies=[OWN_ALERTS])
def make_alert_rule(rule: AlertRuleCreate, service: AlertServiceDep, principal: PrincipalDep) -> NewAlertRule:
    """Be told of something from now on."""
    return service.add(principal, rule)


@router.patch("/rules/{rule_id}", responses=NOT_FOUND, dependencies=[OWN_ALERTS])
def edit_alert_rule(rule_id: str, edit: AlertRuleEdit, service: AlertServiceDep, principal: PrincipalDep) -> AlertRule:
    """Switch a rule on or off."""
    return service.edit(principal, rule_id, edit)


@router.delete("/rules/{rule_id}", status_code=204, responses=NOT_FOUND, dependencies=[OWN_ALERTS])
def delete_alert_rule(rule_id: str, service: AlertServiceDep, principal: PrincipalDep) -> None:
    """Delete a rule with what it has said."""
    service.delete(principal, rule_id)


@router.post("/rules/{rule_id}/test", status_code=204, responses=NOT_FOUND | CONFLICT, dependencies=[OWN_ALERTS])
def test_alert_rule(rule_id: str, service: AlertServiceDep, principal: PrincipalDep) -> None:
    """Let a rule say something; what comes of it is on the list."""
    service.test(principal, rule_id)
