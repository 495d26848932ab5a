"""Rules about the learner: its numbers, what it sees, its policy's and its critic's losses."""

import numpy as np

from sim.config import FormulaTerm
from sim.extending.parts import RewardTerm as AddedTerm
from sim.observations import observation_size
from workers.config import OffPolicyConfig, TrainingConfig
from workers.diagnoses.history import MIN_POINTS, History
from workers.diagnoses.model import Diagnosis, Evidence, Rule
from workers.wording import counted, percent

# A third of the numbers: the whole scan of 10 batches is more, a velocity that has settled is one.
_CONSTANT = 1 / 3

# Healthy updates stay below 0.02; the clip range of 0.2 allows about 0.05. After one of 0.5 the policy is another one.
_KL = 0.1
_KL_LEAP = 0.5

# Deviations of 0.03 of an action's unit: the robot tries nothing new any more.
_ENTROPY = -4.0
_ARRIVES = 0.9

# A critic that explains less than nothing, and whose loss has grown this much since it was best.
_EXPLAINED_VARIANCE = -0.5
_LOSS_GROWTH = 5.0

# Rewards per step of a growing factor 2^(d_before / d_after) are cut at 2^8 by the simulator.
_ADVANCED_FACTOR = 256.0


def not_finite(history: History) -> Diagnosis | None:
    """The weights, or what they are learned from, are no longer numbers."""
    broken = [name for name, series in history.series.items() if len(series.values) and not np.isfinite(series.values[-1])]
    finite = history.series.get("policy/finite")
    failed = finite is not None and len(finite.values) > 0 and finite.values[-1] == 0.0
    if not (broken or failed):
        return None
    evidence = tuple(Evidence(metric=name, value=None, expected="a finite number") for name in sorted(broken))
    if failed:
        evidence = (Evidence(metric="policy/finite", value=0.0, expected="1: every weight is a number"), *evidence)
    return Diagnosis(
        id="not_finite",
        severity="error",
        title="Weights or losses are not numbers (NaN)",
        explanation=(
            "The training has computed infinite or undefined numbers and can't recover. Its state of a few seconds before "
            "is the run's last checkpoint: resuming that one repeats the failure bit for bit."
        ),
        evidence=evidence,
        advice=(
            f"Lower the learning rate ({_learning_rate(history.training)}) or the gradient clipping.",
            "Check the reward's coefficients: squares of numbers beyond 1e18 overflow.",
            "To see it happen, download the last checkpoint and run `mapless train --resume` on it.",
        ),
        step=history.step,
    )


def constant_observations(history: History) -> Diagnosis | None:
    """Much of the observation never changes."""
    constant = history.recent("observation/constant")
    if constant is None or constant < _CONSTANT:
        return None
    numbers = observation_size(history.training.task)
    return Diagnosis(
        id="constant_observations",
        severity="error",
        title="Observations are constant",
        explanation=(
            f"About {round(constant * numbers)} of {numbers} numbers of the observation are the same for all robots: "
            "the policy is blind in them."
        ),
        evidence=(Evidence(metric="observation/constant", value=constant, expected="0"),),
        advice=(
            f"Check the LiDAR's range ({history.training.task.lidar.range:g} m): a scan that reaches no wall is constant.",
            "Check that arenas, start poses and targets differ from attempt to attempt.",
        ),
        step=history.step,
    )


def kl_exploded(history: History) -> Diagnosis | None:
    """Updates change the policy by far more than the algorithm's trust region."""
    recent, all_updates = history.recent("policy/kl"), history.between("policy/kl", 0.0, 1.0)
    if recent is None:
        return None
    leapt = float(all_updates.max()) >= _KL_LEAP and history.success < _ARRIVES
    if recent < _KL and not leapt:
        return None
    kl = max(recent, float(all_updates.max())) if leapt else recent
    return Diagnosis(
        id="kl_exploded",
        severity="error",
        title="KL divergence exploded",
        explanation=f"An update changed the policy by a KL divergence of {kl:.2g}; clipping should keep it below 0.05.",
        evidence=(
            Evidence(metric="policy/kl", value=kl, expected="below 0.05"),
            *_if_known(history, "policy/clip_fraction", "below 0.3"),
        ),
        advice=(
            f"Lower the learning rate ({_learning_rate(history.training)}); 0.001 is the default.",
            "Use fewer epochs per rollout, or larger minibatches.",
        ),
        step=history.step,
    )


def value_diverges(history: History) -> Diagnosis | None:
    """The critic gets worse instead of better, or promises more than the task can pay."""
    return _critic_gets_worse(history) or _values_are_impossible(history)


