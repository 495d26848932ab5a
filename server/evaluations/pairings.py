"""What need not be queued to know that it can't be measured: a policy on a frozen suite for another robot."""

from collections.abc import Sequence

from server.errors import InvalidRequestError
from server.evaluations.subjects import Measured
from sim.errors import SuiteError
from sim.frozen import suite_names
from sim.suite_rules import frozen_rules
from workers.job_protocol import NamedSuite, SuiteChoice


def refuse_impossible(subjects: Sequence[Measured], choices: Sequence[SuiteChoice]) -> None:
    """Whether the rules of the frozen suites let every one of the policies drive there.

    Raises:
        InvalidRequestError: some do not; it says of which policy, and why.
    """
    names = [choice.name for choice in choices if isinstance(choice, NamedSuite) and choice.name in suite_names()]
    refused = [
        f"{subject.title}: {reason}."
        for name in names
        for subject in subjects
        if (reason := _reason(name, subject)) is not None
    ]
    if refused:
        more = f" {len(refused) - 1} more of these pairs can't be measured either." if len(refused) > 1 else ""
        raise InvalidRequestError(refused[0] + more)


def _reason(suite: str, subject: Measured) -> str | None:
    if subject.task is None:
        return None
    try:
        frozen_rules(suite).check(suite, subject.task)
    except SuiteError as error:
        return str(error)
    return None
