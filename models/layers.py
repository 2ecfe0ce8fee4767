"""The learned weights and the directions they answer for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.messages import FloatArray


@dataclass(frozen=True, slots=True)
class Layers:
    """The learned network: w scaled to [-1, 1], tanh layers, a linear one to K/2 + 1 support values."""

    weights: tuple[FloatArray, ...]  # each (inputs, outputs)
    biases: tuple[FloatArray, ...]


def grid_angles(grid: int) -> FloatArray:
    """(K,) the grid directions, radians from the course, clockwise."""
    angles: FloatArray = np.arange(grid, dtype=np.float64) * (2 * np.pi / grid)
    return angles


def mirrored(grid: int) -> NDArray[np.int64]:
    """(K,) which of the K/2 + 1 learned outputs serves each grid direction."""
    k = np.arange(grid)
    return np.minimum(k, grid - k)
