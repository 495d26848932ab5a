"""Streams of random numbers: all that is random draws from one of its own, so that no two things share their chance.

A stream is `numpy.random.SeedSequence(seed, spawn_key=stream)`: the same seed gives independent numbers in each of them.

| stream        | what is drawn from it                                                            | seed            |
|---------------|----------------------------------------------------------------------------------|-----------------|
| `EVALUATION`  | noise and movers while a suite is driven; where the starts of a suite are clear  | always 0        |
| `ENVIRONMENT` | starts, targets, noise, disturbances and movers of a Gymnasium environment       | the environment's |
| `WEIGHTS`     | the first weights of a training                                                  | the training's  |
| `EXPLORATION` | a training's exploration, the order of its minibatches, what it replays          | the training's  |
| `MAPS`        | the pool of maps of a training whose seeds have pools of their own               | the training's  |

Within `EVALUATION` and `ENVIRONMENT` robots draw from the stream itself, movers from its child `MOVERS`.
"""

import numpy as np

Stream = tuple[int, ...]

# Never renumber: suites, their hashes and recorded evaluations were made with the first of them.
EVALUATION: Stream = ()
ENVIRONMENT: Stream = (2,)
WEIGHTS: Stream = (3,)
EXPLORATION: Stream = (4,)
MAPS: Stream = (5,)

MOVERS: Stream = (1,)
"""Child of a world's stream."""


def stream_seed(seed: int, stream: Stream, *, bits: int = 63) -> int:
    """A seed for generators that take a number and no stream.

    Args:
        seed: any non-negative integer.
        stream: one of this module's.
        bits: of the number, 1 to 64.
    """
    return int(np.random.SeedSequence(seed, spawn_key=stream).generate_state(1, np.uint64)[0]) >> (64 - bits)
