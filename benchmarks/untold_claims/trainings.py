"""The experiments' trainings, in a campaign's directory: begun, continued where they were interrupted, or found done."""

from pathlib import Path

import numpy as np

from workers.config import TrainingConfig
from workers.reproduction.recorder import evaluations, read_records
from workers.reproduction.results import SeedResult
from workers.reproduction.training import train_in
from workers.start import StartFrom


class Trainings:
    """Trains what is asked for and is not there yet.

    Args:
        directory: of a campaign, or an empty one.
        seeds: 0 to this less one.
    """

    def __init__(self, directory: Path, seeds: int) -> None:
        self.directory, self.seeds = directory, seeds

    def trained(self, name: str, training: TrainingConfig) -> list[SeedResult]:
        """A training with every seed."""
        return [self._one(name, training, seed) for seed in range(self.seeds)]

    def changed(self, name: str, training: TrainingConfig, before: str) -> None:
        """A training that begins with what `before` has learned elsewhere, with every seed."""
        for seed in range(self.seeds):
            archive = self.archive(before, seed)
            start = StartFrom(source="file", name=f"{before}, seed {seed}")
            self._one(name, training.model_copy(update={"start_from": start}), seed, archive)

    def archive(self, name: str, seed: int) -> Path:
        """The last checkpoint of a training."""
        (archive,) = self._folder(name, seed).glob("step-*.zip")
        return archive

    def learned(self, name: str, within: int, every: int) -> list[float]:
        """Mean success on the frozen suite over the evaluations of the first steps, one in so many, by seed."""
        means = []
        for seed in range(self.seeds):
            steps, rates = evaluations(read_records(self._folder(name, seed)))
            looked = [rate for step, rate in zip(steps, rates, strict=True) if step > 0][: within // every]
            assert len(looked) == within // every, f"{name} was evaluated {len(looked)} times"
            means.append(float(np.mean(looked)))
        return means

    def at_first(self, name: str) -> list[float]:
        """Success on the frozen suite before anything is learned, by seed."""
        return [evaluations(read_records(self._folder(name, seed)))[1][0] for seed in range(self.seeds)]

    def _one(self, name: str, training: TrainingConfig, seed: int, start: Path | None = None) -> SeedResult:
        print(f"{name}, seed {seed}", flush=True)
        trained = train_in(self._folder(name, seed), training, seed, start=start)
        assert trained is not None, "nobody asks it to stop"
        return trained.result

    def _folder(self, name: str, seed: int) -> Path:
        return self.directory / name / f"seed-{seed}"
