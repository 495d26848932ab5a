"""Types that many rooms hand around."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
PolicyFunction = Callable[[Floats], Floats]
"""Observations (n, numbers) to actions (n, A), deterministic; safe to call from another thread."""
