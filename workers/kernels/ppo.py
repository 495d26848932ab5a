"""PPO's minibatches, one after the other, in one compiled call: the gradients of the losses, clipping, Adam.

`workers.algorithms.gradients.ppo` has the formulas, and the reference by autograd that a test compares this with.
"""

import math

import numpy as np

from workers.kernels.adam import clipped_step
from workers.kernels.networks import backward, forward
from workers.kernels.options import kernel

LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)
_ONE, _TWO = np.float32(1.0), np.float32(2.0)

STATISTICS = 4
"""Numbers that are added up: policy loss, value loss, estimate of KL(old, new), clipped fraction."""

ACTOR, CRITIC, BOTH = 1, 2, 3
"""Whose gradients: they share nothing, so two threads may take one each."""


@kernel(allocates=True)
def learn(
    actor, critic, whose, samples, rows, ends, at_once, log_std, log_std_range, lows, clip_range, entropy_coefficient,
    grad_log_std, steps, statistics,
):  # fmt: skip
    """`differentiate` and a step of Adam for each minibatch, for both networks or for one.

    Args:
        actor: see `differentiate`; the critic's parameters lie behind it in the same vectors.
        critic: likewise.
        whose: likewise.
        samples: likewise.
        rows: (n,) rows of the samples, the minibatches one after the other.
        ends: (m,) of each minibatch in `rows`.
        at_once: see `differentiate`.
        log_std: (A,), parameters of the actor.
        log_std_range: its lowest and highest values.
        lows: see `differentiate`.
        clip_range: likewise.
        entropy_coefficient: what the entropy counts in the actor's loss.
        grad_log_std: (A,), the gradient of `log_std`.
        steps: `AdamSteps`, m of them.
        statistics: (4,) float64, added to: `STATISTICS`, sums over the minibatches.
    """
    low, high = np.float32(log_std_range[0]), np.float32(log_std_range[1])
    first = 0
    for step in range(ends.shape[0]):
        found, grad_sum = np.zeros(STATISTICS), np.full(lows.shape[0], -entropy_coefficient)
        minibatch = rows[first : ends[step]]
        differentiate(actor, critic, whose, samples, minibatch, at_once, log_std, lows, clip_range, grad_sum, found)
        if whose & ACTOR:
            for k in range(lows.shape[0]):
                grad_log_std[k] = grad_sum[k]
            clipped_step(actor.values, actor.gradients, steps, 0, step)
            # What is not a number stays none.
            for k in range(lows.shape[0]):
                if log_std[k] < low:
                    log_std[k] = low
                elif log_std[k] > high:
                    log_std[k] = high
        if whose & CRITIC:
            clipped_step(critic.values, critic.gradients, steps, 1, step)
        for number in range(STATISTICS):
            statistics[number] += found[number]
        first = ends[step]


@kernel(allocates=True)
def differentiate(actor, critic, whose, samples, minibatch, at_once, log_std, lows, clip_range, grad_log_std, statistics):
    """Overwrite the gradients of both networks' parameters, or of one's.

    Some rows at a time are gathered, and go through both networks forward and backward while a core's cache holds them.

    Args:
        actor: `workers.kernels.networks.Passes`.
        critic: likewise.
        whose: `ACTOR`, `CRITIC` or `BOTH`; of another one nothing is read or written.
        samples: the arrays of `workers.algorithms.storage.rollout.Samples`, in their order.
        minibatch: (n,) rows of the samples.
        at_once: rows, at most as many as both networks have buffers for.
        log_std: (A,).
        lows: (A,) lowest of each component of an action, see `differentiate_policy_loss`.
        clip_range: how far the ratio may go from 1.
        grad_log_std: (A,) float64, added to: derivative of the loss by the log deviations.
        statistics: (4,) float64, added to: `STATISTICS`.
    """
    all_observations, all_critic_observations, all_actions, all_log_probs, all_advantages, all_returns = samples
    critic_is_told = all_critic_observations.shape[1] > all_observations.shape[1]
    size = minibatch.shape[0]
    share = 1.0 / size
    grad_logits, grad_values = np.empty((at_once, lows.shape[0]), np.float32), np.empty((at_once, 1), np.float32)
    for first in range(0, size, at_once):
        some = minibatch[first : first + at_once]
        rows, again = some.shape[0], first > 0
        observations = all_observations[some]
        if whose & ACTOR:
            logits = forward(actor, observations, again)
            differentiate_policy_loss(
                logits, all_actions[some], all_log_probs[some], all_advantages[some], log_std, lows, clip_range,
                share, grad_logits, grad_log_std, statistics,
            )  # fmt: skip
            backward(actor, observations, grad_logits[:rows], again)
        if whose & CRITIC:
            if critic_is_told:
                observations = all_critic_observations[some]
            values = forward(critic, observations, again)
            differentiate_value_loss(values, all_returns[some], share, grad_values, statistics)
            backward(critic, observations, grad_values[:rows], again)


