"""Split-conformal quantiles, grouped by vessel: no ship is ever scored by scales it helped to fit.

The vessels are dealt into folds; each fold's outcomes are scored by scales fitted on the others, and the
quantile is taken over all those scores.  The scales that go into the file are fitted on all vessels: they
are a little better than those scored.

One ship's outcomes are alike, so a ship not seen is worse served than the number of outcomes says.  The rank
of the quantile is therefore such that, on average, each vessel is covered as wanted by the others' scores.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.calibrate.dataset import Dataset
from companion.calibrate.fit import Scales, Shape, fit
from companion.messages import SPREAD_AGES_S, FloatArray, IntArray

FOLDS = 5
FEW = 600  # outcomes of an age that suffice
KS = range(len(SPREAD_AGES_S))


@dataclass(frozen=True, slots=True)
class Calibration:
    """Scales and the scores of vessels that they were not fitted on."""

    scales: Scales
    scores: tuple[FloatArray, ...]  # per stated age
    scores_around: tuple[FloatArray, ...]  # of outcomes somewhat younger and older too
    vessels: tuple[IntArray, ...]  # whose the scores are
    vessels_around: tuple[IntArray, ...]

    def quantile(self, k: int, level: float) -> float:
        """What the k-th stated age needs; infinite where nothing was recorded.

        The fewer outcomes there are of that age, the more it leans on those around it.
        """
        if len(self.scores[k]) == 0:
            return float("inf")
        own = of_others(self.scores[k], self.vessels[k], level)
        around = of_others(self.scores_around[k], self.vessels_around[k], level)
        weight = min(len(self.scores[k]) / FEW, 1.0)
        return own if weight == 1.0 else weight * own + (1 - weight) * around


def quantile(values: FloatArray, level: float) -> float:
    """The smallest value that a share `level` of n + 1 exchangeable ones does not exceed."""
    rank = math.ceil((len(values) + 1) * level)
    return float("inf") if rank > len(values) else float(np.partition(values, rank - 1)[rank - 1])


def of_others(values: FloatArray, vessels: IntArray, level: float) -> float:
    """The quantile whose rank leaves a share `level` of all values within that of the other vessels."""
    order = np.argsort(values, kind="stable")
    whose = np.unique(vessels, return_inverse=True)[1][order]
    by_vessel = np.argsort(whose, kind="stable")  # in it each vessel's values are in a row, smallest first
    count = np.bincount(whose)
    own_before = np.empty_like(order)
    own_before[by_vessel] = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
    others = len(order) - count[whose]
    # a value is inside when the level is above this share of the others
    needed = (np.arange(len(order)) - own_before) / (others + 1)
    return quantile(values, min(max(quantile(needed, level), level), 1.0))


def folds_of(vessels: IntArray, rng: np.random.Generator, count: int = FOLDS) -> list[IntArray]:
    """The vessels dealt into folds."""
    shuffled = rng.permutation(vessels)
    return [shuffled[i::count] for i in range(count)]


def calibrate(data: Dataset, shape: Shape, rng: np.random.Generator) -> Calibration:
    """Scales fitted on all of `data`, and scores by vessels left out."""
    scores: list[list[FloatArray]] = [[] for _ in KS]
    around: list[list[FloatArray]] = [[] for _ in KS]
    vessels: list[list[IntArray]] = [[] for _ in KS]
    vessels_around: list[list[IntArray]] = [[] for _ in KS]
    for fold in folds_of(np.unique(data.vessel), rng):
        held = np.isin(data.vessel, fold)
        left_out = fit(data.only(~held), shape)
        for k in KS:
            at, near = data.only(held).at(k), data.only(held).around(k)
            scores[k].append(left_out.score(at, k))
            around[k].append(left_out.score(near, k))
            vessels[k].append(at.vessel)
            vessels_around[k].append(near.vessel)
    return Calibration(
        fit(data, shape),
        tuple(np.concatenate(s) for s in scores),
        tuple(np.concatenate(s) for s in around),
        tuple(np.concatenate(v) for v in vessels),
        tuple(np.concatenate(v) for v in vessels_around),
    )