def _critic_gets_worse(history: History) -> Diagnosis | None:
    explained, loss = history.recent("value/explained_variance"), history.recent("loss/value")
    before = history.between("loss/value", 0.0, 0.75)
    if explained is None or loss is None or len(before) < MIN_POINTS:
        return None
    best = float(before.min())
    if explained > _EXPLAINED_VARIANCE or loss < _LOSS_GROWTH * best:
        return None
    return _value_diagnosis(
        history,
        f"The critic explains less of the returns than a constant would; its loss is {counted(loss / max(best, 1e-12))} "
        "times its best.",
        (
            Evidence(metric="loss/value", value=loss, expected=f"falling; it was {best:.2g}"),
            Evidence(metric="value/explained_variance", value=explained, expected="above 0"),
        ),
    )


def _values_are_impossible(history: History) -> Diagnosis | None:
    value, largest = history.recent("value/mean"), largest_value(history.training)
    if value is None or largest is None or abs(value) <= largest:
        return None
    return _value_diagnosis(
        history,
        f"The critic promises a return of {value:.2g}, where no policy can have more than {largest:.2g}.",
        (Evidence(metric="value/mean", value=value, expected=f"between -{largest:.2g} and {largest:.2g}"),),
    )


def _value_diagnosis(history: History, explanation: str, evidence: tuple[Evidence, ...]) -> Diagnosis:
    return Diagnosis(
        id="value_diverges",
        severity="error",
        title="Value loss diverges",
        explanation=explanation,
        evidence=evidence,
        advice=(
            f"Lower the learning rate ({_learning_rate(history.training)}) of the critic.",
            "Scale rewards down, or switch return scaling on.",
            "Move target networks more slowly (tau), or lower the discount.",
        ),
        step=history.step,
    )


def largest_value(training: TrainingConfig) -> float | None:
    """Largest size that a discounted return of off-policy learning can have, in scaled rewards; None for others.

    The largest reward of a step, at every step for ever: r / (1 - gamma). None, too, where a formula of one's own may be of
    any size.
    """
    algorithm, task = training.algorithm, training.task
    if not isinstance(algorithm, OffPolicyConfig):
        return None
    robot, terms = task.robot, {term.name: term for term in task.reward.terms}
    if any(isinstance(term, FormulaTerm | AddedTerm) for term in task.reward.terms):
        return None
    at_end = max(abs(task.reward.weight(name)) for name in ("arrival", "collision", "timeout"))
    on_the_way = {
        "progress": robot.max_linear_speed * task.control_period,
        "time": task.control_period,
        "smoothness": 5.0,  # from full stop to full speed, and from one full turn to the other
        "speed": robot.max_linear_speed,
    }
    largest = sum(
        abs(term.weight) * on_the_way.get(name, 1.0) * (_ADVANCED_FACTOR if getattr(term, "exponential", False) else 1.0)
        for name, term in terms.items()
        if name not in ("arrival", "collision", "timeout")
    )
    largest = max(at_end, largest)
    return largest * algorithm.reward_scale / (1.0 - algorithm.gamma)


def entropy_collapsed(history: History) -> Diagnosis | None:
    """The policy has stopped exploring before it has learned."""
    entropy = history.recent("policy/entropy")
    if entropy is None or entropy > _ENTROPY or history.success >= _ARRIVES:
        return None
    return Diagnosis(
        id="entropy_collapsed",
        severity="warning",
        title="Entropy collapsed",
        explanation=(
            f"The policy's entropy is {entropy:.1f} nats: its actions hardly vary, at {percent(history.success, 0)} success."
        ),
        evidence=(
            Evidence(metric="policy/entropy", value=entropy, expected=f"above {_ENTROPY:g} until the robot arrives"),
            *_if_known(history, "policy/std_linear", "above 0.05"),
            *_if_known(history, "policy/std_angular", "above 0.05"),
        ),
        advice=(
            "Raise the entropy coefficient (PPO), for example to 0.01, or the target entropy (SAC).",
            "Start with larger deviations (initial std).",
            f"Lower the learning rate ({_learning_rate(history.training)}).",
        ),
        step=history.step,
    )


def _if_known(history: History, name: str, expected: str) -> tuple[Evidence, ...]:
    value = history.recent(name)
    return () if value is None else (Evidence(metric=name, value=value, expected=expected),)


def _learning_rate(training: TrainingConfig) -> str:
    algorithm = training.algorithm
    if isinstance(algorithm, OffPolicyConfig):
        return f"now {algorithm.actor_learning_rate:g} for the actor, {algorithm.critic_learning_rate:g} for the critic"
    rate = getattr(algorithm, "learning_rate", None)  # an algorithm of an extension may call it otherwise
    return "as it is now" if rate is None else f"now {rate:g}"


LEARNING_RULES: tuple[Rule, ...] = (not_finite, constant_observations, kl_exploded, value_diverges, entropy_collapsed)
