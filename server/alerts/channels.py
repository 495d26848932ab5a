"""The two ways out of the house: a webhook and mail."""

import asyncio
import smtplib
import ssl
import time
from email.message import EmailMessage
from email.utils import formatdate
from functools import cached_property

import httpx

from server.alerts.addresses import RefusedAddressError, check_url, look_up, port_of
from server.alerts.messages import Letter, body, signature
from server.database.tables import AlertFormat
from server.lanes import Lane
from server.settings import Settings
from sim.errors import MaplessError

# A receiver that has not answered by then is tried again later.
SECONDS = 15.0
# Answers after which the same message may be taken the next time.
_LATER = frozenset({408, 425, 429})
_LONGEST_WAIT = 3_600.0


class UndeliveredError(MaplessError):
    """It did not arrive.

    Args:
        why: in a sentence.
        final: whether trying again would change nothing.
        after: seconds that the receiver asks to wait.
    """

    def __init__(self, why: str, *, final: bool = False, after: float = 0.0) -> None:
        super().__init__(why)
        self.why = why
        self.final = final
        self.after = after


class Webhooks:
    """Posts letters. Used on the event loop, where a receiver that dawdles costs nothing; names are looked up on a lane.

    Args:
        settings: whether private addresses may be posted to.
        lane: of alerts.
    """

    def __init__(self, settings: Settings, lane: Lane) -> None:
        self._private = settings.alerts_private_addresses
        self._lane = lane

    async def post(self, letter: Letter, url: str, form: AlertFormat, secret: str) -> None:
        """Deliver a letter.

        Raises:
            UndeliveredError: it was not taken.
        """
        content, at = body(letter, form), int(time.time())
        try:
            async with asyncio.timeout(SECONDS):
                status, after = await self._post(
                    url,
                    content,
                    {
                        "Content-Type": "application/json",
                        "User-Agent": "Mapless",
                        "Mapless-Alert": str(letter.id),
                        "Mapless-Signature": signature(secret, at, content),
                    },
                )
        except RefusedAddressError as error:
            raise UndeliveredError(str(error), final=True) from error
        except TimeoutError:
            raise UndeliveredError(f"No answer within {SECONDS:g} s.") from None
        except (OSError, httpx.HTTPError) as error:
            raise UndeliveredError(f"Not reached: {error or type(error).__name__}") from error
        if not 200 <= status < 300:
            final = 300 <= status < 500 and status not in _LATER
            raise UndeliveredError(f"Refused with status {status}.", final=final, after=after)

    async def close(self) -> None:
        """Let go of the connections."""
        if "_client" in vars(self):
            await self._client.aclose()

    @cached_property
    def _client(self) -> httpx.AsyncClient:
        """Made when first needed: reading what it trusts is a fifth of the server's start, and few servers send anything.

        No proxy: it would look the name up once more. No connection is kept: it is one host's, and looked up by address.
        """
        return httpx.AsyncClient(
            trust_env=False, timeout=SECONDS, follow_redirects=False, limits=httpx.Limits(max_keepalive_connections=0)
        )

    async def _post(self, url: str, content: bytes, headers: dict[str, str]) -> tuple[int, float]:
        parts = check_url(url)
        address = await self._lane.run(lambda: look_up(parts, private=self._private))
        bracketed = f"[{address}]" if ":" in address else address
        target = httpx.URL(url).copy_with(host=address, port=port_of(parts))
        host = parts.netloc if parts.port else parts.hostname or bracketed
        request = self._client.build_request(
            "POST",
            target,
            content=content,
            headers=headers | {"Host": host},
            extensions={"sni_hostname": parts.hostname, "timeout": httpx.Timeout(SECONDS).as_dict()},
        )
        # The answer's body is nobody's business, and may have no end.
        response = await self._client.send(request, stream=True)
        await response.aclose()
        return response.status_code, _seconds(response.headers.get("retry-after"))


def send_mail(letter: Letter, recipient: str, settings: Settings) -> None:
    """Deliver a letter by mail; blocks.

    Raises:
        UndeliveredError: it was not taken.
    """
    host = settings.smtp_host
    if host is None:
        raise UndeliveredError("No mail server is set: MAPLESS_SMTP_HOST.", final=True)
    message = EmailMessage()
    message["Subject"] = letter.title
    message["From"] = settings.smtp_from or f"mapless@{host}"
    message["To"] = recipient
    message["Date"] = formatdate(letter.at)
    # The same again is the same mail.
    message["Message-ID"] = f"<alert-{letter.id}-{int(letter.at)}@mapless>"
    message["Auto-Submitted"] = "auto-generated"
    message.set_content(f"{letter.text}\n\n{letter.url}\n")
    try:
        with _connect(settings, host) as server:
            if settings.smtp_user is not None:
                password = settings.smtp_password
                server.login(settings.smtp_user, password.get_secret_value() if password else "")
            server.send_message(message)
    except smtplib.SMTPResponseException as error:
        why = f"Refused with {error.smtp_code}: {_text(error.smtp_error)}"
        raise UndeliveredError(why, final=error.smtp_code >= 500) from error
    except smtplib.SMTPRecipientsRefused as error:
        code, answer = next(iter(error.recipients.values()))
        raise UndeliveredError(f"{recipient} was refused with {code}: {_text(answer)}", final=code >= 500) from error
    except (OSError, smtplib.SMTPException) as error:
        raise UndeliveredError(f"The mail server was not reached: {error}") from error


def _connect(settings: Settings, host: str) -> smtplib.SMTP:
    if settings.smtp_security == "tls":
        return smtplib.SMTP_SSL(host, settings.smtp_port, timeout=SECONDS, context=ssl.create_default_context())
    server = smtplib.SMTP(host, settings.smtp_port, timeout=SECONDS)
    if settings.smtp_security == "starttls":
        try:
            server.starttls(context=ssl.create_default_context())
        except BaseException:
            server.close()
            raise
    return server


def _seconds(retry_after: str | None) -> float:
    return min(float(retry_after), _LONGEST_WAIT) if retry_after is not None and retry_after.isdecimal() else 0.0


def _text(answer: bytes | str) -> str:
    return answer.decode(errors="replace") if isinstance(answer, bytes) else answer
