"""How well the bounds hold on vessels never used, by repeated splits; and what the rivals need or lose.

The vessels are dealt into quarters, again and again; every split sets one quarter aside, calibrates on the
others, and measures on those set aside.  Every vessel is set aside equally often: half of all large errors
are one or two ships', and how often these were drawn would be all that a figure showed.  Measured: coverage
and mean area of the learned sets, of the best single disc around the straight prediction with the
same level, and of a disc that the same features scale.  Areas are of the antenna's set: hull and position
error come on top of any of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from companion.calibrate.conformal import KS, calibrate, folds_of, quantile
from companion.calibrate.dataset import Dataset
from companion.calibrate.fit import Shape, area_m2
from companion.messages import SPREAD_AGES_S, FloatArray, IntArray
from companion.picture.forecast import SORTS

QUARTERS = 4
PEER_RADIUS_M = 185.2  # 0.1 nautical miles: a generous safety circle around a point


@dataclass(frozen=True, slots=True)
class Figure:
    """One age and level, over all splits: shares and mean areas weighted by outcomes."""

    age_s: float
    level: float
    outcomes: int
    coverage: float
    by_split: tuple[float, ...]
    by_sort: dict[str, tuple[float, float, int]]  # coverage, area in km2, outcomes
    area_km2: float
    disc_area_km2: float  # calibrated on the same vessels
    disc_coverage: float
    level_disc_km2: float  # the disc that holds exactly `level` of all recorded outcomes
    equal_disc_km2: float  # the disc that holds as many of them as these sets did

    @property
    def ratio(self) -> float:
        """Mean area over that of the best single disc of equal coverage."""
        return self.area_km2 / self.equal_disc_km2

    @property
    def ratio_to_level(self) -> float:
        """Mean area over that of the best single disc of the level wanted, however much these sets held."""
        return self.area_km2 / self.level_disc_km2


def figures(
    data: Dataset, shape: Shape, levels: tuple[float, ...], splits: int, rng: np.random.Generator
) -> list[Figure]:
    """The figures of every stated age and level."""
    rows: dict[tuple[int, float], list[tuple[FloatArray, ...]]] = {}
    vessels = np.unique(data.vessel[data.under_way])
    for _, unseen in zip(range(splits), _dealt(vessels, rng), strict=False):
        is_unseen = np.isin(data.vessel, unseen)
        seen = data.only(~is_unseen)
        found = calibrate(seen, shape, rng)
        for k in KS:
            test, known = data.only(is_unseen).at(k), seen.at(k)
            for level in levels:
                q = found.quantile(k, level)
                half = found.scales.half_m(test, k, q)
                radius = _disc_m(known, level)
                strayed = np.hypot(test.ahead_m, test.aside_m)
                rows.setdefault((k, level), []).append(
                    (
                        found.scales.is_inside(test, k, q),
                        area_m2(half, shape),
                        (strayed <= radius).astype(np.float64),
                        np.full(len(test), np.pi * radius**2),
                        test.sort.astype(np.float64),
                    )
                )
    return [_figure(data, k, level, parts) for (k, level), parts in sorted(rows.items())]


def _dealt(vessels: IntArray, rng: np.random.Generator) -> Iterator[IntArray]:
    """Quarters of the vessels, without end; four in a row are all vessels."""
    while True:
        yield from folds_of(vessels, rng, QUARTERS)


def _figure(data: Dataset, k: int, level: float, parts: list[tuple[FloatArray, ...]]) -> Figure:
    inside, area, disc_inside, disc_area, sort = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    every = data.at(k)
    off_m = np.hypot(every.ahead_m, every.aside_m)
    level_m, equal_m = np.quantile(off_m, (level, _mean(inside))) if len(every) else (np.nan, np.nan)
    by_sort = {
        name: (float(inside[sort == i].mean()), float(area[sort == i].mean()) / 1e6, int((sort == i).sum()))
        for i, name in enumerate(SORTS)
        if (sort == i).any()
    }
    return Figure(
        age_s=SPREAD_AGES_S[k],
        level=level,
        outcomes=len(inside),
        coverage=_mean(inside),
        by_split=tuple(float(part[0].mean()) for part in parts if len(part[0])),
        by_sort=by_sort,
        area_km2=_mean(area) / 1e6,
        disc_area_km2=_mean(disc_area) / 1e6,
        disc_coverage=_mean(disc_inside),
        level_disc_km2=float(np.pi * level_m**2 / 1e6),
        equal_disc_km2=float(np.pi * equal_m**2 / 1e6),
    )


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if len(values) else float("nan")


def _disc_m(data: Dataset, level: float) -> float:
    return quantile(np.hypot(data.ahead_m, data.aside_m), level)


@dataclass(frozen=True, slots=True)
class Forgetting:
    """What a peer's rule does to ships under way at one age: how far off, and how many beyond 0.1 nm."""

    age_s: float
    rule: str
    median_m: float  # NaN where the ship is not shown at all
    misplaced: float  # share farther than PEER_RADIUS_M from where they are shown, or not shown


def forgetting(data: Dataset) -> list[Forgetting]:
    """Ships under way, by the rules found in other systems."""
    found = []
    for k, age_s in enumerate(SPREAD_AGES_S):
        part = data.at(k)
        if len(part) == 0:
            continue
        run = part.sog_mps * part.age_s
        ahead = part.ahead_m + run  # from the report itself
        stopped = part.ahead_m + run - part.sog_mps * np.minimum(part.age_s, 30.0)
        rules = {
            "drop after 60 s": None if age_s > 60 else np.hypot(part.ahead_m, part.aside_m),
            "stop after 30 s": np.hypot(stopped, part.aside_m),
            "freeze in place": np.hypot(ahead, part.aside_m),
            "straight on": np.hypot(part.ahead_m, part.aside_m),
        }
        for rule, off in rules.items():
            if off is None:
                found.append(Forgetting(age_s, rule, float("nan"), 1.0))
            else:
                misplaced = float((off > PEER_RADIUS_M).mean())
                found.append(Forgetting(age_s, rule, float(np.median(off)), misplaced))
    return found
