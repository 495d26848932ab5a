"""How busy a worker was: seconds of work in each six hours of the last week, as a row of `workers` keeps them."""

from collections.abc import Mapping

BLOCK_SECONDS = 6 * 3_600
BLOCKS = 7 * 86_400 // BLOCK_SECONDS


def with_work(activity: Mapping[str, float], moment: float, seconds: float) -> dict[str, float]:
    """What was kept of the week before a moment (since the epoch), with so many seconds more that ended at it."""
    now = int(moment // BLOCK_SECONDS)
    kept = {block: worked for block, worked in activity.items() if now - BLOCKS < int(block) <= now}
    kept[str(now)] = round(min(kept.get(str(now), 0.0) + seconds, BLOCK_SECONDS), 1)
    return kept


def strip(activity: Mapping[str, float], moment: float) -> list[float]:
    """The share of each six hours in which it worked, 0 to 1; the oldest first, the last one is under way."""
    now = int(moment // BLOCK_SECONDS)
    begun = max(moment - now * BLOCK_SECONDS, 1.0)
    lengths = [BLOCK_SECONDS] * (BLOCKS - 1) + [begun]
    blocks = range(now - BLOCKS + 1, now + 1)
    return [min(activity.get(str(block), 0.0) / length, 1.0) for block, length in zip(blocks, lengths, strict=True)]
