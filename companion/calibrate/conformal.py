"""Split-conformal quantiles, grouped by vessel: no ship is ever scored by scales it helped to fit.

The vessels are dealt into folds; each fold's outcomes are scored by scales fitted on the others, and the
quantile is taken over all those scores.  The scales that go into the file are fitted on all vessels: they
are a little better than those scored.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.calibrate.dataset import Dataset
from companion.calibrate.fit import Scales, Shape, fit
from companion.messages import SPREAD_AGES_S, FloatArray, IntArray

FOLDS = 5
FEW = 1000  # outcomes of an age that suffice
KS = range(len(SPREAD_AGES_S))


@dataclass(frozen=True, slots=True)
class Calibration:
    """Scales and the scores of vessels that they were not fitted on."""

    scales: Scales
    scores: tuple[FloatArray, ...]  # per stated age
    scores_around: tuple[FloatArray, ...]  # of outcomes somewhat younger and older too
    vessels: tuple[int, ...]

    def quantile(self, k: int, level: float) -> float:
        """What the k-th stated age needs; infinite where nothing was recorded.

        The fewer outcomes there are of that age, the more it leans on those around it.
        """
        if len(self.scores[k]) == 0:
            return float("inf")
        own, around = quantile(self.scores[k], level), quantile(self.scores_around[k], level)
        weight = min(len(self.scores[k]) / FEW, 1.0)
        return own if weight == 1.0 else weight * own + (1 - weight) * around


def quantile(values: FloatArray, level: float) -> float:
    """The smallest value that a share `level` of n + 1 exchangeable ones does not exceed."""
    rank = math.ceil((len(values) + 1) * level)
    return float("inf") if rank > len(values) else float(np.partition(values, rank - 1)[rank - 1])


def folds_of(vessels: IntArray, rng: np.random.Generator, count: int = FOLDS) -> list[IntArray]:
    """The vessels dealt into folds."""
    shuffled = rng.permutation(vessels)
    return [shuffled[i::count] for i in range(count)]


def calibrate(data: Dataset, shape: Shape, rng: np.random.Generator) -> Calibration:
    """Scales fitted on all of `data`, and scores by vessels left out."""
    scores: list[list[FloatArray]] = [[] for _ in KS]
    around: list[list[FloatArray]] = [[] for _ in KS]
    for fold in folds_of(np.unique(data.vessel), rng):
        held = np.isin(data.vessel, fold)
        left_out = fit(data.only(~held), shape)
        for k in KS:
            scores[k].append(left_out.score(data.only(held).at(k), k))
            around[k].append(left_out.score(data.only(held).around(k), k))
    return Calibration(
        fit(data, shape),
        tuple(np.concatenate(s) for s in scores),
        tuple(np.concatenate(s) for s in around),
        tuple(len(np.unique(data.at(k).vessel)) for k in KS),
    )
