"""What ResBlock's concatenations are worth: gradients that reach the first layer, success, and its spread over seeds."""

from collections.abc import Iterator

import numpy as np
import torch

from benchmarks.untold_claims.trainings import Trainings
from benchmarks.untold_claims.words import each, mean, rate, rates, ratio_of_spreads, told
from sim.envs.vector import NavigationVectorEnv
from workers.checkpoints import read_policy
from workers.config import ResBlockNetwork, TrainingConfig
from workers.networks.inputs import inputs_of
from workers.networks.modules import build_network, fresh_network
from workers.reproduction.measures import SCALES
from workers.reproduction.rows import ROW_BY_ID
from workers.statistics.differences import difference_of_means, difference_of_rates
from workers.statistics.wording import Scale

_FLOW = Scale(unit="powers of ten", factor=1.0, decimals=2, margin=0.3, more_is_better=True)
_OBSERVATIONS, _ROBOTS = 4_096, 64


def stability(trainings: Trainings) -> Iterator[str]:
    """What the concatenations are worth: gradients that reach the first layer, success, and its spread over seeds."""
    yield "## ResBlocks make learning more stable, by keeping gradients from vanishing"
    yield ""
    yield (
        "The same trainings with the same layers one after another: 16, 512, 16, 512 and 32 numbers wide, nothing goes "
        f"round them. *Gradient*: {_OBSERVATIONS:,} observations of robots that drive at random, random errors at the "
        "outputs; the root mean square of the gradient in the first layer over that in the last, as a power of ten. "
        "*Before* is a network as it is initialised, *after* the trained policy's."
    )
    row = ROW_BY_ID["complex-basic-resblock-ppo"]
    algorithm = row.training.algorithm.model_copy(update={"network": ResBlockNetwork(concatenations=False)})
    plain = row.training.model_copy(update={"algorithm": algorithm})
    name = f"{row.id}-without-concatenations"
    with_them, without = trainings.trained(row.id, row.training), trainings.trained(name, plain)
    seen = _observations(row.training)
    flows = {
        moment: [
            [flow(_network(trainings, which, training, seed, moment), seen) for seed in range(trainings.seeds)]
            for which, training in ((row.id, row.training), (name, plain))
        ]
        for moment in ("before training", "after training")
    }
    yield from ("", "| | with | without | with less without |", "|---|---|---|---|")
    for moment, (there, gone) in flows.items():
        why = told(_FLOW, difference_of_means(there, gone), len(there))
        yield f"| gradient {moment} | {mean(there)} | {mean(gone)} | {why} |"
    why = told(SCALES["success"], difference_of_rates(rates(with_them), rates(without)), len(without))
    yield f"| success % | {rate(with_them)} | {rate(without)} | {why} |"
    yield f"| of each seed | {each(with_them)} | {each(without)} | |"
    spreads = [100 * float(np.std([one.measured.success for one in side], ddof=1)) for side in (with_them, without)]
    ratio = ratio_of_spreads(with_them, without)
    yield f"| its standard deviation over seeds, points | {spreads[0]:.1f} | {spreads[1]:.1f} | {ratio} |"


def flow(network: torch.nn.Module, observations: torch.Tensor) -> float:
    """How much of random errors at the outputs reaches the first layer: log10 of its gradient's RMS over the last one's."""
    outputs = network(observations)
    error = torch.randn(outputs.shape, generator=torch.Generator().manual_seed(0))
    network.zero_grad()
    (outputs * error).sum().backward()
    layers = [module.weight.grad for module in network.modules() if isinstance(module, torch.nn.Linear)]
    first, last = (float(layer.square().mean().sqrt()) for layer in (layers[0], layers[-1]) if layer is not None)
    return float(np.log10(first / last))


def _network(trainings: Trainings, name: str, training: TrainingConfig, seed: int, moment: str) -> torch.nn.Module:
    if moment == "before training":
        torch.manual_seed(seed)
        return build_network(training.algorithm.network, inputs_of(training.task), 2)
    _, policy = read_policy(trainings.archive(name, seed))
    network = fresh_network(policy.network, policy.inputs, policy.actions.size)
    network.load_state_dict({key: torch.from_numpy(array.copy()) for key, array in policy.weights.items()})
    return network


def _observations(training: TrainingConfig) -> torch.Tensor:
    env = NavigationVectorEnv(training.task, _ROBOTS, seed=0)
    env.single_action_space.seed(0)
    seen, _ = env.reset()
    looks = [seen]
    for _ in range(_OBSERVATIONS // _ROBOTS - 1):
        actions = [env.single_action_space.sample() for _ in range(_ROBOTS)]
        looks.append(env.step(np.array(actions, np.float32))[0])
    return torch.from_numpy(np.concatenate(looks))
