"""DDPG, TD3 and SAC: targets by hand, a memory that forgets nothing it should keep, and a problem with a known answer."""

import math
import tracemalloc

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from tests.heads import head
from workers.algorithms import build_algorithm
from workers.algorithms.ddpg import Ddpg, build_ddpg
from workers.algorithms.gradients.actor_critic import AutogradActorCritic, WrittenActorCritic
from workers.algorithms.gradients.sac import AutogradSac, WrittenSac
from workers.algorithms.off_policy import OffPolicyAlgorithm
from workers.algorithms.sac import Sac, build_sac
from workers.algorithms.storage.replay import ReplayBuffer, Transitions
from workers.algorithms.td3 import Td3, build_td3
from workers.config import DdpgConfig, MlpNetwork, Network, ResBlockNetwork, SacConfig, Td3Config
from workers.networks.squashing import log_slope
from workers.policy import Policy

F = np.float32
CPU = torch.device("cpu")
SMALL = MlpNetwork(hidden_sizes=(16,))


def set_constant(network: torch.nn.Module, value: float) -> None:
    """A network that answers `value` whatever it is asked."""
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        head(network).bias.fill_(value)


def one_batch(pairs: int = 1) -> Transitions:
    """Pairs of a step that goes on and one after which nothing follows, all with reward 1."""
    return Transitions(
        observations=torch.zeros(2 * pairs, 3),
        actions=torch.zeros(2 * pairs, 2),
        rewards=torch.ones(2 * pairs, 1),
        continues=torch.tensor([[1.0], [0.0]]).repeat(pairs, 1),
        next_observations=torch.zeros(2 * pairs, 3),
    )


def test_ddpg_target_and_loss_by_hand() -> None:
    ddpg = build_ddpg(DdpgConfig(network=SMALL, gamma=0.5), 3, 0, CPU)
    set_constant(ddpg.target_critics[0], 4.0)
    set_constant(ddpg.critics[0], 1.0)
    losses = ddpg.learn(one_batch())
    # y = 1 + 0.5 * 4 = 3 and 1;  L = ((1 - 3)^2 + (1 - 1)^2) / 2
    assert losses["value/mean"].item() == pytest.approx(2.0)
    assert losses["loss/value"].item() == pytest.approx(2.0)


def test_td3_takes_the_smaller_target() -> None:
    td3 = build_td3(Td3Config(network=SMALL, gamma=0.5, policy_delay=2), 3, 0, CPU)
    for critic, value in zip(td3.target_critics, (4.0, 2.0), strict=True):
        set_constant(critic, value)
    for critic in td3.critics:
        set_constant(critic, 1.0)
    before = td3.actor_optimizer.values.clone()
    losses = td3.learn(one_batch())
    # y = 1 + 0.5 * min(4, 2) = 2 and 1;  each critic ((1 - 2)^2 + 0) / 2, summed over two
    assert losses["value/mean"].item() == pytest.approx(1.5)
    assert losses["loss/value"].item() == pytest.approx(1.0)
    # the actor waits for the second update
    assert "loss/policy" not in losses
    assert torch.equal(td3.actor_optimizer.values, before)
    assert "loss/policy" in td3.learn(one_batch())


def test_sac_target_counts_entropy() -> None:
    sac = build_sac(SacConfig(network=SMALL, gamma=0.5, initial_temperature=0.1), 3, 0, CPU)
    for critic, value in zip(sac.target_critics, (4.0, 2.0), strict=True):
        set_constant(critic, value)
    state = sac._generator.get_state()
    _, log_probs = sac.sample(torch.zeros(2, 3))
    sac._generator.set_state(state)
    losses = sac.learn(one_batch())
    # y = 1 + 0.5 * (min(4, 2) - 0.1 log pi) and 1
    expected = (1 + 0.5 * (2 - 0.1 * log_probs[0].item()) + 1) / 2
    assert losses["value/mean"].item() == pytest.approx(expected, abs=1e-5)


@given(st.floats(-8, 8), st.floats(-4, 4))
def test_log_slope_is_the_derivative_of_the_squashing(linear: float, angular: float) -> None:
    s = 1 / (1 + math.exp(-linear))
    expected = math.log(s * (1 - s)) + math.log(1 - math.tanh(angular) ** 2)
    assert log_slope(torch.tensor([[linear, angular]], dtype=torch.float64)).item() == pytest.approx(expected, abs=1e-6)


