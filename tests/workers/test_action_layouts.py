"""What learns, for every kind of action: squashing, densities and written-out gradients against autograd and by hand."""

import math

import numpy as np
import pytest
import torch

from sim.actions import ActionLayout, action_layout
from sim.config import AckermannDrive, AnyDrive, BurgerConfig, DifferentialDrive, OmnidirectionalDrive
from workers.algorithms import build_algorithm
from workers.algorithms.gradients.actor_critic import AutogradActorCritic, WrittenActorCritic
from workers.algorithms.gradients.ppo import AutogradPpo, WrittenPpo, log_prob
from workers.algorithms.gradients.sac import AutogradSac, WrittenSac
from workers.algorithms.ppo import build_ppo, initial_deviations
from workers.algorithms.sac import build_sac
from workers.algorithms.storage.replay import Transitions
from workers.algorithms.storage.rollout import Samples
from workers.algorithms.td3 import build_td3
from workers.config import Algorithm, DdpgConfig, MlpNetwork, PpoConfig, SacConfig, Td3Config
from workers.networks.squashing import bound_actions, log_slope
from workers.policy import Policy, torch_policy

CPU = torch.device("cpu")
SMALL = MlpNetwork(hidden_sizes=(16,))


def layout_of(drive: AnyDrive) -> ActionLayout:
    return action_layout(BurgerConfig(drive=drive))


LAYOUTS = [
    layout_of(DifferentialDrive(reverse=0.4)),
    layout_of(DifferentialDrive(reverse=1.0)),
    layout_of(OmnidirectionalDrive(reverse=0.5)),
    layout_of(AckermannDrive()),
]
layouts = pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: f"{layout.names}{layout.lows}")


def test_squashing_worked_by_hand() -> None:
    layout = LAYOUTS[2]
    actions = bound_actions(torch.tensor([[0.0, 0.0, 0.0], [math.log(3.0), 9.0, -9.0]]), layout)
    # Of [-0.5, 1] the middle is 0.25, and a sigmoid of 3/4 is at 0.625.
    assert actions.numpy() == pytest.approx(np.array([[0.25, 0.0, 0.0], [0.625, 1.0, -1.0]]), abs=1e-6)
    assert layout.formula == "-0.5 + 1.5 / (1 + exp(-y[0])), tanh(y[1]), tanh(y[2])"


def test_exploration_grows_with_the_range() -> None:
    config = PpoConfig(initial_std_linear=0.2, initial_std_angular=0.4)
    assert initial_deviations(config, LAYOUTS[0]) == pytest.approx((0.28, 0.4))
    assert initial_deviations(config, LAYOUTS[2]) == pytest.approx((0.3, 0.4, 0.4))
    assert initial_deviations(config, LAYOUTS[3]) == pytest.approx((0.4, 0.4))


@layouts
def test_log_slope_is_the_derivative_of_the_squashing(layout: ActionLayout) -> None:
    logits = torch.randn(50, layout.size, dtype=torch.float64, requires_grad=True)
    (slope,) = torch.autograd.grad(bound_actions(logits, layout).sum(), logits)
    torch.testing.assert_close(log_slope(logits, layout), slope.log().sum(dim=1), rtol=1e-6, atol=1e-6)


@layouts
def test_ppos_written_out_gradients_equal_autograd(layout: ActionLayout) -> None:
    torch.manual_seed(0)
    config = PpoConfig(network=SMALL, robots=8, rollout_steps=25, minibatch_size=64)
    ppo = build_ppo(config, 5, 0, CPU, layout)
    with torch.no_grad():
        for parameter in ppo.actor.network.parameters():
            parameter.normal_(0.0, 0.5)
    observations, noise = torch.randn(200, 5), torch.randn(200, layout.size)
    with torch.no_grad():
        actions = ppo.actor(observations) + noise * torch.exp(ppo.actor.log_std)
    old = log_prob(noise, ppo.actor.log_std).detach() - 0.3 * torch.randn(200)
    samples = Samples(observations, observations, actions, old, torch.randn(200), torch.randn(200))
    rows, flat = torch.randperm(200)[:150], ppo._optimizer
    reference = AutogradPpo(ppo.actor, ppo.critic, 0.2, 0.01)(samples, rows)
    expected = flat.gradients.clone()
    flat.gradients.fill_(float("nan"))
    written = WrittenPpo(ppo.actor, ppo.critic, 0.2, 0.01)(samples, rows)
    assert torch.allclose(written.float(), reference, rtol=1e-4, atol=1e-5)
    assert torch.allclose(flat.gradients, expected, rtol=0, atol=float(5e-6 * expected.abs().max()))