@kernel(allocates=True)
def differentiate_policy_loss(
    logits, actions, log_probs, advantages, log_std, lows, clip_range, share, grad_logits, grad_log_std, statistics
):
    """The clipped surrogate (Schulman et al. 2017, Eq. 7) of some of a minibatch's samples.

    Args:
        logits: (n, A) the actor's network's outputs, before they are squashed.
        actions: (n, A) as sampled.
        log_probs: (n,) under the policy that sampled them.
        advantages: (n,).
        log_std: (A,).
        lows: (A,) lowest of each component's range, whose highest is 1: a tanh makes those from -1, a sigmoid all others.
        clip_range: how far the ratio may go from 1.
        share: what a sample counts: one over the minibatch's size.
        grad_logits: (n or more, A), written: derivative of the loss by the logits.
        grad_log_std: (A,) float64, added to: derivative of the loss by the log deviations.
        statistics: (4,) float64, added to: all of `STATISTICS` but the value loss.
    """
    rows, size = logits.shape
    weight = np.float32(share)
    low, high = np.float32(1.0 - clip_range), np.float32(1.0 + clip_range)
    inverse, noise, rising, falling = np.empty((4, size), np.float32)
    sums = np.zeros(size)
    constant = np.float32(0.0)
    for k in range(size):
        inverse[k] = math.exp(-log_std[k])
        constant += log_std[k]
    constant += np.float32(size * LOG_SQRT_2PI)
    loss = kl = clips = 0.0
    for i in range(rows):
        squares = np.float32(0.0)
        for k in range(size):
            span = _ONE - lows[k]
            if span == _TWO:
                mean = math.tanh(logits[i, k])
                rising[k], falling[k] = _ONE, _ONE - mean * mean
            else:
                sigmoid = _ONE / (_ONE + math.exp(-logits[i, k]))
                mean = lows[k] + span * sigmoid
                rising[k], falling[k] = span * sigmoid, _ONE - sigmoid
            noise[k] = (actions[i, k] - mean) * inverse[k]
            squares += noise[k] * noise[k]
        log_ratio = np.float32(-0.5) * squares - constant - log_probs[i]
        ratio = math.exp(log_ratio)
        clipped = min(max(ratio, low), high)
        surrogate = ratio * advantages[i]
        clipped_surrogate = clipped * advantages[i]
        # min(r A, clip(r) A) is r A, whose derivative by log r is r A, unless clip(r) A is smaller: then it is constant.
        grad_log_prob = np.float32(0.0) if clipped_surrogate < surrogate else -weight * surrogate
        for k in range(size):
            sums[k] += grad_log_prob * (noise[k] * noise[k] - _ONE)
            # d log p / d mean = noise / std; then through the tanh, 1 - t^2, or the sigmoid, s (1 - s) of its range.
            grad_logits[i, k] = grad_log_prob * noise[k] * inverse[k] * rising[k] * falling[k]
        loss -= min(surrogate, clipped_surrogate)
        kl += ratio - _ONE - log_ratio
        clips += ratio != clipped
    for k in range(size):
        grad_log_std[k] += sums[k]
    statistics[0] += share * loss
    statistics[2] += share * kl
    statistics[3] += share * clips


@kernel()
def differentiate_value_loss(values, returns, share, grad_values, statistics):
    """The squared error of Eq. 9 of some of a minibatch's samples.

    Args:
        values: (n, 1) the critic's outputs.
        returns: (n,) its targets.
        share: what a sample counts: one over the minibatch's size.
        grad_values: (n or more, 1), written: derivative of the loss by the values.
        statistics: (4,) float64, added to: the value loss.
    """
    scale = _TWO * np.float32(share)
    loss = 0.0
    for i in range(values.shape[0]):
        error = values[i, 0] - returns[i]
        grad_values[i, 0] = scale * error
        loss += error * error
    statistics[1] += share * loss
