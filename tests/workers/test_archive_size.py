"""What a training's archives will weigh is known before it begins, and what nobody takes is refused then."""

from pathlib import Path

import pytest

from sim.config import LidarConfig, ObservationConfig, TaskConfig
from tests.workers.test_trainer import Recorder
from workers.archive_size import archive_bytes, refuse_too_large, replay_bytes
from workers.config import Algorithm, DdpgConfig, EvaluationConfig, MlpNetwork, PpoConfig, SacConfig, TrainingConfig
from workers.errors import MemoryTooLargeError
from workers.training.trainer import train

SMALL = MlpNetwork(hidden_sizes=(16,))


def wide(replay_size: int) -> TrainingConfig:
    """Observations of 8 x 126 numbers."""
    task = TaskConfig(lidar=LidarConfig(rays=360), observation=ObservationConfig.preset("improved", batches=120, frames=8))
    return TrainingConfig(task=task, algorithm=SacConfig(replay_size=replay_size))


def test_a_transition_is_its_row_and_a_quarter_of_what_followed() -> None:
    training = TrainingConfig(algorithm=DdpgConfig(robots=64, replay_size=1_000))
    # 16 vector steps of 64; 16 + 2 + 2 numbers of 4 bytes, a flag, and a quarter of the 16 that followed.
    assert replay_bytes(training) == 16 * 64 * (4 * 20 + 1 + 16)
    assert replay_bytes(TrainingConfig(algorithm=PpoConfig())) == 0


@pytest.mark.parametrize(
    "algorithm",
    [
        PpoConfig(robots=64),
        SacConfig(network=SMALL, robots=50, replay_size=3_000, warmup_steps=500, updates_per_step=1),
        DdpgConfig(robots=50, replay_size=3_000, warmup_steps=500, updates_per_step=1),
    ],
    ids=lambda algorithm: algorithm.name,
)
def test_archives_stay_within_what_was_foretold(tmp_path: Path, algorithm: Algorithm) -> None:
    config = TrainingConfig(algorithm=algorithm, steps=5_000, evaluation=EvaluationConfig(every_steps=5_000))
    train(config, 0, Recorder(), tmp_path)
    (archive,) = tmp_path.glob("*.zip")
    assert archive.stat().st_size <= archive_bytes(config)


def test_a_memory_that_fits_is_named_and_fits() -> None:
    with pytest.raises(MemoryTooLargeError, match="keep at most 104\u202f000 transitions") as refused:
        refuse_too_large(wide(200_000), 512 * 2**20)
    assert "fewer batches" in str(refused.value)
    refuse_too_large(wide(104_000), 512 * 2**20)
    refuse_too_large(TrainingConfig(algorithm=SacConfig(replay_size=2_000_000)), 512 * 2**20)


def test_no_training_begins_that_this_release_could_not_resume(tmp_path: Path) -> None:
    with pytest.raises(MemoryTooLargeError, match="2\u202f048 are taken"):
        train(wide(2_000_000), 0, Recorder(), tmp_path)
