"""What each shipped policy is trained from: the one table to change (pydantic only)."""

from typing import Literal

from sim.config import (
    ArrivalTerm,
    BearingPart,
    CollisionTerm,
    DistancePart,
    DwellPart,
    Frozen,
    GeneratedArenaConfig,
    JackalConfig,
    LidarConfig,
    MoversConfig,
    ObservationConfig,
    ObservationPart,
    OpeningsPart,
    PathProgressTerm,
    ProximityTerm,
    RangesPart,
    ReachPart,
    RewardConfig,
    RoundConfig,
    SingleMount,
    SpeedsPart,
    TaskConfig,
    TimeoutTerm,
    TrailPart,
    WayPart,
)
from workers.config import EvaluationConfig, MlpNetwork, PpoConfig, TrainingConfig
from workers.presets import COMPLEX, DEFAULT


class Recipe(Frozen):
    """A training, and the suites that its policy is measured on.

    Attributes:
        name: of its folder and its address.
        title: for people.
        description: what it is good for, in a sentence or two.
        training: what is trained; its best checkpoint on the training's own suite is kept.
        seed: of the training.
        suites: by name, the training's own first; the others are frozen ones.
    """

    name: str
    title: str
    description: str
    training: TrainingConfig
    seed: int
    suites: tuple[str, ...]


def _with_trail(
    batches: int, memory: Literal["short", "long"] = "short", *, ahead: tuple[ObservationPart, ...] = ()
) -> ObservationConfig:
    """What a policy sees that is to know where it has been, and what more of where it could go."""
    return ObservationConfig(
        parts=(
            RangesPart(batches=batches, inverse=True),
            SpeedsPart(),
            DistancePart(scaling="saturating"),
            BearingPart(encoding="sine_cosine"),
            TrailPart(sectors=30, memory=memory),
            *ahead,
        )
    )


def _along_the_path(collision: float) -> RewardConfig:
    """A reward for the shortest path made shorter, with what a collision adds."""
    return RewardConfig(terms=(ArrivalTerm(), CollisionTerm(weight=collision), TimeoutTerm(), PathProgressTerm()))


def _told_the_way(
    hidden_sizes: tuple[int, ...],
    *,
    entropy_coefficient: float,
    gamma: float,
    minibatch_size: int = 4096,
    epochs: int = 4,
    final_std: float | None = None,
) -> PpoConfig:
    """PPO with many robots and large minibatches, whose critic knows the shortest path."""
    return PpoConfig(
        network=MlpNetwork(hidden_sizes=hidden_sizes),
        robots=512,
        rollout_steps=64,
        minibatch_size=minibatch_size,
        epochs=epochs,
        learning_rate=4e-4,
        entropy_coefficient=entropy_coefficient,
        gamma=gamma,
        final_std=final_std,
        critic_sees="path",
    )


