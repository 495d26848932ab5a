"""PPO's arithmetic by hand, and PPO on a problem whose answer is known."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from sim.engine.guidance import GUIDANCE_SIZE
from tests.heads import head
from workers.algorithms.gradients.ppo import AutogradPpo, WrittenPpo, entropy, log_prob
from workers.algorithms.ppo import Ppo, build_ppo, log_std_range
from workers.algorithms.storage.return_scaler import ReturnScaler
from workers.algorithms.storage.rollout import Samples, generalized_advantages
from workers.config import MlpNetwork, Network, PpoConfig, ResBlockNetwork
from workers.networks.compiled import ROWS_AT_ONCE
from workers.networks.modules import GaussianActor, build_network

F = np.float32
CPU = torch.device("cpu")


def column(*values: float) -> np.ndarray:
    return np.array(values, F)[:, None]


def test_advantages_by_hand() -> None:
    # gamma = 0.5, lambda = 0.5, one robot, three steps, no end:
    # delta_2 = 3 + 0.5 * 4 - 2 = 3                  A_2 = 3
    # delta_1 = 2 + 0.5 * 2 - 2 = 1                  A_1 = 1 + 0.25 * 3 = 1.75
    # delta_0 = 1 + 0.5 * 2 - 1 = 1                  A_0 = 1 + 0.25 * 1.75 = 1.4375
    advantages = generalized_advantages(column(1, 2, 3), column(1, 2, 2, 4), np.zeros((3, 1), np.bool_), 0.5, 0.5)
    assert advantages[:, 0].tolist() == [1.4375, 1.75, 3.0]


def test_the_limit_of_deviations_falls_over_the_second_half() -> None:
    """From e of the action's unit to 0.05: half way between, in the logarithm, after three quarters."""
    falls = PpoConfig(final_std=0.05)
    assert log_std_range(falls, 0.5) == (-4.0, 1.0)
    assert log_std_range(falls, 0.75)[1] == pytest.approx((1.0 + math.log(0.05)) / 2)
    assert log_std_range(falls, 1.0)[1] == pytest.approx(math.log(0.05))
    assert log_std_range(PpoConfig(), 1.0) == (-4.0, 1.0)


def test_nothing_flows_over_the_end_of_an_episode() -> None:
    # The same, ended in step 1:
    # A_2 = 3;  A_1 = delta_1 = 2 + 0 - 2 = 0;  A_0 = 1 + 0.5 * 2 - 1 + 0.25 * 0 = 1
    dones = np.array([[False], [True], [False]])
    advantages = generalized_advantages(column(1, 2, 3), column(1, 2, 2, 4), dones, 0.5, 0.5)
    assert advantages[:, 0].tolist() == [1.0, 0.0, 3.0]


