"""Why a sign-in with the provider may fail, and the words for it: an address carries the reason, never the words."""

from typing import Literal

from server.errors import ServiceError

Refusal = Literal[
    "stopped", "stale", "unreachable", "unusable", "not_allowed", "stranger", "closed", "link", "taken", "busy"
]

_WORDS: dict[Refusal, str] = {
    "stopped": "{provider} did not let you in, or you stopped there. Try again.",
    "stale": "This sign-in was begun in another browser or tab, or more than ten minutes ago. Try again.",
    "unreachable": "{provider} does not answer. Try again in a moment; the server's log says why.",
    "unusable": "The answer of {provider} could not be used. Whoever runs the server finds the reason in its log.",
    "not_allowed": "{provider} knows you, but people of your group or e-mail address are not let in here.",
    "stranger": "{provider} knows you, but you have no account here: whoever administrates a project can send you a link.",
    "closed": "Your account was closed.",
    "link": "The link that you came by has been used already, was withdrawn, or has ended: ask for a new one.",
    "taken": "That identity of {provider} belongs to another account already.",
    "busy": "Too many sign-ins failed from your address: wait a minute.",
}


class SignInRefusedError(ServiceError):
    """Somebody whom the provider sent back is not signed in.

    Args:
        reason: which the page that follows puts into words.
    """

    status = 401

    def __init__(self, reason: Refusal) -> None:
        super().__init__(reason)
        self.reason: Refusal = reason


class ProviderUnusableError(ServiceError):
    """The provider of identities can't be asked now."""

    status = 503
    come_again = 10.0


def in_words(reason: Refusal, provider: str) -> str:
    """What the page says."""
    said = _WORDS[reason].format(provider=provider)
    return said[0].upper() + said[1:]