RECIPES: tuple[Recipe, ...] = (
    Recipe(
        name="simple",
        title="Simple arena",
        description="The default training: five seconds on one core.",
        training=DEFAULT.training,
        seed=0,
        suites=("simple-200",),
    ),
    Recipe(
        name="complex",
        title="Complex arena",
        description="The preset for 17 obstacles: half a minute on one core; clutter-500 is all new to it.",
        training=COMPLEX.training,
        seed=0,
        suites=("complex-200", "clutter-500"),
    ),
    Recipe(
        name="clutter",
        title="Through clutter",
        description="Trained on 1,024 maps of dense clutter with a scanner that looks all round, for places that it has "
        "never seen: three minutes on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                arena=GeneratedArenaConfig(name="clutter", difficulty=0.9, maps=1024, seed=0),
                lidar=LidarConfig(rays=60, field_of_view=360.0),
                observation=ObservationConfig.preset("improved", batches=30),
            ),
            algorithm=PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128))),
            steps=4_000_000,
            evaluation=EvaluationConfig(every_steps=250_000),
        ),
        seed=0,
        suites=("clutter-0.9-200", "clutter-500", "barn-20", "crowd-200", "complex-200"),
    ),
    Recipe(
        name="thickets",
        title="Through thickets",
        description="Trained on 256 maps of thin pillars and clutter, for narrow gaps, bays and dead ends that it has never "
        "seen: four minutes on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                arena=GeneratedArenaConfig(name="mixed", difficulty=0.8, maps=256, seed=0),
                lidar=LidarConfig(rays=120, field_of_view=360.0),
                observation=ObservationConfig.preset("improved", batches=60),
                reward=RewardConfig.preset("basic", collision=-1000.0),
            ),
            algorithm=PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128))),
            steps=4_000_000,
            evaluation=EvaluationConfig(every_steps=250_000),
        ),
        seed=0,
        suites=("mixed-0.8-200", "clutter-500", "barn-20", "crowd-200", "complex-200"),
    ),
    Recipe(
        name="rooms",
        title="Through rooms and mazes",
        description="Trained on 4,096 maps of seven families, for buildings that it has never seen: it drops crumbs on its "
        "way and sees its trail, sees how far it could go, and knows where it has not looked yet; a quarter of an "
        "hour on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                # Drawn by what they still teach: what fails at the end are few maps of thousands.
                arena=GeneratedArenaConfig(name="intricate", difficulty=1.0, maps=4096, map_sampling="learnability"),
                lidar=LidarConfig(rays=120, field_of_view=360.0),
                observation=_with_trail(
                    batches=120, memory="long", ahead=(WayPart(), ReachPart(), OpeningsPart(), DwellPart())
                ),
                reward=RewardConfig(
                    terms=(
                        # Worth a risk beside an obstacle, which a collision's price alone would not let it take.
                        ArrivalTerm(weight=2000.0),
                        CollisionTerm(weight=-6000.0),
                        TimeoutTerm(),
                        PathProgressTerm(),
                        ProximityTerm(weight=-25.0, margin=0.2),
                    )
                ),
                step_limit=1500,
                arrival_ends=True,
            ),
            algorithm=_told_the_way(
                (256, 128), entropy_coefficient=0.005, gamma=0.995, minibatch_size=2048, epochs=2, final_std=0.05
            ),
            steps=16_000_000,
            # At the end only: 200 scenarios are too few to tell its checkpoints apart, and the last are the best.
            evaluation=EvaluationConfig(every_steps=16_000_000),
        ),
        seed=0,
        suites=("intricate-1-200", "clutter-500", "barn-20", "crowd-200", "complex-200"),
    ),
    Recipe(
        name="jackal",
        title="Through BARN's fields",
        description="A Jackal at up to 2 m/s, trained on 1,024 fields of pillars drawn as the BARN benchmark's are: it sees "
        "its trail, and learns gaps that it fits through lengthwise; nine minutes on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                arena=GeneratedArenaConfig(name="barn", difficulty=1.0, maps=1024, seed=0),
                robot=JackalConfig(max_linear_acceleration=20.0, max_angular_acceleration=25.0),
                lidar=LidarConfig(rays=180, field_of_view=270.0, range=10.0, mount=SingleMount(x=0.055)),
                observation=_with_trail(batches=90),
                reward=_along_the_path(-3000.0),
                control_period=0.1,
                arrival_distance=1.0,
                collision_distance=0.0,
                way_clearance=0.25,
                step_limit=500,
                arrival_ends=True,
            ),
            algorithm=_told_the_way((256, 128), entropy_coefficient=0.005, gamma=0.99),
            steps=8_000_000,
            # At the end only, as with rooms.
            evaluation=EvaluationConfig(every_steps=8_000_000),
        ),
        seed=0,
        suites=("barn-1-0.25m-200", "barn-jackal-300"),
    ),
    Recipe(
        name="people",
        title="Among people",
        description="A robot as fast as the people around it, trained on 512 scenes whose people do not see it: corridors, "
        "doors, crossings, queues and groups. It sees its last three scans; seven minutes on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                arena=GeneratedArenaConfig(name="people", difficulty=1.0, maps=512, seed=0),
                robot=RoundConfig(radius=0.25, max_linear_speed=1.0, max_angular_speed=2.0),
                lidar=LidarConfig(rays=120, field_of_view=360.0, range=6.0),
                observation=ObservationConfig.preset("improved", batches=60, frames=3),
                reward=_along_the_path(-5000.0),
                arrival_distance=0.3,
                collision_distance=0.0,
                step_limit=300,
                arrival_ends=True,
            ),
            algorithm=_told_the_way((128, 128), entropy_coefficient=0.003, gamma=0.99),
            steps=12_000_000,
            # At the end only, as with rooms.
            evaluation=EvaluationConfig(every_steps=12_000_000),
        ),
        seed=0,
        suites=("people-1-0.25m-200", "people-500", "heedless-500"),
    ),
    Recipe(
        name="crowd",
        title="Through crowds",
        description="Trained on 256 maps of easy clutter with ten pedestrians each, for places where people walk: it sees "
        "its last three scans; four minutes on one core.",
        training=TrainingConfig(
            task=TaskConfig(
                arena=GeneratedArenaConfig(name="clutter", difficulty=0.4, maps=256, seed=0, movers=MoversConfig(count=10)),
                observation=ObservationConfig.preset("improved", batches=30, frames=3),
            ),
            algorithm=PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128)), gamma=0.99, gae_lambda=0.9),
            steps=6_000_000,
            # At the end only: 200 scenarios are too few to tell its checkpoints apart, and the last are the best.
            evaluation=EvaluationConfig(every_steps=6_000_000),
        ),
        seed=0,
        suites=("clutter-0.4-10-pedestrian-200", "clutter-500", "barn-20", "crowd-200", "complex-200"),
    ),
)


def recipe(name: str) -> Recipe:
    """The recipe of that name.

    Raises:
        KeyError: there is none; the message names those that exist.
    """
    for candidate in RECIPES:
        if candidate.name == name:
            return candidate
    raise KeyError(f"no shipped policy {name!r}: choose one of {', '.join(each.name for each in RECIPES)}")