def test_sac_temperature_falls_while_entropy_is_above_its_target() -> None:
    # An actor that answers 0 has deviation e^-1.5: entropy 2 (-1.5 + 1.42) of u, ln(1/4) of the slopes, together -1.5.
    sac = build_sac(SacConfig(network=SMALL, batch_size=1000), 3, 0, CPU)
    set_constant(sac.actor, 0.0)
    first = sac.learn(one_batch(pairs=500))["policy/temperature"].item()
    assert sac.learn(one_batch())["policy/temperature"].item() < first


def test_target_networks_move_by_tau() -> None:
    ddpg = build_ddpg(DdpgConfig(network=SMALL, tau=0.25), 3, 0, CPU)
    target, online = ddpg._targets["target_critic"], ddpg._online["critic"]
    target.values.fill_(1.0)
    online.values.fill_(3.0)
    ddpg.follow("target_critic", "critic")
    assert torch.equal(target.values, torch.full_like(target.values, 1.5))


def test_the_penalty_moves_an_actor_that_its_critic_cannot_move() -> None:
    # Logits of 30: sigmoid and tanh are 1 and their slopes 0. Adam's first step goes the learning rate's length.
    for penalty, expected in ((0.0, 30.0), (1e-3, 29.9)):
        ddpg = build_ddpg(DdpgConfig(network=SMALL, actor_learning_rate=0.1, logit_penalty=penalty), 3, 0, CPU)
        set_constant(ddpg.actor.network, 30.0)
        ddpg.learn(one_batch())
        assert head(ddpg.actor.network).bias.tolist() == pytest.approx([expected, expected])


def test_learning_rates_fall_linearly() -> None:
    config = DdpgConfig(network=SMALL, actor_learning_rate=0.01, critic_learning_rate=0.02, learning_rate_schedule="linear")
    ddpg = build_ddpg(config, 3, 0, CPU)
    assert ddpg.update(0.75)["optim/learning_rate"] == pytest.approx(0.0025)
    assert ddpg.actor_optimizer.learning_rate == pytest.approx(0.0025)
    assert ddpg.critic_optimizer.learning_rate == pytest.approx(0.005)


@pytest.mark.parametrize("network", [MlpNetwork(), ResBlockNetwork()], ids=repr)
def test_written_out_gradients_equal_autograd(network: Network) -> None:
    td3 = build_td3(Td3Config(network=network, batch_size=32), 16, 0, CPU)
    actor, critics = td3.actor_optimizer, td3.critic_optimizer
    reference = AutogradActorCritic(td3.actor, td3.critics, actor, critics, logit_penalty=0.01)
    written = WrittenActorCritic(td3.actor, td3.critics, 32, logit_penalty=0.01)
    with torch.no_grad():
        head(td3.actor.network).weight.mul_(10.0)
    batch = Transitions(torch.randn(32, 16), torch.rand(32, 2), torch.rand(32, 1), torch.ones(32, 1), torch.randn(32, 16))
    targets = torch.randn(32, 1)

    expected_loss = reference.critics(batch, targets)
    expected = critics.gradients.clone()
    critics.gradients.fill_(float("nan"))
    assert torch.allclose(written.critics(batch, targets), expected_loss)
    assert torch.allclose(critics.gradients, expected, rtol=0, atol=2e-6 * float(expected.abs().max()))

    expected_loss = reference.actor(batch.observations)
    expected = actor.gradients.clone()
    assert expected.abs().max() > 1e-3
    before = critics.gradients.clone()
    actor.gradients.fill_(float("nan"))
    assert torch.allclose(written.actor(batch.observations), expected_loss)
    assert torch.allclose(actor.gradients, expected, rtol=0, atol=2e-6 * float(expected.abs().max()))
    assert torch.equal(critics.gradients, before)  # the actor's update leaves the critics alone


