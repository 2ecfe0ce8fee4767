"""Proven bounds of the learned mean cosine: interval arithmetic, mean-value form, branch and bound.

For a cell of sweeps with middle m and half widths r, f = T^ - T,

    f(z) is within  f(m) +- sum_i r_i |f_i(m)| + 1/2 sum_ij r_i r_j max over the cell of |f_ij|

The second derivatives of the network are enclosed by interval arithmetic over the cell.  Those of the
teacher, T_ij = - integral over [0, 1] of t_i t_j cos(x + (y - x) t), t_i = 1 - t or t, rise with x and y:
their values at a cell's two corners bound them.
"""

from dataclasses import dataclass

import numpy as np

from companion.errors import ModelError
from companion.messages import FloatArray
from models.layers import Layers

HALF = np.pi / 2
ROUNDING = 1e-12
FIRST_CELLS = 64
MOST_CELLS = 4_000_000
CHUNK = 20_000
NODE, WEIGHT = np.polynomial.legendre.leggauss(10)  # exact to 1e-14 for a quarter of a cosine
SERIES_RAD = 1e-3  # half sweeps narrower than this by series


@dataclass(frozen=True, slots=True)
class Enclosure:
    """Bounds of learned minus true mean cosine over all sweeps 0 <= x <= y <= pi/2."""

    low: float
    high: float
    cells: int


def enclose(layers: Layers, width: float) -> Enclosure:
    """Quarter the cells that are not yet known within `width`."""
    side = np.arange(FIRST_CELLS) * (HALF / FIRST_CELLS)
    x, y = (v.ravel() for v in np.meshgrid(side, side))
    keep = x <= y
    low, high, done = np.inf, -np.inf, 0
    corner, size = np.column_stack((x[keep], y[keep])), HALF / FIRST_CELLS
    while len(corner):
        if len(corner) > MOST_CELLS:
            raise ModelError(
                "the learned mean cosine cannot be enclosed: its weights swing too wide; "
                "train it with another seed"
            )
        wide = []
        for part in np.array_split(corner, -(-len(corner) // CHUNK)):
            value, slope = error(layers, part + size / 2)
            bend = curvature(layers, part, part + size)
            radius = np.abs(slope).sum(axis=1) * size / 2 + bend * size * size / 8 + ROUNDING
            settled = radius <= width / 2
            low = min(low, float((value - radius)[settled].min(initial=np.inf)))
            high = max(high, float((value + radius)[settled].max(initial=-np.inf)))
            done += int(settled.sum())
            wide.append(part[~settled])
        size /= 2
        steps = size * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
        corner = (np.concatenate(wide)[:, None] + steps).reshape(-1, 2)
        corner = corner[corner[:, 0] <= corner[:, 1] + size]
    return Enclosure(low, high, done)


def forward(layers: Layers, x: FloatArray, y: FloatArray) -> FloatArray:
    """(m,) the network in float64."""
    layer = np.tanh(np.column_stack((x, y)) @ layers.weights[0] + layers.biases[0])
    return np.asarray((layer @ layers.weights[1] + layers.biases[1])[:, 0])


def teacher(x: FloatArray, y: FloatArray) -> FloatArray:
    """(m,) mean of the cosine over [x, y]."""
    return np.asarray(np.cos((x + y) / 2) * np.sinc((y - x) / 2 / np.pi))


def error(layers: Layers, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m,) learned minus true, and its derivatives (m, 2), at sweeps (m, 2)."""
    x, y = at.T
    inner, outer = layers.weights[0], layers.weights[1][:, 0]
    layer = np.tanh(at @ inner + layers.biases[0])
    slope = ((1 - layer * layer) * outer) @ inner.T
    middle, half = (x + y) / 2, (y - x) / 2
    narrow = np.abs(half) < SERIES_RAD
    safe = np.where(narrow, 1.0, half)
    sinc = np.sinc(half / np.pi)
    sinc_slope = np.where(narrow, -half / 3 + half**3 / 30, (np.cos(safe) - np.sin(safe) / safe) / safe)
    by_middle, by_half = -np.sin(middle) * sinc / 2, np.cos(middle) * sinc_slope / 2
    true_slope = np.column_stack((by_middle - by_half, by_middle + by_half))
    return layer @ outer + layers.biases[1][0] - np.cos(middle) * sinc, slope - true_slope


def curvature(layers: Layers, low: FloatArray, high: FloatArray) -> FloatArray:
    """(m,) sum over i, j of the greatest |second derivative| of the error over cells [low, high] (m, 2)."""
    inner, outer = layers.weights[0], layers.weights[1][:, 0]
    up, down = np.maximum(inner, 0), np.minimum(inner, 0)
    z_low, z_high = low @ up + high @ down + layers.biases[0], high @ up + low @ down + layers.biases[0]
    bend_low, bend_high = _tanh_curvature(np.tanh(z_low), np.tanh(z_high))
    least_true, most_true = true_curvature(low), true_curvature(high)
    total = np.zeros(len(low))
    for k, (i, j, times) in enumerate(((0, 0, 1), (1, 1, 1), (0, 1, 2))):
        factor = outer * inner[i] * inner[j]
        plus, minus = np.maximum(factor, 0), np.minimum(factor, 0)
        least_bend, most_bend = bend_low @ plus + bend_high @ minus, bend_high @ plus + bend_low @ minus
        least, most = least_bend - most_true[k], most_bend - least_true[k]
        total += times * np.maximum(np.abs(least), np.abs(most))
    return total


def true_curvature(at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(m,) second derivatives of the teacher by xx, yy and xy at sweeps (m, 2), by Gauss's rule."""
    share, weight = (NODE + 1) / 2, WEIGHT / 2
    cos = np.cos(at[:, :1] + (at[:, 1:] - at[:, :1]) * share)
    rest = 1 - share
    return -cos @ (weight * rest * rest), -cos @ (weight * share * share), -cos @ (weight * share * rest)


def _tanh_curvature(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds of tanh'' = -2 t (1 - t^2) for t in [low, high]; its extremes lie at t = +-1/sqrt 3."""
    at_low, at_high = -2 * low * (1 - low * low), -2 * high * (1 - high * high)
    crest, most = 1 / np.sqrt(3), 4 / (3 * np.sqrt(3))
    least_bend, most_bend = np.minimum(at_low, at_high), np.maximum(at_low, at_high)
    least_bend = np.where((low <= crest) & (high >= crest), -most, least_bend)
    most_bend = np.where((low <= -crest) & (high >= -crest), most, most_bend)
    return least_bend, most_bend