def transitions(layout: ActionLayout) -> Transitions:
    return Transitions(
        torch.randn(32, 5), torch.rand(32, layout.size), torch.rand(32, 1), torch.ones(32, 1), torch.randn(32, 5)
    )


@layouts
def test_actor_critic_gradients_equal_autograd(layout: ActionLayout) -> None:
    torch.manual_seed(0)
    td3 = build_td3(Td3Config(network=SMALL, batch_size=32), 5, 0, CPU, layout)
    batch, gradients = transitions(layout), td3.actor_optimizer.gradients
    AutogradActorCritic(td3.actor, td3.critics, td3.actor_optimizer, td3.critic_optimizer, 0.01).actor(batch.observations)
    expected = gradients.clone()
    gradients.fill_(float("nan"))
    WrittenActorCritic(td3.actor, td3.critics, 32, 0.01).actor(batch.observations)
    assert torch.allclose(gradients, expected, rtol=0, atol=5e-6 * float(expected.abs().max()))


@layouts
def test_sacs_gradients_equal_autograd(layout: ActionLayout) -> None:
    torch.manual_seed(0)
    sac = build_sac(SacConfig(network=SMALL, batch_size=32), 5, 0, CPU, layout)
    observations, noise, alpha = torch.randn(32, 5), torch.randn(32, layout.size), torch.tensor([0.3])
    gradients = sac.actor_optimizer.gradients
    expected_loss, expected_log_probs = AutogradSac(
        sac.actor, sac.critics, sac.actor_optimizer, sac.critic_optimizer, layout
    ).actor(observations, noise, alpha)
    expected = gradients.clone()
    gradients.fill_(float("nan"))
    loss, log_probs = WrittenSac(sac.actor, sac.critics, 32, layout).actor(observations, noise, alpha)
    assert torch.allclose(loss, expected_loss, atol=1e-5)
    assert torch.allclose(log_probs, expected_log_probs, atol=1e-5)
    assert torch.allclose(gradients, expected, rtol=0, atol=5e-6 * float(expected.abs().max()))


@layouts
@pytest.mark.parametrize("name", ["ppo", "ddpg", "td3", "sac"])
def test_every_algorithm_acts_within_the_ranges_and_learns(layout: ActionLayout, name: str) -> None:
    configs: dict[str, Algorithm] = {
        "ppo": PpoConfig(network=SMALL, robots=4, rollout_steps=8, minibatch_size=16, epochs=1),
        "ddpg": DdpgConfig(network=SMALL, robots=4, warmup_steps=8, batch_size=16),
        "td3": Td3Config(network=SMALL, robots=4, warmup_steps=8, batch_size=16),
        "sac": SacConfig(network=SMALL, robots=4, warmup_steps=8, batch_size=16),
    }
    config = configs[name]
    algorithm = build_algorithm(config, 5, 0, CPU, layout)
    rng, nothing = np.random.default_rng(0), np.zeros(4, np.bool_)
    for _ in range(8):
        actions = algorithm.act(rng.normal(size=(4, 5)).astype(np.float32))
        assert actions.shape == (4, layout.size)
        if name != "ppo":
            assert (actions >= np.array(layout.lows, np.float32)).all()
            assert (actions <= 1.0).all()
        seen = rng.normal(size=(4, 5)).astype(np.float32)
        algorithm.record(seen, np.ones(4, np.float32), nothing, nothing, seen)
        if name != "ppo":
            algorithm.update(0.5)
    metrics = algorithm.update(0.5)
    if name != "sac":
        assert {f"policy/std_{component}" for component in layout.names} <= metrics.keys()
    assert algorithm.finite
    policy = Policy(config.network, algorithm.policy_weights(), 5, layout)
    observations = rng.normal(size=(20, 5)).astype(np.float32)
    np.testing.assert_allclose(policy(observations), torch_policy(policy)(observations), atol=1e-6)
    assert (policy(observations) >= np.array(layout.lows)).all()
