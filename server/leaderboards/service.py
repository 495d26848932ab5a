"""What a person may ask of leaderboards: which there are, and one of them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from server.errors import NotFoundError
from server.estimates import success_estimate
from server.leaderboards.asked import AskedTogether, together
from server.leaderboards.repository import LeaderboardRepository
from server.leaderboards.schemas import Entry, EntryKind, Leaderboard, Leaderboards, ListedSuite, ToldBy
from server.services import Services
from sim.frozen import MEANINGS, suite_names
from workers.shipped.figures import Figures
from workers.shipped.library import SuiteFigures, baselines, shipped_policies
from workers.statistics.differences import LEAST_SEEDS, Rates, fisher_exact
from workers.statistics.significance import holm, p_of_rates, p_of_seeds_and_policy

_LEVEL = 0.05

# By where a policy that was asked for comes from.
_KINDS: dict[str, EntryKind] = {
    "checkpoint": "evaluation",
    "shipped": "shipped",
    "baseline": "baseline",
    "uploaded": "uploaded",
}


@dataclass(frozen=True)
class Candidate:
    """Something that was measured: arrivals and episodes of each of its seeds, of what has none those of the only policy."""

    kind: EntryKind
    id: str
    title: str
    arrivals: list[int]
    episodes: list[int]
    spl: float | None = None
    steps: float | None = None
    experiment_id: str | None = None
    evaluations: tuple[str, ...] = ()

    @property
    def seeds(self) -> int:
        """Of how many policies it is."""
        return len(self.arrivals)

    @property
    def rates(self) -> Rates:
        """Seed by seed."""
        return Rates(self.arrivals, self.episodes)

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
        seeds = repository.seeds_of(asked)
        names += [row.suite for row in asked if row.suite]
        if not names:
            names += [name for key, (name, _) in repository.suites().items() if key == suite_hash]
    candidates += [
        Candidate("training", each.id, each.name, each.arrivals, each.episodes, each.spl, each.steps, each.id)
        for each in trainings
    ]
    here = {(each.kind, each.id) for each in candidates}
    asked = [
        row
        for row in asked
        if (row.policy["source"], row.policy.get("name")) not in here or row.policy.get("task") is not None
    ]
    candidates += [_asked(each) for each in together(asked, seeds)]
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
    told: list[tuple[ToldBy, float | None]] = [("best", None), *_told(best, order[1:])]
    return Leaderboard(
        suite=suite,
        suite_hash=suite_hash,
        meaning=MEANINGS.get(suite),
        entries=[_entry(each, rates.index(each.rate) + 1, *by) for each, by in zip(order, told, strict=True)],
        comparisons=sum(p is not None for _, p in told),
    )


def _told(best: Candidate, others: Sequence[Candidate]) -> list[tuple[ToldBy, float | None]]:
    """By what each is told from the best, and its p after all of these tests."""
    tests = [_test(best, each) for each in others]
    adjusted = iter(holm([p for _, p in tests if p is not None]))
    return [(by, None if p is None else next(adjusted)) for by, p in tests]


def _test(best: Candidate, other: Candidate) -> tuple[ToldBy, float | None]:
    """Episodes of several seeds are not independent: only of one very policy are they what is counted."""
    several = [each for each in (best, other) if each.seeds > 1]
    if not several:
        return "episodes", fisher_exact((best.arrivals[0], best.episodes[0]), (other.arrivals[0], other.episodes[0]))
    if min(each.seeds for each in several) < LEAST_SEEDS:
        return "nothing", None
    if len(several) == 2:
        return "seeds", p_of_rates(best.rates, other.rates)
    (alone,) = [each for each in (best, other) if each.seeds == 1]
    return "seeds", p_of_seeds_and_policy(several[0].rates, alone.arrivals[0], alone.episodes[0])


def _entry(candidate: Candidate, rank: int, told_by: ToldBy, p: float | None) -> Entry:
    return Entry(
        rank=rank,
        kind=candidate.kind,
        id=candidate.id,
        title=candidate.title,
        experiment_id=candidate.experiment_id,
        evaluations=list(candidate.evaluations),
        success=success_estimate(candidate.arrivals, candidate.episodes, trained=candidate.kind != "baseline"),
        spl=candidate.spl,
        steps=candidate.steps,
        tied=p is None or p >= _LEVEL,
        told_by=told_by,
        p=p,
    )


def _asked(found: AskedTogether) -> Candidate:
    return Candidate(
        _KINDS[found.rows[0].policy["source"]],
        found.rows[0].id,
        found.title,
        found.arrivals,
        found.episodes,
        found.spl,
        found.steps,
        found.training[0] if found.training else None,
        tuple(row.id for row in found.rows),
    )


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
