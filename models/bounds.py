"""Proven bounds of the learned support: mean-value form over intervals, refined until tight.

For each cell of course noise [a, b] with middle m, and each grid direction,

    N^(w) - N(w)  is within  N^(m) - N(m) +- (b - a)/2 * max over the cell of |N^'(w) - N'(w)|

The derivative of the network is enclosed by interval arithmetic through its layers; that of the
teacher is sin(max(beta - w, 0)).  Everything in float64, widened by `ROUNDING`.
"""

from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray
from models.layers import Layers, grid_angles

ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Enclosure:
    """Bounds of learned minus true support, per metre of reach, over the whole range."""

    low: FloatArray  # (K/2 + 1,)
    high: FloatArray
    cells: int


def enclose(layers: Layers, grid: int, course_noise_max_rad: float, width: float) -> Enclosure:
    """Halve the cells that are not yet known within `width` (per metre of reach)."""
    outputs = grid // 2 + 1
    low, high = np.full(outputs, np.inf), np.full(outputs, -np.inf)
    open_cells = np.linspace(0.0, course_noise_max_rad, 129)
    a, b, done = open_cells[:-1], open_cells[1:], 0
    while a.size:
        middle = 0.5 * (a + b)
        value = forward(layers, middle, course_noise_max_rad) - teacher(middle, grid)
        slope_low, slope_high = slope_bounds(layers, a, b, course_noise_max_rad)
        true_low, true_high = teacher_slope(a, b, grid)
        steep = np.maximum(np.abs(slope_low - true_high), np.abs(slope_high - true_low))
        radius = steep * (b - a)[:, None] / 2 + ROUNDING
        settled = (radius <= width / 2).all(axis=1)
        low = np.minimum(low, (value - radius)[settled].min(axis=0, initial=np.inf))
        high = np.maximum(high, (value + radius)[settled].max(axis=0, initial=-np.inf))
        done += int(settled.sum())
        a, b, middle = a[~settled], b[~settled], middle[~settled]
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    return Enclosure(low, high, done)


def forward(layers: Layers, course_noise_rad: FloatArray, course_noise_max_rad: float) -> FloatArray:
    """(m, K/2 + 1) the network in float64."""
    value = 2 * course_noise_rad[:, None] / course_noise_max_rad - 1
    for weight, bias in zip(layers.weights[:-1], layers.biases[:-1], strict=True):
        value = np.tanh(value @ weight + bias)
    return np.asarray(value @ layers.weights[-1] + layers.biases[-1])


def teacher(course_noise_rad: FloatArray, grid: int) -> FloatArray:
    """(m, K/2 + 1) the true support per metre of reach."""
    angles = grid_angles(grid)[: grid // 2 + 1]
    return np.asarray(np.cos(np.maximum(angles - course_noise_rad[:, None], 0.0)))


def teacher_slope(a: FloatArray, b: FloatArray, grid: int) -> tuple[FloatArray, FloatArray]:
    """(m, K/2 + 1) twice: least and greatest of the teacher's derivative over cells [a, b]."""
    angles = grid_angles(grid)[: grid // 2 + 1]
    from_a, from_b = angles - a[:, None], angles - b[:, None]
    at_a, at_b = np.sin(np.maximum(from_a, 0.0)), np.sin(np.maximum(from_b, 0.0))
    crest = (from_b <= np.pi / 2) & (from_a >= np.pi / 2)
    return np.minimum(at_a, at_b), np.where(crest, 1.0, np.maximum(at_a, at_b))


def slope_bounds(
    layers: Layers, a: FloatArray, b: FloatArray, course_noise_max_rad: float
) -> tuple[FloatArray, FloatArray]:
    """(m, K/2 + 1) twice: least and greatest derivative of the network over cells [a, b]."""
    scale = 2 / course_noise_max_rad
    low, high = scale * a[:, None] - 1, scale * b[:, None] - 1
    rise_low = rise_high = np.full_like(low, scale)
    for weight, bias in zip(layers.weights[:-1], layers.biases[:-1], strict=True):
        low, high = interval_product(low, high, weight)
        low, high = low + bias, high + bias
        rise_low, rise_high = interval_product(rise_low, rise_high, weight)
        # tanh' = 1 - tanh^2 falls with |z|
        least = 1 - np.tanh(np.maximum(np.abs(low), np.abs(high))) ** 2
        greatest = (
            1 - np.tanh(np.where((low < 0) & (high > 0), 0.0, np.minimum(np.abs(low), np.abs(high)))) ** 2
        )
        corners = [rise_low * least, rise_low * greatest, rise_high * least, rise_high * greatest]
        rise_low, rise_high = np.minimum.reduce(corners), np.maximum.reduce(corners)
        low, high = np.tanh(low), np.tanh(high)
    return interval_product(rise_low, rise_high, layers.weights[-1])


def interval_product(low: FloatArray, high: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds of x @ weight for x between `low` and `high`."""
    up, down = np.maximum(weight, 0), np.minimum(weight, 0)
    return low @ up + high @ down, high @ up + low @ down
