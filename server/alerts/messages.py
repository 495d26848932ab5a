"""What a webhook is sent, by the receiver's format, and how it is signed."""

import hashlib
import hmac
import json
from dataclasses import dataclass
from typing import Any

from server.database.tables import AlertEvent, AlertFormat

# Discord refuses more; the others take it.
_LONGEST = 1_900


@dataclass(frozen=True, slots=True)
class Letter:
    """An alert as its receiver is to read it.

    Attributes:
        id: of the alert; the same again means the same alert.
        event: what happened.
        at: when it was noticed, in seconds since the epoch.
        title: a line.
        text: sentences.
        url: of the page that shows more.
        project_id: where it happened, as the next two; null where it is about the installation.
        experiment_id: of the training.
        run_id: of the run, where it is about one.
    """

    id: int
    event: AlertEvent
    at: float
    title: str
    text: str
    url: str
    project_id: str | None
    experiment_id: str | None
    run_id: str | None


def body(letter: Letter, form: AlertFormat) -> bytes:
    """The JSON that a receiver of that format understands."""
    title, text, url = letter.title, _short(letter.text), letter.url
    content: dict[str, Any]
    match form:
        case "json":
            content = {name: getattr(letter, name) for name in Letter.__slots__}
        case "slack":
            content = {"text": f"*{_slack(title)}*\n{_slack(text)}\n<{url}|Open in Mapless>"}
        case "discord":
            # Names of trainings mention nobody.
            content = {"content": f"**{title}**\n{text}\n<{url}>", "allowed_mentions": {"parse": []}}
        case "teams":
            blocks = [
                {"type": "TextBlock", "text": title, "weight": "Bolder", "wrap": True},
                {"type": "TextBlock", "text": text, "wrap": True},
            ]
            card = {
                "type": "AdaptiveCard",
                "version": "1.4",
                "body": blocks,
                "actions": [{"type": "Action.OpenUrl", "title": "Open in Mapless", "url": url}],
            }
            attachment = {"contentType": "application/vnd.microsoft.card.adaptive", "content": card}
            content = {"type": "message", "attachments": [attachment]}
    return json.dumps(content).encode()


def signature(secret: str, at: int, content: bytes) -> str:
    """`t=SECONDS,v1=HEX`: HMAC-SHA256 with the rule's secret over the seconds, a full stop and the body."""
    signed = hmac.new(secret.encode(), f"{at}.".encode() + content, hashlib.sha256).hexdigest()
    return f"t={at},v1={signed}"


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def _slack(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
