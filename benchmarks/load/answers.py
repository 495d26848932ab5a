"""What the server itself says of how long its answers took, by route."""

import re
from collections import defaultdict
from dataclasses import dataclass, field

import httpx
from prometheus_client.parser import text_string_to_metric_families

from benchmarks.load.served import TOKEN

_PARAMETER = re.compile(r"\{[^}]*\}")


@dataclass(frozen=True)
class Answers:
    """Counts of answers, and the seconds until they began, by route; since the server has started, or in between."""

    counts: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))

    def __sub__(self, before: "Answers") -> "Answers":
        return Answers(
            {route: count - before.counts.get(route, 0.0) for route, count in self.counts.items()},
            {route: seconds - before.seconds.get(route, 0.0) for route, seconds in self.seconds.items()},
        )

    def milliseconds(self, route: str) -> float:
        """The mean of a route, its parameters written as `{id}`."""
        count = self.counts.get(route, 0.0)
        return round(1000.0 * self.seconds[route] / count, 1) if count else 0.0


def answered(url: str) -> Answers:
    """What the server has answered so far."""
    text = httpx.get(f"{url}/metrics", headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60.0).raise_for_status().text
    answers = Answers()
    for family in text_string_to_metric_families(text):
        if family.name != "mapless_request_seconds":
            continue
        for sample in family.samples:
            route = _PARAMETER.sub("{id}", sample.labels["route"])
            if sample.name.endswith("_count"):
                answers.counts[route] += sample.value
            elif sample.name.endswith("_sum"):
                answers.seconds[route] += sample.value
    return answers
