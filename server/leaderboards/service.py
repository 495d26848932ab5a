"""What a person may ask of leaderboards: which there are, and one of them."""

from collections.abc import Collection
from dataclasses import dataclass

from server.errors import NotFoundError
from server.estimates import success_estimate
from server.evaluations.schemas import EvaluationFigures
from server.leaderboards.repository import LeaderboardRepository
from server.leaderboards.schemas import Entry, EntryKind, Leaderboard, Leaderboards, ListedSuite
from server.services import Services
from sim.frozen import MEANINGS, suite_names
from workers.shipped.figures import Figures
from workers.shipped.library import SuiteFigures, baselines, shipped_policies
from workers.statistics.differences import LEAST_SEEDS, Rates, difference_of_rates, fisher_exact

_LEVEL = 0.05


@dataclass(frozen=True)
class Candidate:
    """Something that was measured: arrivals and episodes of each of its seeds."""

    kind: EntryKind
    id: str
    title: str
    arrivals: list[int]
    episodes: list[int]
    spl: float | None = None
    steps: float | None = None

    @property
    def rate(self) -> float:
        """Mean over its seeds, 0 to 1."""
        rates = [arrived / driven for arrived, driven in zip(self.arrivals, self.episodes, strict=True)]
        return sum(rates) / len(rates)


def boards(services: Services, visible: Collection[str] | None) -> Leaderboards:
    """Every suite on which something was measured that may be seen.

    Args:
        services: of the application.
        visible: projects that may be seen; None for all.
    """
    with services.database.read() as session:
        found = LeaderboardRepository(session, visible).suites()
    for result in _shipped():
        found[result.suite_hash] = (result.suite, found.get(result.suite_hash, ("", 0))[1] + 1)
    frozen = suite_names()
    listed = [
        ListedSuite(suite=name, suite_hash=key, entries=count, frozen=name in frozen) for key, (name, count) in found.items()
    ]
    return Leaderboards(suites=sorted(listed, key=lambda each: (each.suite, each.suite_hash)))


def board(services: Services, suite_hash: str, visible: Collection[str] | None) -> Leaderboard:
    """Everything that was measured on a suite, the best first.

    Args:
        services: of the application.
        suite_hash: of the suite.
        visible: projects that may be seen; None for all.

    Raises:
        NotFoundError: nothing was measured on such a suite.
    """
    candidates, names = _of_files(suite_hash)
    with services.database.read() as session:
        repository = LeaderboardRepository(session, visible)
        trainings, asked = repository.trainings(suite_hash), repository.evaluations(suite_hash)
        names += [row.suite for row in asked if row.suite]
        if not names:
            names += [name for key, (name, _) in repository.suites().items() if key == suite_hash]
    candidates += [Candidate("training", each.id, each.name, each.arrivals, each.episodes) for each in trainings]
    here = {(each.kind, each.id) for each in candidates}
    for row in asked:
        figures = EvaluationFigures.model_validate(row.figures)
        if (row.policy["source"], row.policy.get("name")) in here and row.policy.get("task") is None:
            continue
        arrivals = round(figures.success.value * figures.episodes)
        candidates.append(
            Candidate("evaluation", row.id, row.title, [arrivals], [figures.episodes], figures.spl, figures.steps)
        )
    if not candidates or not names:
        raise NotFoundError("Nothing was measured on this suite.")
    return ranked(names[0], suite_hash, candidates)


def ranked(suite: str, suite_hash: str, candidates: list[Candidate]) -> Leaderboard:
    """The candidates in their order, each held against the best.

    Args:
        suite: its name.
        suite_hash: of the suite.
        candidates: what was measured on it, at least one.
    """
    order = sorted(candidates, key=lambda each: (-each.rate, each.steps or float("inf"), each.title))
    best = order[0]
    rates = [each.rate for each in order]
    return Leaderboard(
        suite=suite,
        suite_hash=suite_hash,
        meaning=MEANINGS.get(suite),
        entries=[_entry(each, rates.index(each.rate) + 1, best) for each in order],
        comparisons=len(order) - 1,
    )


def _entry(candidate: Candidate, rank: int, best: Candidate) -> Entry:
    by_seeds = min(len(candidate.arrivals), len(best.arrivals)) >= LEAST_SEEDS
    if candidate is best:
        tied = True
    elif by_seeds:
        sides = [Rates(each.arrivals, each.episodes) for each in (best, candidate)]
        tied = difference_of_rates(*sides).low <= 0.0
    else:
        tied = fisher_exact(_pooled(best), _pooled(candidate)) >= _LEVEL
    return Entry(
        rank=rank,
        kind=candidate.kind,
        id=candidate.id,
        title=candidate.title,
        success=success_estimate(candidate.arrivals, candidate.episodes, trained=candidate.kind != "baseline"),
        spl=candidate.spl,
        steps=candidate.steps,
        tied=tied,
        told_by="best" if candidate is best else "seeds" if by_seeds else "episodes",
    )


def _pooled(candidate: Candidate) -> tuple[int, int]:
    """Arrivals and episodes of all its seeds together."""
    return sum(candidate.arrivals), sum(candidate.episodes)


def _shipped() -> list[SuiteFigures]:
    cards = [result for policy in shipped_policies() for result in policy.card.results]
    return cards + [result for baseline in baselines().baselines for result in baseline.results]


def _of_files(suite_hash: str) -> tuple[list[Candidate], list[str]]:
    """What ships with the project and was measured on a suite, and what the suite is called."""
    found, names = [], []
    for policy in shipped_policies():
        for result in policy.card.results:
            if result.suite_hash == suite_hash:
                found.append(_candidate("shipped", policy.card.name, policy.card.title, result.figures))
                names.append(result.suite)
    for baseline in baselines().baselines:
        for result in baseline.results:
            if result.suite_hash == suite_hash:
                found.append(_candidate("baseline", baseline.name, baseline.name, result.figures))
                names.append(result.suite)
    return found, names


def _candidate(kind: EntryKind, key: str, title: str, figures: Figures) -> Candidate:
    return Candidate(kind, key, title, [figures.arrivals], [figures.episodes], figures.spl, figures.steps)
