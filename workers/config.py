"""What a training is: algorithm, network and budget, from the form to the file inside a checkpoint (pydantic only)."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from sim.config import ADVANCED, HIDDEN, Frozen, TaskConfig
from sim.extending.discovery import MAX_EXTENSIONS, UsedExtension, added, complete, used_by, with_added
from workers.extending.parts import Algorithm as AddedAlgorithm
from workers.networks.config import ConvNetwork as ConvNetwork
from workers.networks.config import GruNetwork as GruNetwork
from workers.networks.config import MlpNetwork as MlpNetwork
from workers.networks.config import Network as Network
from workers.networks.config import NetworkConfig as NetworkConfig
from workers.networks.config import RecurrentNetworkConfig as RecurrentNetworkConfig
from workers.networks.config import ResBlockNetwork as ResBlockNetwork
from workers.start import StartFrom

Threads = Literal["auto", "1", "2"]
"""Of one training; `workers.training.threads` says how many 'auto' is."""


class PpoConfig(Frozen):
    """Proximal Policy Optimization (Schulman et al. 2017) with a Gaussian policy of bounded mean."""

    name: Literal["ppo"] = Field("ppo", title="PPO")
    network: Network = Field(default_factory=MlpNetwork, title="Network")
    robots: int = Field(
        256,
        ge=1,
        le=4096,
        title="Robots",
        description="Robots that collect experience side by side.",
        json_schema_extra=ADVANCED,
    )
    rollout_steps: int = Field(
        32,
        ge=4,
        le=4096,
        title="Rollout",
        description="Steps of each robot between two updates.",
        json_schema_extra=ADVANCED,
        validate_default=True,
    )
    epochs: int = Field(6, ge=1, le=50, title="Epochs", description="Passes over each rollout.", json_schema_extra=ADVANCED)
    minibatch_size: int = Field(1024, ge=16, le=65_536, title="Minibatch", json_schema_extra=ADVANCED, validate_default=True)
    learning_rate: float = Field(1e-3, gt=0.0, le=0.1, title="Learning rate", json_schema_extra=ADVANCED)
    learning_rate_schedule: Literal["linear", "constant"] = Field(
        "linear", title="Learning-rate schedule", description="Linear decays to zero.", json_schema_extra=ADVANCED
    )
    gamma: float = Field(0.995, gt=0.0, le=1.0, title="Discount (gamma)", json_schema_extra=ADVANCED)
    gae_lambda: float = Field(0.95, ge=0.0, le=1.0, title="GAE lambda", json_schema_extra=ADVANCED)
    clip_range: float = Field(0.2, gt=0.0, le=1.0, title="Clip range (epsilon)", json_schema_extra=ADVANCED)
    entropy_coefficient: float = Field(0.003, ge=0.0, le=1.0, title="Entropy coefficient", json_schema_extra=ADVANCED)
    max_grad_norm: float = Field(0.5, gt=0.0, le=100.0, title="Gradient clipping", json_schema_extra=ADVANCED)
    initial_std_linear: float = Field(
        0.2, gt=0.01, le=2.0, title="Initial std, linear", description="Exploration noise.", json_schema_extra=ADVANCED
    )
    initial_std_angular: float = Field(
        0.4, gt=0.01, le=2.0, title="Initial std, angular", description="Exploration noise.", json_schema_extra=ADVANCED
    )
    final_std: float | None = Field(
        None,
        gt=0.02,
        le=2.0,
        title="Final std",
        description="A limit of the exploration noise falls to it over the training's second half. Empty: no limit.",
        json_schema_extra=ADVANCED,
    )
    scale_returns: bool = Field(
        True,
        title="Scale returns",
        description="Divide rewards by a running standard deviation of the return.",
        json_schema_extra=ADVANCED,
    )
    critic_sees: Literal["observation", "path"] = Field(
        "observation",
        title="Critic sees",
        description="With the path it is told the shortest path's length and direction besides what the robot sees, and "
        "judges better where targets are out of sight. The policy is told nothing.",
        json_schema_extra=ADVANCED,
    )

    @field_validator("rollout_steps")
    @classmethod
    def _is_whole_sequences(cls, value: int, info: ValidationInfo) -> int:
        network = info.data.get("network")
        if isinstance(network, RecurrentNetworkConfig) and value % network.sequence_length:
            raise ValueError(f"with this network a multiple of its sequences, of {network.sequence_length} steps each")
        return value

    @field_validator("minibatch_size")
    @classmethod
    def _fits_into_a_rollout(cls, value: int, info: ValidationInfo) -> int:
        robots, steps = info.data.get("robots"), info.data.get("rollout_steps")
        if robots is not None and steps is not None and value > robots * steps:
            raise ValueError(
                f"at most {robots * steps} here, which is a whole rollout ({robots} robots x {steps} steps): "
                "lower it, or take more robots or a longer rollout"
            )
        network = info.data.get("network")
        if isinstance(network, RecurrentNetworkConfig) and value < network.sequence_length:
            raise ValueError(f"at least {network.sequence_length} here, which is a sequence of this network")
        return value


class OffPolicyConfig(Frozen):
    """What DDPG, TD3 and SAC share: collection, memory and step sizes."""

    network: Network = Field(
        default_factory=lambda: MlpNetwork(hidden_sizes=(128, 128)), title="Network", description="Of actor and critics."
    )
    robots: int = Field(
        64,
        ge=1,
        le=4096,
        title="Robots",
        description="Robots that collect experience side by side.",
        json_schema_extra=ADVANCED,
    )
    updates_per_step: int = Field(
        4, ge=1, le=64, title="Updates per step", description="For each step of all robots.", json_schema_extra=ADVANCED
    )
    batch_size: int = Field(256, ge=16, le=65_536, title="Minibatch", json_schema_extra=ADVANCED)
    replay_size: int = Field(
        200_000, ge=1_000, le=2_000_000, title="Memory", description="Transitions kept.", json_schema_extra=ADVANCED
    )
    warmup_steps: int = Field(
        10_000,
        ge=0,
        le=1_000_000,
        title="Warm-up",
        description="Environment steps of uniform actions before learning starts.",
        json_schema_extra=ADVANCED,
    )
    actor_learning_rate: float = Field(1e-3, gt=0.0, le=0.1, title="Actor learning rate", json_schema_extra=ADVANCED)
    critic_learning_rate: float = Field(1e-3, gt=0.0, le=0.1, title="Critic learning rate", json_schema_extra=ADVANCED)
    learning_rate_schedule: Literal["linear", "constant"] = Field(
        "linear", title="Learning-rate schedule", description="Linear decays to zero.", json_schema_extra=ADVANCED
    )
    gamma: float = Field(0.97, gt=0.0, lt=1.0, title="Discount (gamma)", json_schema_extra=ADVANCED)
    tau: float = Field(
        0.05,
        gt=0.0,
        le=1.0,
        title="Target rate (tau)",
        description="Part of the way that target networks go in each update.",
        json_schema_extra=ADVANCED,
    )
    reward_scale: float = Field(
        0.01, gt=0.0, le=100.0, title="Reward scale", description="Multiplies rewards.", json_schema_extra=ADVANCED
    )

    @field_validator("network")
    @classmethod
    def _remembers_nothing(cls, value: NetworkConfig) -> NetworkConfig:
        if value.recurrent:
            raise ValueError(
                "recurrent networks are for PPO: what this algorithm replays has no memory; take another network"
            )
        return value


class _DeterministicConfig(OffPolicyConfig):
    """What DDPG and TD3 share: noise on a deterministic policy."""

    exploration_noise: float = Field(
        0.5,
        gt=0.0,
        le=2.0,
        title="Exploration noise, first",
        description="Deviation, in halves of an action's range; decays linearly.",
        json_schema_extra=ADVANCED,
    )
    final_exploration_noise: float = Field(0.3, ge=0.0, le=2.0, title="Exploration noise, last", json_schema_extra=ADVANCED)
    logit_penalty: float = Field(
        1e-3,
        ge=0.0,
        le=1.0,
        title="Logit penalty",
        description="Keeps the actor from the flat ends of its sigmoid and tanh, where it no longer learns.",
        json_schema_extra=ADVANCED,
    )


class DdpgConfig(_DeterministicConfig):
    """Deep Deterministic Policy Gradient (Lillicrap et al. 2016)."""

    name: Literal["ddpg"] = Field("ddpg", title="DDPG")


class Td3Config(_DeterministicConfig):
    """Twin Delayed DDPG (Fujimoto et al. 2018)."""

    name: Literal["td3"] = Field("td3", title="TD3")
    policy_delay: int = Field(
        2, ge=1, le=16, title="Policy delay", description="Critic updates for each of the actor.", json_schema_extra=ADVANCED
    )
    target_noise: float = Field(
        0.2,
        ge=0.0,
        le=2.0,
        title="Target noise",
        description="Smooths the target, in halves of an action's range.",
        json_schema_extra=ADVANCED,
    )
    target_noise_clip: float = Field(0.5, ge=0.0, le=2.0, title="Target noise limit", json_schema_extra=ADVANCED)


class SacConfig(OffPolicyConfig):
    """Soft Actor-Critic with a learned temperature (Haarnoja et al. 2018)."""

    name: Literal["sac"] = Field("sac", title="SAC")
    initial_temperature: float = Field(
        0.1, gt=0.0, le=10.0, title="Initial temperature", description="Weight of entropy.", json_schema_extra=ADVANCED
    )
    target_entropy: float = Field(
        -2.0, ge=-10.0, le=2.0, title="Target entropy", description="Nats over both actions.", json_schema_extra=ADVANCED
    )


class AddedAlgorithmConfig(AddedAlgorithm):
    """What every algorithm of an extension has besides its own fields."""

    network: Network = Field(default_factory=MlpNetwork, title="Network")
    robots: int = Field(
        64,
        ge=1,
        le=4096,
        title="Robots",
        description="Robots that collect experience side by side.",
        json_schema_extra=ADVANCED,
    )

    @field_validator("network")
    @classmethod
    def _remembers_nothing(cls, value: NetworkConfig) -> NetworkConfig:
        if value.recurrent:
            raise ValueError("recurrent networks are for PPO: nothing keeps their memory here; take another network")
        return value


if TYPE_CHECKING:
    Algorithm = PpoConfig | DdpgConfig | Td3Config | SacConfig | AddedAlgorithmConfig
else:
    Algorithm = Annotated[
        with_added(
            PpoConfig | DdpgConfig | Td3Config | SacConfig,
            [complete(algorithm, AddedAlgorithmConfig) for algorithm in added(AddedAlgorithm)],
        ),
        Field(discriminator="name"),
    ]


class EvaluationConfig(Frozen):
    """How often a training is measured on its frozen suite, and how often a checkpoint is kept."""

    every_steps: int = Field(
        50_000,
        ge=1_000,
        title="Evaluate and save every",
        description="Environment steps between two evaluations; each keeps a checkpoint.",
        json_schema_extra=ADVANCED,
    )
    evaluations_per_checkpoint: int = Field(
        1,
        ge=1,
        title="Evaluations for each checkpoint",
        description="Above 1 only every so-manieth evaluation keeps one; the last always does.",
        json_schema_extra=HIDDEN,
    )
    drives: int = Field(
        0,
        ge=0,
        le=1_000,
        title="Drives",
        description="Robots that drive from target to target after the training, measured as in the paper's tables.",
        json_schema_extra=HIDDEN,
    )
    drive_steps: int = Field(
        10_000,
        ge=1,
        le=1_000_000,
        title="Steps of a drive",
        description="About as many as a table's row holds.",
        json_schema_extra=HIDDEN,
    )


class TrainingConfig(Frozen):
    """One training, complete but for its seed: the message to a worker and the file in a checkpoint."""

    task: TaskConfig = Field(default_factory=TaskConfig, title="Task")
    algorithm: Algorithm = Field(default_factory=PpoConfig, title="Algorithm")
    steps: int = Field(
        300_000,
        ge=1_000,
        le=1_000_000_000,
        title="Steps",
        description="Environment steps of all robots together.",
    )
    evaluation: EvaluationConfig = Field(default_factory=EvaluationConfig, title="Evaluation")
    device: Literal["auto", "cpu", "cuda"] = Field(
        "cpu",
        title="Device",
        description="CUDA pays for PPO with ResBlock, wide networks or hundreds of robots. Auto: where a worker has it.",
        json_schema_extra=ADVANCED,
    )
    threads: Threads = Field(
        "auto",
        title="Threads",
        description="With 2, PPO's actor learns beside its critic, and one half of the robots is driven beside the other "
        "where their observations take long or paths are paid for; auto takes what other programs leave free. Results are "
        "the same.",
        json_schema_extra=ADVANCED,
    )
    start_from: StartFrom | None = Field(
        None,
        title="Start from",
        description="A policy whose weights it begins with; fresh ones without it.",
        json_schema_extra=HIDDEN,
    )
    extensions: tuple[UsedExtension, ...] = Field(
        (),
        max_length=MAX_EXTENSIONS,
        title="Extensions",
        description="Whose parts it is made of, as they were when it was launched.",
        json_schema_extra=HIDDEN,
    )

    @model_validator(mode="after")
    def _groups_are_whole(self) -> Self:
        if self.algorithm.robots % self.task.together:
            raise ValueError(
                f"robots must be a multiple of task.together, {self.task.together}, and {self.algorithm.robots} is none"
            )
        return self

    def as_installed(self) -> "TrainingConfig":
        """The same with the extensions that it needs as they are installed here: what is launched."""
        return self.model_copy(update={"extensions": used_by(self)})
