"""What the paper says of its methods, sentence by sentence, and how each is put to the test (pydantic only)."""

from typing import Literal

from sim.config import Frozen

Measure = Literal["success", "reward", "steps", "learned_at"]


class Claim(Frozen):
    """A statement of the paper.

    Attributes:
        id: stable name.
        statement: in our words.
        source: where the paper makes it.
        reading: what of our reading may explain a difference; None where nothing is known.
    """

    id: str
    statement: str
    source: str
    reading: str | None = None


class Comparison(Claim):
    """One row is better than another in one measure."""

    measure: Measure
    better: str
    worse: str


class Safety(Claim):
    """A row drives without collisions."""

    row: str


class Untested(Claim):
    """Neither the paper's figures nor this campaign's can tell; `reason` says why."""

    reason: str


AnyClaim = Comparison | Safety | Untested

_SIMPLE = "Results, simple environment"
_BASIC = "Results, complex environment with basic reward"
_ADVANCED = "Results, complex environment with advanced reward"

_VANILLA = (
    "The paper does not describe its vanilla PPO. Ours is the same PPO with two layers of 64 units, so that only the "
    "network differs; a weaker recipe would show a larger difference."
)
_STEPS = "A collision ends an episode early, so a method that collides more looks quicker by this measure."
_BUDGET = (
    "The paper gives no training steps. Ours get the same number each, and are compared by environment steps rather than by "
    "wall time."
)
_ADVANCED_REWARD = (
    "The paper explains the penalty of its advanced reward in two ways that contradict each other. We take the free "
    "distance ahead, and a coefficient of 5, which it does not give."
)

CLAIMS: tuple[AnyClaim, ...] = (
    Comparison(
        id="simple-success-vanilla",
        statement="In the simple arena ResBlock PPO arrives more often than vanilla PPO.",
        source=f"{_SIMPLE}, table 1",
        reading=_VANILLA,
        measure="success",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-vanilla-ppo",
    ),
    Comparison(
        id="simple-success-ddpg",
        statement="In the simple arena ResBlock PPO arrives more often than DDPG.",
        source=f"{_SIMPLE}, table 1",
        measure="success",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-ddpg",
    ),
    Comparison(
        id="simple-ranking-first",
        statement="In the simple arena ResBlock PPO is ahead of DDPG in average reward.",
        source=f"{_SIMPLE}, its ranking of the three",
        measure="reward",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-ddpg",
    ),
    Comparison(
        id="simple-ranking-second",
        statement="In the simple arena DDPG is ahead of vanilla PPO in average reward.",
        source=f"{_SIMPLE}, its ranking of the three",
        reading=_VANILLA,
        measure="reward",
        better="simple-basic-ddpg",
        worse="simple-basic-vanilla-ppo",
    ),
    Comparison(
        id="simple-faster-ddpg",
        statement="In the simple arena ResBlock PPO navigates faster than DDPG: fewer steps per episode.",
        source=f"{_SIMPLE}, table 1",
        measure="steps",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-ddpg",
    ),
    Comparison(
        id="simple-faster-vanilla",
        statement="In the simple arena ResBlock PPO navigates faster than vanilla PPO: fewer steps per episode.",
        source=f"{_SIMPLE}, table 1",
        reading=_VANILLA,
        measure="steps",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-vanilla-ppo",
    ),
    Comparison(
        id="simple-converges-ddpg",
        statement="In the simple arena ResBlock PPO converges more rapidly than DDPG.",
        source=f"{_SIMPLE}, figure of cumulative reward",
        reading=_BUDGET,
        measure="learned_at",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-ddpg",
    ),
    Comparison(
        id="simple-converges-vanilla",
        statement="In the simple arena ResBlock PPO converges more rapidly than vanilla PPO.",
        source=f"{_SIMPLE}, figure of cumulative reward",
        reading=_VANILLA,
        measure="learned_at",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-vanilla-ppo",
    ),
    Comparison(
        id="complex-success",
        statement="In the complex arena with the basic reward DDPG arrives more often than ResBlock PPO.",
        source=f"{_BASIC}, table 2",
        measure="success",
        better="complex-basic-ddpg",
        worse="complex-basic-resblock-ppo",
    ),
    Comparison(
        id="complex-reward",
        statement="In the complex arena with the basic reward DDPG is ahead of ResBlock PPO in average reward.",
        source=f"{_BASIC}, table 2 and figure of cumulative reward",
        measure="reward",
        better="complex-basic-ddpg",
        worse="complex-basic-resblock-ppo",
    ),
    Comparison(
        id="complex-slower",
        statement="In the complex arena with the basic reward DDPG is slower: ResBlock PPO needs fewer steps per episode.",
        source=f"{_BASIC}, table 2",
        reading=_STEPS,
        measure="steps",
        better="complex-basic-resblock-ppo",
        worse="complex-basic-ddpg",
    ),
    Comparison(
        id="advanced-success",
        statement="In the complex arena the advanced reward makes ResBlock PPO arrive more often.",
        source=f"{_ADVANCED}, table 3",
        reading=_ADVANCED_REWARD,
        measure="success",
        better="complex-advanced-resblock-ppo",
        worse="complex-basic-resblock-ppo",
    ),
    Comparison(
        id="advanced-still-below",
        statement="DDPG with the basic reward still arrives more often than ResBlock PPO with the advanced reward.",
        source=f"{_ADVANCED}, table 3",
        reading=_ADVANCED_REWARD,
        measure="success",
        better="complex-basic-ddpg",
        worse="complex-advanced-resblock-ppo",
    ),
    Comparison(
        id="advanced-faster",
        statement="DDPG is slower than ResBlock PPO with the advanced reward, which needs fewer steps per episode.",
        source=f"{_ADVANCED}, table 3",
        reading=_STEPS,
        measure="steps",
        better="complex-advanced-resblock-ppo",
        worse="complex-basic-ddpg",
    ),
    Safety(
        id="safe",
        statement="ResBlock PPO with the advanced reward avoids the obstacles of the complex arena.",
        source="Title, abstract and conclusion",
        reading=(
            "The paper counts successes only, not what ended the other episodes. A reading of less than 0.2 m counts as a "
            "collision, though the robot's radius is half of that."
        ),
        row="complex-advanced-resblock-ppo",
    ),
    Untested(
        id="stable",
        statement="ResBlocks make learning more stable, by keeping gradients from vanishing.",
        source="Model architecture",
        reason="the paper names no measure of stability, shows no gradients, and trains one seed",
    ),
    Untested(
        id="adapts",
        statement="ResBlock PPO adapts swiftly to changes of the environment.",
        source=_SIMPLE,
        reason="nothing changes in either of the paper's arenas, and each policy drives where it was trained",
    ),
    Untested(
        id="observation",
        statement="The comprehensive observation improves decisions.",
        source="Introduction, first contribution",
        reason="the paper trains every method on the same sixteen numbers and leaves none of them out",
    ),
)
