"""Bounds from one water on another: coverage as it comes, with and without adaptation."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from companion.calibrate.dataset import Collector, collect
from companion.instant import elapsed_s
from companion.messages import SPREAD_AGES_S, Heard
from companion.picture.adaptation import Adaptation, cell_of
from companion.picture.behaviour import UNDER_WAY_MPS
from companion.picture.forecast import Outcome
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


def transfer(bounds: LearnedBounds, heard: Iterable[Heard]) -> tuple[list[Transfer], list[Transfer]]:
    """Score every outcome of `heard` in the order it happened: of ships under way, and at rest."""
    collector = Collector(SPREAD_AGES_S)
    collect(heard, collector)
    outcomes = collector.outcomes
    return replayed(bounds, outcomes), replayed(bounds, outcomes, is_at_rest)


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
    """The same from collected outcomes at the stated ages."""
    under_way = sorted((o for o in outcomes if is_meant(o)), key=lambda o: o.at)
    adaptation = Adaptation(bounds)
    tallies = [[0, 0, 0, 0, 0] for _ in SPREAD_AGES_S]  # scored, fixed, adapted, late, late adapted
    for outcome, score in zip(under_way, bounds.scores(under_way).tolist(), strict=True):
        tally = tallies[outcome.watch]
        cell = cell_of(outcome)
        missed = adaptation.missed[cell]
        adaptation.take(outcome)
        held = adaptation.missed[cell] == missed
        late = elapsed_s(under_way[0].at, outcome.at) >= WARM_UP_S
        for i, one in enumerate((True, score <= 0.0, held, late, late and held)):
            tally[i] += one
    return [
        Transfer(age, n, _share(fixed, n), _share(adapted, n), late, _share(good, late))
        for age, (n, fixed, adapted, late, good) in zip(SPREAD_AGES_S, tallies, strict=True)
    ]


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")
