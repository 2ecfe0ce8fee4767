"""Bounds from one water on another: coverage as it comes, with and without adaptation.

Every set is the one that stood when its forecast was made, by what the water had taught until then; what it
missed is known up to ten minutes later.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from companion.calibrate.dataset import Collector, collect
from companion.calibrate.fit import TOP_MPS, area_m2
from companion.instant import elapsed_s
from companion.messages import SPREAD_AGES_S, FloatArray, Heard, Model
from companion.picture.adaptation import Adaptation, cell_of
from companion.picture.behaviour import UNDER_WAY_MPS
from companion.picture.forecast import SORTS, Outcome
from companion.picture.learned import LearnedBounds

WARM_UP_S = 1800.0


@dataclass(frozen=True, slots=True)
class Transfer:
    """One age on the other water; NaN where nothing was scored."""

    age_s: float
    scored: int
    fixed: float  # coverage of the file's sets as they are
    adapted: float  # with adaptation, all outcomes
    scored_late: int
    adapted_late: float  # with adaptation, after the first half hour
    by_sort_late: dict[str, float]  # the same of each sort of ship under way
    area_ratio_late: float  # mean area of these over that of the water's best disc of the level; under way

    @property
    def interval_late(self) -> tuple[float, float]:
        """Wilson's 95 % interval of `adapted_late`, as if no two outcomes were of one ship."""
        return wilson(self.adapted_late, self.scored_late)


def wilson(share: float, n: int) -> tuple[float, float]:
    """The 95 % score interval of a share of n; NaN of none."""
    if n == 0:
        return math.nan, math.nan
    z2 = 1.96**2 / n
    middle, half = share + z2 / 2, math.sqrt(z2 * share * (1 - share) + z2**2 / 4)
    return (middle - half) / (1 + z2), (middle + half) / (1 + z2)


def foretold(heard: Iterable[Heard]) -> list[Outcome]:
    """What became of every forecast of recorded traffic, at the stated ages."""
    collector = Collector(SPREAD_AGES_S)
    collect(heard, collector)
    return collector.outcomes


def is_under_way(outcome: Outcome) -> bool:
    """Whether it is of a ship under way."""
    return outcome.forecast.fix.is_under_way


def is_at_rest(outcome: Outcome) -> bool:
    """Whether it is of a ship that hardly moved."""
    sog_mps = outcome.forecast.fix.sog_mps
    return sog_mps is not None and sog_mps < UNDER_WAY_MPS


def replayed(
    bounds: LearnedBounds, outcomes: list[Outcome], is_meant: Callable[[Outcome], bool] = is_under_way
) -> list[Transfer]:
    """Every outcome scored in the order it happened, one row for each stated age."""
    meant = sorted((o for o in outcomes if is_meant(o)), key=lambda o: o.at)
    if not meant:
        return [Transfer(age, 0, math.nan, math.nan, 0, math.nan, {}, math.nan) for age in SPREAD_AGES_S]
    raised = _raised_when_foretold(bounds, meant)
    scores = bounds.scores(meant)
    fixed, adapted = scores <= 0.0, scores <= raised
    late = np.array([elapsed_s(meant[0].at, o.at) >= WARM_UP_S for o in meant])
    watch, sort = np.array([(o.watch, o.forecast.sort) for o in meant]).T
    area = _areas_m2(bounds, meant, raised) if is_meant is is_under_way else np.full(len(meant), np.nan)
    off = np.array([math.hypot(o.ahead_m, o.aside_m) for o in meant])
    found = []
    for k, age in enumerate(SPREAD_AGES_S):
        at, after = watch == k, late & (watch == k)
        by_sort = {
            name: _share(adapted[after & (sort == i)])
            for i, name in enumerate(SORTS)
            if is_meant is is_under_way and (after & (sort == i)).any()
        }
        disc_m2 = math.pi * np.quantile(off[after], bounds.level) ** 2 if after.any() else math.nan
        found.append(
            Transfer(
                age,
                int(at.sum()),
                _share(fixed[at]),
                _share(adapted[at]),
                int(after.sum()),
                _share(adapted[after]),
                by_sort,
                float(area[after].mean()) / disc_m2 if after.any() else math.nan,
            )
        )
    return found


def _raised_when_foretold(bounds: LearnedBounds, outcomes: list[Outcome]) -> FloatArray:
    """(n,) what was added to the logarithm of each set when its forecast was made."""
    adaptation = Adaptation(bounds)
    raised = np.zeros(len(outcomes))
    scored = 0
    for i in sorted(range(len(outcomes)), key=lambda i: outcomes[i].forecast.fix.at):
        foretold = outcomes[i]
        while outcomes[scored].at <= foretold.forecast.fix.at:  # in the order they came
            adaptation.take(outcomes[scored])
            scored += 1
        sort, k = cell_of(foretold)
        raised[i] = adaptation.raised_of([sort], [foretold.mmsi])[0, k]
    return raised


def _areas_m2(bounds: LearnedBounds, outcomes: list[Outcome], raised: FloatArray) -> FloatArray:
    """(n,) areas of the sets of ships under way."""
    features = np.array([o.forecast.features for o in outcomes])
    sog = np.array([o.forecast.fix.sog_mps or 0.0 for o in outcomes])
    everywhere = np.repeat(raised[:, None], len(SPREAD_AGES_S), axis=1)
    half = bounds.spread_m(bounds.log_scale(features), everywhere, sog, np.maximum(TOP_MPS, sog + 0.25))
    at_age = half[np.arange(len(outcomes)), [o.watch for o in outcomes]]
    return area_m2(at_age, "kite" if bounds.model is Model.KITE else "box")


def _share(held: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> float:
    return float(held.mean()) if len(held) else math.nan
