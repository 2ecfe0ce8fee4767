"""Fits the scales of `picture.learned`: least mean size of the sets at a given share inside.

The loss is, over the stated ages, the logarithm of the mean size plus the logarithm of the quantile that the
level needs, size being the square root of the area; it is invariant to the unit of the scales and
differentiable but for the quantile, whose gradient is taken as the mean over the outcomes near it.  Adam on
some hundred numbers, ridge on the weights and on how they change with the age, and a second ridge that keeps
the three sides alike.  Since the loss leaves the unit open, every fit is brought to the same mean area: only
then are scores by fits on different vessels comparable.  All constants were chosen on splits by vessel.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from companion.calibrate.dataset import Dataset
from companion.messages import SPREAD_AGES_S, FloatArray
from companion.picture.learned import GROWTH, TREND, limited

FIT_LEVEL = 0.96
STEPS, RATE, BANDWIDTH = 200, 0.04, 0.25
RIDGE, SLOPE_RIDGE, ALIKE = 0.1, 0.2, 0.05
POWER = 0.5  # mean size, not area: shuttles get larger sets, and five in a hundred more of them are inside
MEAN_AREA = 4.0  # m2 for each square second of age: what sizes before the quantile come to
OFFSET_M = 3.0  # what nobody's bounds need to resolve
TOP_MPS = 16.0
Shape = Literal["kite", "box"]


@dataclass(frozen=True, slots=True)
class Scales:
    """The fitted numbers, as in the bounds file."""

    mean: FloatArray  # (F,)
    deviation: FloatArray
    weights: FloatArray  # (3, F)
    slopes: FloatArray  # (3, F), by which the weights grow with `TREND` of the age
    base: FloatArray  # (3, K)
    shape: Shape

    def log(self, features: FloatArray, k: int) -> FloatArray:
        """(3, n) natural logarithms of the scales."""
        x = np.clip((features - self.mean) / self.deviation, -4.0, 4.0)
        return np.asarray((self.weights + TREND[k] * self.slopes) @ x.T + self.base[:, k : k + 1])

    def score(self, data: Dataset, k: int) -> FloatArray:
        """(n,) how far out the outcomes of the k-th stated age are; infinite beyond any ship's reach."""
        log_scale, out = self.log(data.features, k), sides_m(data, k)
        ratio = out / np.exp(log_scale)
        whole = ratio.sum(axis=0) if self.shape == "kite" else ratio.max(axis=0)
        limit = limited(np.full((len(data), len(SPREAD_AGES_S), 3), np.inf), data.sog_mps, top_mps(data))
        beyond = (out > limit[:, k].T).any(axis=0)
        return np.where(beyond, np.inf, np.log(np.maximum(whole, 1e-6)))

    def half_m(self, data: Dataset, k: int, quantile: float) -> FloatArray:
        """(n, 3) half sizes of the sets."""
        half = np.exp(np.minimum(self.log(data.features, k) + quantile, 20.0)).T
        whole = np.repeat(half[:, None], len(SPREAD_AGES_S), axis=1)
        return np.asarray(limited(whole, data.sog_mps, top_mps(data))[:, k])

    def is_inside(self, data: Dataset, k: int, quantile: float) -> FloatArray:
        """(n,) 1 where the outcome is in its set, 0 where not."""
        half, out = self.half_m(data, k, quantile), sides_m(data, k).T
        whole = (out / half).sum(axis=1) if self.shape == "kite" else (out / half).max(axis=1)
        return np.asarray(whole <= 1.0, dtype=np.float64)


def top_mps(data: Dataset) -> FloatArray:
    """(n,) the most each ship is ever taken to do."""
    return np.maximum(TOP_MPS, data.sog_mps + 0.25)


def sides_m(data: Dataset, k: int) -> FloatArray:
    """(3, n) how far ahead, astern and abeam, brought to the k-th stated age."""
    grown = (data.age_s / SPREAD_AGES_S[k]) ** GROWTH
    return (
        np.stack((np.maximum(data.ahead_m, 0.0), np.maximum(-data.ahead_m, 0.0), abs(data.aside_m))) / grown
    )