@given(st.integers(0, 2**32 - 1))
def test_with_lambda_one_advantages_are_returns_less_values(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rewards, values = rng.normal(size=(6, 2)).astype(F), rng.normal(size=(7, 2)).astype(F)
    dones = rng.random((6, 2)) < 0.3
    returns = np.empty((6, 2))
    following = values[-1]
    for step in range(5, -1, -1):
        following = rewards[step] + 0.9 * np.where(dones[step], 0.0, following)
        returns[step] = following
    advantages = generalized_advantages(rewards, values, dones, 0.9, 1.0)
    np.testing.assert_allclose(advantages, returns - values[:-1], atol=1e-5)


def drive(ppo: Ppo, rewards: list[float], terminated: list[bool], truncated: list[bool], final: float) -> None:
    """One rollout of one robot whose observation is always 1."""
    one = np.ones((1, 1), F)
    for reward, terminates, truncates in zip(rewards, terminated, truncated, strict=True):
        ppo.act(one)
        ppo.record(one, np.array([reward], F), np.array([terminates]), np.array([truncates]), np.full((1, 1), final, F))


@pytest.mark.parametrize(
    ("terminated", "truncated", "expected"),
    [
        # V(observation) = 2 * observation; gamma = 0.5, lambda = 0: target = r + gamma * V(what follows)
        (False, False, 1.0 + 0.5 * 2.0 * 1.0),  # goes on: V(1) = 2
        (True, False, 1.0),  # collision: nothing follows
        (False, True, 1.0 + 0.5 * 2.0 * 3.0),  # time-out: V(final observation 3) = 6, not V of the new episode
    ],
)
def test_value_targets_by_hand(terminated: bool, truncated: bool, expected: float) -> None:
    config = PpoConfig(
        network=MlpNetwork(hidden_sizes=(4,)),
        robots=1,
        rollout_steps=16,
        minibatch_size=16,
        gamma=0.5,
        gae_lambda=0.0,
        scale_returns=False,
    )
    ppo = build_ppo(config, 1, 0, CPU)
    with torch.no_grad():
        for parameter in ppo.critic.parameters():
            parameter.zero_()
        ppo.critic.layers[0].weight[0, 0] = 1.0  # type: ignore[union-attr, index]
        head(ppo.critic).weight[0, 0] = 2.0
    drive(ppo, [1.0] * 16, [terminated] + [False] * 15, [truncated] + [False] * 15, final=3.0)
    with torch.no_grad():
        values, advantages = ppo._estimate()
    assert (advantages + values[:-1])[0, 0].item() == pytest.approx(expected)
    assert (advantages + values[:-1])[1, 0].item() == pytest.approx(2.0)


def test_log_probability_and_entropy_are_those_of_a_normal() -> None:
    # The density of N(0, s^2) at s z is exp(-z^2 / 2) / (s sqrt(2 pi)), its entropy ln(s sqrt(2 pi e)).
    density = (
        math.exp(-0.5 * 0.5**2) / (0.2 * math.sqrt(2 * math.pi)) * math.exp(-0.5 * 1.5**2) / (0.4 * math.sqrt(2 * math.pi))
    )
    log_std = torch.tensor([0.2, 0.4]).log()
    assert log_prob(torch.tensor([[0.5, -1.5]]), log_std).item() == pytest.approx(math.log(density))
    expected = math.log(0.2 * math.sqrt(2 * math.pi * math.e)) + math.log(0.4 * math.sqrt(2 * math.pi * math.e))
    assert entropy(log_std).item() == pytest.approx(expected)


def batch_with_ratio(actor: GaussianActor, ratios: list[float], advantages: list[float]) -> Samples:
    rows = len(ratios)
    observations, actions = torch.rand(rows, 16), torch.rand(rows, 2)
    with torch.no_grad():
        now = log_prob((actions - actor(observations)) / actor.log_std.exp(), actor.log_std)
    old, returns = now - torch.tensor(ratios).log(), torch.randn(rows)
    return Samples(observations, observations, actions, old, torch.tensor(advantages), returns)


def test_clipped_surrogate_by_hand() -> None:
    # eps = 0.2:  r A       clip(r) A   min
    # 1.5, +1     1.5       1.2         1.2   clipped
    # 0.5, +1     0.5       0.8         0.5
    # 1.5, -1    -1.5      -1.2        -1.5
    # 0.5, -2    -1.0      -1.6        -1.6   clipped
    # 1.1, +1     1.1       1.1         1.1
    actor = GaussianActor(build_network(MlpNetwork(), 16, 2), (0.2, 0.4))
    critic = build_network(MlpNetwork(), 16, 1)
    batch = batch_with_ratio(actor, [1.5, 0.5, 1.5, 0.5, 1.1], [1.0, 1.0, -1.0, -2.0, 1.0])
    losses = AutogradPpo(actor, critic, 0.2, 0.0)(batch, torch.arange(5))
    assert losses[0].item() == pytest.approx(-(1.2 + 0.5 - 1.5 - 1.6 + 1.1) / 5, abs=1e-5)
    assert losses[3].item() == pytest.approx(4 / 5)
    kl = sum(r - 1 - math.log(r) for r in (1.5, 0.5, 1.5, 0.5, 1.1)) / 5
    assert losses[2].item() == pytest.approx(kl, abs=1e-5)


@pytest.mark.parametrize("critic_sees", ["observation", "path"])
@pytest.mark.parametrize("network", [ResBlockNetwork(), MlpNetwork(), MlpNetwork(activation="tanh")], ids=repr)
def test_written_out_gradients_equal_autograd(network: Network, critic_sees: str) -> None:
    rows = 3 * ROWS_AT_ONCE
    config = PpoConfig(
        network=network,
        robots=8,
        rollout_steps=rows // 8,
        minibatch_size=64,
        critic_sees=critic_sees,
    )
    ppo = build_ppo(config, 16, 0, CPU)
    with torch.no_grad():
        head(ppo.actor.network).weight.normal_(0.0, 0.3)
    generator = torch.Generator().manual_seed(1)
    ratios = (torch.rand(rows, generator=generator) + 0.5).tolist()
    samples = batch_with_ratio(ppo.actor, ratios, torch.randn(rows, generator=generator).tolist())
    if critic_sees == "path":
        told = torch.randn(rows, GUIDANCE_SIZE, generator=generator)
        samples = samples._replace(critic_observations=torch.cat((samples.observations, told), dim=1))
    minibatch = torch.randperm(rows, generator=generator)[: 2 * ROWS_AT_ONCE + 50]
    flat = ppo._optimizer

    reference = AutogradPpo(ppo.actor, ppo.critic, 0.2, 0.01)(samples, minibatch)
    expected = flat.gradients.clone()
    flat.gradients.fill_(float("nan"))
    written = WrittenPpo(ppo.actor, ppo.critic, 0.2, 0.01)(samples, minibatch)

    assert torch.allclose(written.float(), reference, rtol=1e-4, atol=1e-6)
    assert expected.abs().max() > 0.01
    assert torch.allclose(flat.gradients, expected, rtol=0, atol=float(2e-6 * expected.abs().max()))


def test_gradients_are_clipped_for_actor_and_critic_each() -> None:
    ppo = build_ppo(PpoConfig(robots=16, minibatch_size=512), 16, 0, CPU)
    flat = ppo._optimizer
    flat.gradients.fill_(1.0)
    flat.clip_gradients(0.5)
    for module in (ppo.actor, ppo.critic):
        norm = math.sqrt(sum(float(p.grad.square().sum()) for p in module.parameters() if p.grad is not None))
        assert norm == pytest.approx(0.5, rel=1e-4)


def test_rewards_are_scaled_by_the_deviation_of_discounted_returns() -> None:
    scaler = ReturnScaler(1, gamma=0.5)
    # returns so far: 1, 0.5 * 1 + 3 = 3.5 (episode ends), 2;  mean 6.5 / 3, variance of those three
    rewards, dones = np.array([[1], [3], [2]], F), np.array([[False], [True], [False]])
    scaler.update(rewards, dones)
    assert scaler.scale == pytest.approx(1 / np.std([1, 3.5, 2]), rel=1e-6)
    # goes on where it was: 0.5 * 2 + 0 = 1
    scaler.update(np.array([[0]], F), np.array([[False]]))
    assert scaler.scale == pytest.approx(1 / np.std([1, 3.5, 2, 1]), rel=1e-6)


def test_learning_rate_decays_linearly_to_zero() -> None:
    ppo = build_ppo(PpoConfig(robots=16, minibatch_size=64, epochs=1), 4, 0, CPU)
    rates = []
    for progress in (0.0, 0.25, 1.0):
        for _ in range(32):
            ppo.act(np.zeros((16, 4), F))
            nothing = np.zeros(16, np.bool_)
            ppo.record(np.zeros((16, 4), F), np.zeros(16, F), nothing, nothing, np.zeros((16, 4), F))
        rates.append(ppo.update(progress)["optim/learning_rate"])
    assert rates == pytest.approx([1e-3, 0.75e-3, 0.0])


@pytest.mark.parametrize("network", [MlpNetwork(), ResBlockNetwork()], ids=repr)
def test_ppo_finds_the_known_best_action(network: Network) -> None:
    """Observation x in [0, 1]; the best action is (x, 1 - 2 x), and the reward the squared distance to it."""
    config = PpoConfig(network=network, robots=64, rollout_steps=8, minibatch_size=128, learning_rate=3e-3, gamma=0.5)
    ppo = build_ppo(config, 1, 0, CPU)
    rng = np.random.default_rng(0)
    nothing = np.zeros(64, np.bool_)

    def best(observations: np.ndarray) -> np.ndarray:
        return np.concatenate((observations, 1 - 2 * observations), axis=1)

    observations = rng.random((64, 1)).astype(F)
    updates = 60
    for update in range(updates):
        for _ in range(8):
            actions = np.clip(ppo.act(observations), [0, -1], [1, 1])
            rewards = -np.square(actions - best(observations)).sum(1).astype(F)
            observations = rng.random((64, 1)).astype(F)
            ppo.record(observations, rewards, nothing, nothing, observations)
        ppo.update(update / updates)
    grid = np.linspace(0.05, 0.95, 19, dtype=F)[:, None]
    with torch.no_grad():
        error = np.abs(ppo.actor(torch.from_numpy(grid)).numpy() - best(grid))
    assert error.max() < 0.15
    assert error.mean() < 0.05


def test_state_continues_bit_for_bit() -> None:
    config = PpoConfig(robots=16, rollout_steps=8, minibatch_size=32, epochs=2)

    def rollout(ppo: Ppo, rng: np.random.Generator) -> None:
        for _ in range(8):
            ppo.act(rng.random((16, 4)).astype(F))
            dones = rng.random(16) < 0.1
            ppo.record(
                rng.random((16, 4)).astype(F),
                rng.random(16).astype(F),
                dones,
                ~dones & (rng.random(16) < 0.1),
                rng.random((16, 4)).astype(F),
            )
        ppo.update(0.5)

    first = build_ppo(config, 4, 0, CPU)
    rollout(first, np.random.default_rng(1))
    second = build_ppo(config, 4, 99, CPU)
    second.load_state(first.state())
    for ppo in (first, second):
        rollout(ppo, np.random.default_rng(2))
    for name, array in first.state().items():
        assert np.array_equal(array, second.state()[name]), name
