"""PPO's minibatches on a CUDA device, each as one recorded graph.

A small network's minibatch is hundreds of kernels of microseconds: to launch them takes longer than to compute them. The
graph holds the launches, and reads what differs from minibatch to minibatch from tensors that stay where they are.
"""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from workers.algorithms.flat import FlatAdam
from workers.algorithms.gradients.ppo import PpoGradients
from workers.algorithms.storage.rollout import Samples

_WARM_UPS = 3
"""Rounds before a recording: libraries choose their kernels and allocate in the first ones."""


class GraphedMinibatches:
    """Gradients, clipping and a step of Adam for one minibatch after another.

    Args:
        gradients: of a network whose lines are tensors' alone: it may not look at a number on the way.
        optimizer: of the networks, on a CUDA device.
        max_norm: of each module's gradient.
    """

    def __init__(self, gradients: PpoGradients, optimizer: FlatAdam, max_norm: float) -> None:
        self._gradients, self._optimizer, self._max_norm = gradients, optimizer, max_norm
        self._graph: torch.cuda.CUDAGraph | None = None
        self._samples: Samples
        self._rows: Tensor
        self._rates = optimizer.values.new_ones(2)
        self._totals = torch.zeros(4, dtype=torch.float64, device=optimizer.values.device)

    def learn(self, samples: Samples, minibatches: Sequence[Tensor], after_each: Callable[[], object]) -> Tensor:
        """One step for each minibatch; the sums (4,) of what `PpoGradients` returns.

        Args:
            samples: a rollout's, always as many.
            minibatches: rows of the samples; those shaped as the first of all are replayed, others computed as they are.
            after_each: what follows every step.
        """
        if self._graph is None:
            self._graph = self._record(samples, minibatches[0])
        for mine, theirs in zip(self._samples, samples, strict=True):
            if mine.data_ptr() != theirs.data_ptr():
                mine.copy_(theirs)
        rates = self._rates.new_tensor([self._optimizer.next_rates() for _ in minibatches])
        self._totals.zero_()
        for rows, its_rates in zip(minibatches, rates, strict=True):
            self._rates.copy_(its_rates)
            if rows.shape == self._rows.shape:
                self._rows.copy_(rows)
                self._graph.replay()
            else:
                self._step(rows)
            after_each()
        return self._totals

    def _step(self, rows: Tensor) -> None:
        self._totals += self._gradients(self._samples, rows)
        self._optimizer.clip_gradients(self._max_norm)
        self._optimizer.step_by(*self._rates)

    def _record(self, samples: Samples, rows: Tensor) -> torch.cuda.CUDAGraph:
        """Leaves parameters and moments as they were."""
        self._samples, self._rows = samples, rows.clone()
        vectors = self._optimizer.vectors
        before = [vector.clone() for vector in vectors]
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):
            for _ in range(_WARM_UPS):
                self._step(self._rows)
        torch.cuda.current_stream().wait_stream(aside)
        for vector, values in zip(vectors, before, strict=True):
            vector.copy_(values)
        graph = torch.cuda.CUDAGraph()
        # Other threads may use the device meanwhile, as a live view does.
        with torch.cuda.graph(graph, capture_error_mode="thread_local"):
            self._step(self._rows)
        return graph