def area_m2(half_m: FloatArray, shape: Shape) -> FloatArray:
    """(n,) areas of the sets without hull and position error."""
    box = (half_m[:, 0] + half_m[:, 1]) * 2 * half_m[:, 2]
    return np.asarray(box / 2 if shape == "kite" else box)


def fit(data: Dataset, shape: Shape) -> Scales:
    """The scales with the least loss on `data`."""
    parts = [data.around(k) for k in range(len(SPREAD_AGES_S))]
    features = np.concatenate([part.features for part in parts])
    mean, deviation = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-3)
    inputs = [np.clip((part.features - mean) / deviation, -4.0, 4.0) for part in parts]
    logs = [np.log(sides_m(part, k) + OFFSET_M) for k, part in enumerate(parts)]
    ages = [k for k, part in enumerate(parts) if len(part) >= 20]
    base = np.stack([_first_guess(logs[k] if k in ages else None, k) for k in range(len(parts))], axis=1)
    weights = slopes = np.zeros((3, features.shape[1]))
    numbers = np.concatenate((weights.ravel(), slopes.ravel(), base.ravel()))
    first, second = np.zeros_like(numbers), np.zeros_like(numbers)
    for step in range(1, STEPS + 1):
        weights, slopes, base = _unpacked(numbers, weights.shape, base.shape)
        by_weight, by_slope, by_base = np.zeros_like(weights), np.zeros_like(slopes), np.zeros_like(base)
        for k in ages:
            log_scale = (weights + TREND[k] * slopes) @ inputs[k].T + base[:, k : k + 1]
            down = _slope(log_scale, logs[k], shape)
            by_weight += down @ inputs[k] / len(ages)
            by_slope += TREND[k] * (down @ inputs[k]) / len(ages)
            by_base[:, k] = down.sum(axis=1)
        by_weight += 2 * RIDGE * weights + 2 * ALIKE * (weights - weights.mean(axis=0))
        by_slope += 2 * SLOPE_RIDGE * slopes + 2 * ALIKE * (slopes - slopes.mean(axis=0))
        slope = np.concatenate((by_weight.ravel(), by_slope.ravel(), by_base.ravel()))
        first, second = 0.9 * first + 0.1 * slope, 0.99 * second + 0.01 * slope**2
        rate = RATE if step < 0.6 * STEPS else RATE / 4
        numbers = numbers - rate * (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.99**step)) + 1e-8)
    weights, slopes, base = _unpacked(numbers, weights.shape, base.shape)
    for k in ages:
        log_scale = (weights + TREND[k] * slopes) @ inputs[k].T + base[:, k : k + 1]
        base[:, k] += 0.5 * np.log(
            MEAN_AREA * SPREAD_AGES_S[k] ** 2 / area_m2(np.exp(log_scale).T, shape).mean()
        )
    return Scales(mean, deviation, weights, slopes, base, shape)


def _first_guess(logs: FloatArray | None, k: int) -> FloatArray:
    if logs is None or logs.shape[1] == 0:
        return np.full(3, np.log(0.5 * SPREAD_AGES_S[k] + OFFSET_M))
    return np.asarray(np.quantile(logs, 0.97, axis=1))


def _unpacked(
    numbers: FloatArray, weights: tuple[int, ...], base: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    cut = weights[0] * weights[1]
    return (
        numbers[:cut].reshape(weights),
        numbers[cut : 2 * cut].reshape(weights),
        numbers[2 * cut :].reshape(base),
    )


def _slope(log_scale: FloatArray, logs: FloatArray, shape: Shape) -> FloatArray:
    """(3, n) derivative of the loss by each logarithm of a scale."""
    ratio = np.exp(logs - log_scale)
    if shape == "kite":
        share = ratio / ratio.sum(axis=0)
        score = np.log(ratio.sum(axis=0))
    else:
        share = (ratio == ratio.max(axis=0)).astype(np.float64)
        score = np.log(ratio.max(axis=0))
    near = np.exp(-0.5 * ((score - np.quantile(score, FIT_LEVEL)) / BANDWIDTH) ** 2)
    near /= near.sum()
    scale = np.exp(log_scale)
    length = scale[0] + scale[1]
    area = (length * scale[2]) ** POWER
    area = POWER * area / area.sum()
    ahead = scale[0] / length
    return np.asarray(np.stack((area * ahead, area * (1 - ahead), area)) - 2 * POWER * near * share)