@pytest.mark.parametrize("network", [MlpNetwork(), ResBlockNetwork()], ids=repr)
def test_sacs_written_out_gradients_equal_autograd(network: Network) -> None:
    sac = build_sac(SacConfig(network=network, batch_size=32), 16, 0, CPU)
    actor, critics = sac.actor_optimizer, sac.critic_optimizer
    reference, written = AutogradSac(sac.actor, sac.critics, actor, critics), WrittenSac(sac.actor, sac.critics, 32)
    with torch.no_grad():
        head(sac.actor).weight.mul_(10.0)
    torch.manual_seed(1)  # the same numbers whatever ran before: of all there are, some round beyond the tolerance
    batch = Transitions(torch.randn(32, 16), torch.rand(32, 2), torch.rand(32, 1), torch.ones(32, 1), torch.randn(32, 16))
    targets, noise, alpha = torch.randn(32, 1), torch.randn(32, 2), torch.tensor([0.3])

    expected_loss = reference.critics(batch, targets)
    expected = critics.gradients.clone()
    critics.gradients.fill_(float("nan"))
    assert torch.allclose(written.critics(batch, targets), expected_loss)
    assert torch.allclose(critics.gradients, expected, rtol=0, atol=2e-6 * float(expected.abs().max()))

    expected_loss, expected_log_probs = reference.actor(batch.observations, noise, alpha)
    expected = actor.gradients.clone()
    actor.gradients.fill_(float("nan"))
    loss, log_probs = written.actor(batch.observations, noise, alpha)
    assert torch.allclose(loss, expected_loss)
    assert torch.allclose(log_probs, expected_log_probs, atol=1e-6)
    assert torch.allclose(actor.gradients, expected, rtol=0, atol=5e-6 * float(expected.abs().max()))


def record(algorithm: OffPolicyAlgorithm, rng: np.random.Generator, steps: int) -> None:
    observations = rng.random((algorithm.robots, 3)).astype(F)
    for _ in range(steps):
        algorithm.act(observations)
        terminations = rng.random(algorithm.robots) < 0.1
        truncations = ~terminations & (rng.random(algorithm.robots) < 0.2)
        observations = rng.random((algorithm.robots, 3)).astype(F)
        algorithm.record(
            observations,
            rng.random(algorithm.robots).astype(F),
            terminations,
            truncations,
            rng.random((algorithm.robots, 3)).astype(F),
        )
        algorithm.update(0.5)


def test_time_outs_bootstrap_from_where_the_episode_was_cut() -> None:
    ddpg = build_ddpg(DdpgConfig(network=SMALL, robots=3, reward_scale=0.5), 1, 0, CPU)
    ddpg.act(np.array([[1], [2], [3]], F))
    ddpg.record(
        np.array([[4], [50], [60]], F),  # the last two are observations of the next episode
        np.array([10, 20, 30], F),
        np.array([False, True, False]),
        np.array([False, False, True]),
        np.array([[-1], [5], [6]], F),
    )
    drawn = next(ddpg._replay.sample(1, 64, torch.Generator().manual_seed(0)))
    rows = {
        row[0].item(): (row[1].item(), row[2].item(), row[3].item())
        for row in torch.cat((drawn.observations, drawn.rewards, drawn.continues, drawn.next_observations), 1)
    }
    assert rows == {1.0: (5.0, 1.0, 4.0), 2.0: (10.0, 0.0, 5.0), 3.0: (15.0, 1.0, 6.0)}


def test_memory_keeps_the_newest() -> None:
    memory = ReplayBuffer(5, 2, 1, CPU)  # rounded up to three steps of two robots
    for step in range(4):
        column = torch.full((2, 1), float(step))
        memory.add(column, torch.zeros(2, 2), column, column, column)
    assert len(memory) == 6
    drawn = next(memory.sample(1, 200, torch.Generator().manual_seed(0)))
    assert set(drawn.observations.flatten().tolist()) == {1.0, 2.0, 3.0}


@pytest.mark.parametrize("before", [2, 5, 13])
@pytest.mark.parametrize("after", [0, 1, 4, 30])
def test_a_snapshot_is_the_state_of_its_moment_whatever_is_recorded_afterwards(before: int, after: int) -> None:
    """Before the memory is full and after, and where all of it was overwritten since."""
    config = DdpgConfig(network=SMALL, robots=100, replay_size=1000, warmup_steps=500, batch_size=32)
    algorithm = build_algorithm(config, 3, 0, CPU)
    assert isinstance(algorithm, OffPolicyAlgorithm)
    dice = np.random.default_rng(0)
    record(algorithm, dice, 3)
    algorithm.snapshot()  # an earlier one does not matter
    record(algorithm, dice, before)
    state, snapshot = algorithm.state(), algorithm.snapshot()
    record(algorithm, dice, after)
    for name, array in snapshot().items():
        np.testing.assert_array_equal(array, state[name], err_msg=name)


