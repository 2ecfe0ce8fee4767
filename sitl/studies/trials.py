"""A part of a campaign: some consecutive trials of one planner, and what came of each."""

import math
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from companion.messages import Tracks
from sitl.studies.case import Crossing
from sitl.studies.closest import to_the_hulls, to_the_sets
from sitl.studies.crossing import cross
from sitl.studies.planners import PLANNERS
from sitl.studies.ships import draw
from sitl.studies.through_sitl import sail
from sitl.studies.wish import Planner

CHUNK = 250  # trials computed together, whatever the number of jobs: the same numbers for any


class Part(Struct, frozen=True):
    """A piece of work: trials [first, first + count) of `planner`."""

    planner: str
    first: int
    count: Annotated[int, Meta(ge=1)]


class Outcome(Struct, frozen=True):
    """One trial.  Times since the scenario's start; distances horizontal, negative inside."""

    planner: str
    trial: int
    arrived: bool
    time_s: float | None  # at the goal
    to_set_m: float  # least distance to a reachable set of that moment
    to_set_at_s: float
    to_hull_m: float  # least distance to a true hull
    vertical_m: float  # between keel and vehicle at that moment
    oldest_s: float | None  # age of the oldest information that steered


def parts(planners: tuple[str, ...], trials: int, chunk: int = CHUNK) -> list[Part]:
    """The campaign in pieces, in the order of the tables."""
    starts = range(0, trials, chunk)
    return [Part(name, first, min(chunk, trials - first)) for first in starts for name in planners]


def run_part(case: Crossing, seed: int, part: Part, kernel: str = "numpy") -> list[Outcome]:
    """Every trial of the part; the same arguments give the same numbers."""
    if case.readings.vehicle == "sitl":
        return [_through_sitl(case, seed, part.planner, part.first + i) for i in range(part.count)]
    ships = draw(case, seed, range(part.first, part.first + part.count))

    def make(tracks: Tracks, vehicles: int) -> Planner:
        return PLANNERS[part.planner].make(case, tracks, vehicles, kernel)

    crossed = cross(case, ships, make)
    sets, hulls = to_the_sets(crossed.paths, ships), to_the_hulls(crossed.paths, ships)
    t_s = crossed.paths.t_ns * 1e-9
    reported_s = case.information_s - case.information_age_s
    outcomes: list[Outcome] = []
    for i in range(part.count):
        steered_s = float(crossed.steered_s[i])
        depth_m = case.depth_m(float(t_s[hulls.step[i]]) - case.information_s)
        outcomes.append(
            Outcome(
                planner=part.planner,
                trial=part.first + i,
                arrived=bool(crossed.arrived[i]),
                time_s=round(float(t_s[crossed.paths.last[i]]), 3) if crossed.arrived[i] else None,
                to_set_m=_rounded(sets.distance_m[i]),
                to_set_at_s=round(float(t_s[sets.step[i]]), 3),
                to_hull_m=_rounded(hulls.distance_m[i]),
                vertical_m=_rounded(depth_m - case.draught_m),
                oldest_s=None if math.isnan(steered_s) else round(steered_s - reported_s, 3),
            )
        )
    return outcomes


def _through_sitl(case: Crossing, seed: int, planner: str, trial: int) -> Outcome:
    found = sail(case, seed, trial, planner)
    under_way_s = found.under_way_s
    return Outcome(
        planner=planner,
        trial=trial,
        arrived=found.arrived,
        time_s=None if under_way_s is None else round(case.information_s + under_way_s, 3),
        to_set_m=_rounded(found.to_set_m),
        to_set_at_s=round(found.to_set_at_s, 3),
        to_hull_m=_rounded(found.to_hull_m),
        vertical_m=_rounded(found.vertical_m),
        oldest_s=found.oldest_s,
    )


def _rounded(value: np.float64 | float) -> float:
    return round(float(value), 4)
