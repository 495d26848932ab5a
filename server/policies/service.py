"""What a person may do with the policies that ship: look, take away."""

import functools
import hashlib

from server.errors import NotFoundError
from server.estimates import success_estimate
from server.policies.schemas import PolicyEpisodes, ShippedPolicy, SuiteResult, SuiteRow
from workers.errors import UnknownPolicyError
from workers.shipped import library
from workers.shipped.figures import Figures


def find(name: str) -> library.ShippedPolicy:
    """The policy of that name.

    Raises:
        NotFoundError: there is none.
    """
    try:
        return library.shipped_policy(name)
    except UnknownPolicyError as error:
        raise NotFoundError.of("shipped policy", name) from error


@functools.cache
def shipped_hash(name: str) -> str:
    """SHA-256 of a shipped policy's archive.

    Raises:
        NotFoundError: there is no such policy.
    """
    return hashlib.sha256(find(name).archive.read_bytes()).hexdigest()


def view(policy: library.ShippedPolicy) -> ShippedPolicy:
    """A policy in JSON, with the baselines on its suites."""
    card = policy.card
    return ShippedPolicy(
        name=card.name,
        title=card.title,
        description=card.description,
        command=card.command,
        training=card.training,
        seed=card.seed,
        step=card.step,
        size=policy.archive.stat().st_size,
        results=[
            SuiteResult(
                suite=result.suite,
                suite_hash=result.suite_hash,
                policy=_row(card.title, result.figures, trained=True),
                baselines=[
                    _row(baseline.name, measured.figures, trained=False)
                    for baseline in library.baselines().baselines
                    for measured in baseline.results
                    if measured.suite_hash == result.suite_hash
                ],
            )
            for result in card.results
        ],
    )


def episodes(name: str, suite: str) -> PolicyEpisodes:
    """Every episode behind a policy's figures on a suite.

    Raises:
        NotFoundError: there is no such policy, or it was not measured on that suite.
    """
    policy = find(name)
    try:
        evaluation = policy.evaluation(suite)
    except UnknownPolicyError as error:
        raise NotFoundError(f"The policy {name} was not measured on {suite}.") from error
    return PolicyEpisodes(suite=evaluation.suite, suite_hash=evaluation.suite_hash, episodes=evaluation.episodes)


def _row(name: str, figures: Figures, *, trained: bool) -> SuiteRow:
    return SuiteRow(
        name=name,
        success=success_estimate([figures.arrivals], [figures.episodes], trained=trained),
        collision=figures.collision,
        timeout=figures.timeout,
        spl=figures.spl,
        steps=figures.steps,
    )
