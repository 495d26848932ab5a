"""What a look at one part has found."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from server.errors import ServiceError

# A part that is slower does not work; looking at it must not hang.
_SECONDS = 10.0


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Attributes:
        name: of the part.
        ok: whether it does its work.
        found: what was seen.
        advice: what to do; None where nothing is.
    """

    name: str
    ok: bool
    found: str
    advice: str | None = None


class AilingError(ServiceError):
    """A part does not do its work.

    Args:
        found: what was seen.
        advice: what to do.
    """

    def __init__(self, found: str, advice: str) -> None:
        super().__init__(found)
        self.advice = advice


def look(name: str, check: Callable[[], str], advice: str, seconds: float = _SECONDS) -> Finding:
    """Run a check that says what it sees, for so many seconds at most.

    Args:
        name: of the part.
        check: raises where something is wrong.
        advice: what to do where `check` does not say so itself.
        seconds: after which the part counts as silent.
    """
    found: list[Finding] = []

    def run() -> None:
        try:
            found.append(Finding(name, True, check()))
        except AilingError as error:
            found.append(Finding(name, False, error.message, error.advice))
        except Exception as error:  # whatever a driver raises is what is wrong
            lines = str(error).strip().splitlines() or [type(error).__name__]
            found.append(Finding(name, False, lines[0], advice))

    # One that hangs must not keep the command from ending.
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    return found[0] if found else Finding(name, False, f"no answer within {seconds:g} s", advice)