def test_a_snapshot_does_not_copy_the_memory() -> None:
    config = DdpgConfig(network=SMALL, robots=1_000, replay_size=200_000, warmup_steps=1_000_000)
    algorithm = build_algorithm(config, 16, 0, CPU)
    assert isinstance(algorithm, OffPolicyAlgorithm)
    dice = np.random.default_rng(0)
    for _ in range(200):
        algorithm.act(dice.random((1_000, 16), np.float32))
        nothing = np.zeros(1_000, np.bool_)
        following = dice.random((1_000, 16), np.float32)
        algorithm.record(following, np.zeros(1_000, np.float32), nothing, nothing, following)
    tracemalloc.start()
    try:
        algorithm.snapshot()
        assert tracemalloc.get_traced_memory()[1] < 2**20
        algorithm.state()
        assert tracemalloc.get_traced_memory()[1] > 10 * 2**20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("steps", [3, 7, 23])
@pytest.mark.parametrize("name", ["ddpg", "td3", "sac"])
def test_state_continues_bit_for_bit(name: str, steps: int) -> None:
    """Before the memory is full, and after it has gone round."""
    make = {"ddpg": DdpgConfig, "td3": Td3Config, "sac": SacConfig}[name]
    config = make(network=SMALL, robots=100, replay_size=1000, warmup_steps=500, batch_size=32, updates_per_step=3)
    first, second = build_algorithm(config, 3, 0, CPU), build_algorithm(config, 3, 1, CPU)
    assert isinstance(first, OffPolicyAlgorithm)
    assert isinstance(second, OffPolicyAlgorithm)
    record(first, np.random.default_rng(0), steps)
    second.load_state(first.state())
    for algorithm in (first, second):
        record(algorithm, np.random.default_rng(1), 6)
    mine, theirs = first.state(), second.state()
    assert mine.keys() == theirs.keys()
    for key in mine:
        np.testing.assert_array_equal(mine[key], theirs[key], err_msg=key)


CONFIGS = [
    DdpgConfig(network=MlpNetwork(hidden_sizes=(64, 64)), robots=32, warmup_steps=640, gamma=0.5, reward_scale=1.0),
    Td3Config(network=MlpNetwork(hidden_sizes=(64, 64)), robots=32, warmup_steps=640, gamma=0.5, reward_scale=1.0),
    SacConfig(
        network=MlpNetwork(hidden_sizes=(64, 64)),
        robots=32,
        warmup_steps=640,
        gamma=0.5,
        reward_scale=1.0,
        actor_learning_rate=2e-3,
        initial_temperature=0.02,
    ),
]


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.name)
def test_the_known_best_action_is_found(config: DdpgConfig | Td3Config | SacConfig) -> None:
    """Observation x in [0, 1]; the best action is (x, 0.8 - 1.6 x), and the reward the squared distance to it."""
    algorithm = build_algorithm(config, 1, 1, CPU)
    assert isinstance(algorithm, Ddpg | Td3 | Sac)
    rng = np.random.default_rng(0)
    nothing = np.zeros(config.robots, np.bool_)

    def best(observations: np.ndarray) -> np.ndarray:
        return np.concatenate((observations, 0.8 - 1.6 * observations), axis=1)

    observations = rng.random((config.robots, 1)).astype(F)
    steps = 300
    for step in range(steps):
        rewards = -np.square(algorithm.act(observations) - best(observations)).sum(1).astype(F)
        observations = rng.random((config.robots, 1)).astype(F)
        algorithm.record(observations, rewards, nothing, nothing, observations)
        algorithm.update(step / steps)
    grid = np.linspace(0.05, 0.95, 19, dtype=F)[:, None]
    error = np.abs(Policy(config.network, algorithm.policy_weights(), 1)(grid) - best(grid))
    assert error.mean() < 0.06
    assert error.max() < 0.2


def test_sac_exports_the_mean_only() -> None:
    sac = build_sac(SacConfig(network=SMALL), 3, 0, CPU)
    observations = torch.rand(5, 3)
    mean = sac.actor(observations)[:, :2]
    expected = torch.stack((torch.sigmoid(mean[:, 0]), torch.tanh(mean[:, 1])), 1)
    actions = Policy(SMALL, sac.policy_weights(), 3)(observations.numpy())
    np.testing.assert_allclose(actions, expected.detach().numpy(), atol=1e-6)
