"""Rules about what the robot does. A robot that arrives may drive as it likes: they look only at those that do not."""

import numpy as np

from workers.diagnoses.history import MIN_POINTS, History
from workers.diagnoses.model import Diagnosis, Evidence, Rule
from workers.wording import counted, percent

# Uniform noise spins at 0.5 in the shortest window, a healthy policy at 0.2.
_SPIN = 0.6

# A healthy policy is at its limit in 5 to 15 % of its steps. One whose mean is there all the time shows it in half of them,
# because exploration takes every other command back inside.
_SATURATION = 0.4

# Where half of all attempts arrive, the robot does more than spin.
_ARRIVES = 0.5

# Before, even a healthy run seldom arrives.
_EARLY = 0.2

# Success that is still growing, or high enough for its task.
_STUCK_GAIN = 0.03
_STUCK_BELOW = 0.7
_STUCK_PROGRESS = 0.4


def spins(history: History) -> Diagnosis | None:
    """The robot turns one way all the time."""
    spin = history.recent("train/spin")
    if spin is None or spin < _SPIN or history.success >= _ARRIVES or history.progress < _EARLY:
        return None
    linear = history.recent("train/linear_speed")
    on_the_spot = linear is not None and linear < 0.2
    return Diagnosis(
        id="spins",
        severity="warning",
        title="The robot only spins",
        explanation=(
            f"Over the last quarter of the training the robots turned one way at {percent(spin, 0)} of their turning rate, "
            + ("on the spot." if on_the_spot else "in circles.")
        ),
        evidence=(
            Evidence(metric="train/spin", value=spin, expected="below 0.5"),
            *([Evidence(metric="train/linear_speed", value=linear, expected="above 0.3")] if linear is not None else []),
            Evidence(metric="train/success_rate", value=history.success, expected="rising"),
        ),
        advice=(
            "Make sure that driving pays: progress positive, and collisions that cost less than arrivals bring.",
            "Lower the learning rate, so that the turning output does not run into its limit early.",
            "Start with more exploration (initial std, or exploration noise).",
        ),
        step=history.step,
    )


def actions_saturate(history: History) -> Diagnosis | None:
    """The turning command sits at its limit, where the gradient of tanh vanishes."""
    saturation = history.recent("policy/saturation")
    if saturation is None or saturation < _SATURATION or history.success >= _ARRIVES:
        return None
    return Diagnosis(
        id="actions_saturate",
        severity="warning",
        title="Actions saturate",
        explanation=(
            f"{percent(saturation, 0)} of the turning commands are at their limit, whatever the robot sees; there tanh has "
            "no gradient left to learn from."
        ),
        evidence=(
            Evidence(metric="policy/saturation", value=saturation, expected="below 0.3"),
            Evidence(metric="train/success_rate", value=history.success, expected="rising"),
        ),
        advice=(
            "Raise the logit penalty (DDPG, TD3), for example to 0.001: it is what brings a saturated actor back.",
            "Lower the learning rate (of the actor) and start anew: without that penalty saturation seldom ends.",
            "Scale rewards down, or switch return scaling on.",
            "Use less exploration noise if it alone fills the range.",
        ),
        step=history.step,
    )


def reward_hacked(history: History) -> Diagnosis | None:
    """The return grows by more than an arrival is worth, and the robot arrives no more often."""
    if history.progress < _EARLY or history.success >= _ARRIVES:
        return None
    early, late = history.between("train/return", 0.0, 1 / 3), history.between("train/return", 2 / 3, 1.0)
    arrived, arrives = history.between("train/success_rate", 0.0, 1 / 3), history.between("train/success_rate", 2 / 3, 1.0)
    if min(map(len, (early, late, arrived, arrives))) < MIN_POINTS:
        return None
    rise, gain = float(np.median(late) - np.median(early)), float(arrives.mean() - arrived.mean())
    worth = max(
        abs(history.training.task.reward.weight("arrival")), float(np.std(early)), 0.2 * abs(float(np.median(early)))
    )
    if rise <= worth or gain > 0.02:
        return None
    return Diagnosis(
        id="reward_hacked",
        severity="warning",
        title="The reward is hacked",
        explanation=(
            f"The return of an episode rose by {counted(rise)} while success went from {percent(arrived.mean())} to "
            f"{percent(arrives.mean())}: the robot has found something that pays better than arriving."
        ),
        evidence=(
            Evidence(metric="train/return", value=float(np.median(late)), expected="rising together with success"),
            Evidence(metric="train/success_rate", value=float(arrives.mean()), expected="rising together with the return"),
        ),
        advice=(
            "Watch the robot live: what it does instead of arriving is what the reward pays for.",
            "Check the reward's signs and sizes: arrival above all, progress positive, collision negative.",
            "Make sure that time spent does not pay: no reward per step that an arrival would end.",
        ),
        step=history.step,
    )


def success_stuck(history: History) -> Diagnosis | None:
    """Success has stopped growing far below what the task allows."""
    name = "eval/success_rate"
    if len(history.between(name, 0.0, 1.0)) < 4:
        name = "train/success_rate"
    before, after = history.between(name, 0.0, 0.5), history.between(name, 0.5, 1.0)
    enough = 2 if name == "eval/success_rate" else MIN_POINTS
    if history.progress < _STUCK_PROGRESS or min(len(before), len(after)) < enough:
        return None
    # Attempts in training are few a report and noisy: compare means of the later halves, not single best ones.
    if name == "eval/success_rate":
        was, now = float(before.max()), float(after.max())
    else:
        was, now = float(before[len(before) // 2 :].mean()), float(after[len(after) // 2 :].mean())
    if now > was + _STUCK_GAIN or now >= _STUCK_BELOW:
        return None
    return Diagnosis(
        id="success_stuck",
        severity="warning",
        title="Success is stuck",
        explanation=(
            f"Success was {percent(was)} in the first half of the training so far and is {percent(now)} now, after "
            f"{percent(history.progress, 0)} of the steps."
        ),
        evidence=(Evidence(metric=name, value=now, expected="rising, or above 0.7"),),
        advice=(
            "Look at the other diagnoses first: a cause has priority over this symptom.",
            "Use the improved observation and the default recipe; train longer.",
            "Try another seed: one of several may be stuck where the others are not.",
            "Make the task easier first: fewer obstacles, a higher step limit.",
        ),
        step=history.step,
    )


BEHAVIOR_RULES: tuple[Rule, ...] = (actions_saturate, spins, reward_hacked, success_stuck)
