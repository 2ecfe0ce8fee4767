"""The closest approach of every trial, from the paths: every second, and at every step where it can matter.

The distance to a moving thing changes by no more than the closing speed.  So between two seconds it is
computed only for ships with which less than the least so far can hide.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion import reach
from companion.instant import Instant
from companion.messages import FloatArray, IntArray, Tracks
from companion.reach.shapes import only
from companion.reach.slices import Slices
from sitl.closest import to_hulls
from sitl.studies.ships import Ships

CLOSING_MPS = 8.0  # full speed and a ship's, head on, and what a set grows


@dataclass(frozen=True, slots=True)
class Paths:
    """`position_m` (s, m, 2) of m vehicles at the instants `t_ns` (s,); valid up to step `last` (m,)."""

    t_ns: IntArray
    position_m: FloatArray
    last: IntArray


@dataclass(frozen=True, slots=True)
class Least:
    """Per trial: the least distance (m,) and the step (m,) at which it was."""

    distance_m: FloatArray
    step: IntArray


def to_the_sets(paths: Paths, ships: Ships, closing_mps: float = CLOSING_MPS) -> Least:
    """Least distance to any ship's reachable set of that moment."""
    slices = Slices.of(ships.reported)

    def at_step(step: int, place_m: FloatArray) -> FloatArray:
        return reach.at(ships.reported, Instant(int(paths.t_ns[step]))).nearest(place_m).distance_m

    def at_pairs(steps: IntArray, rows: IntArray, place_m: FloatArray) -> FloatArray:
        age_s = np.asarray((paths.t_ns[steps] - ships.reported.measured_at_ns[rows]) * 1e-9)
        return slices.distances(rows, age_s, age_s, place_m[:, 0], place_m[:, 1])[0]

    return _least(paths, ships.per_trial, at_step, at_pairs, closing_mps)


def to_the_hulls(paths: Paths, ships: Ships, closing_mps: float = CLOSING_MPS) -> Least:
    """Least distance to any true hull."""

    def truth(step: int) -> Tracks:
        return ships.truth(Instant(int(paths.t_ns[step])))

    def at_step(step: int, place_m: FloatArray) -> FloatArray:
        return to_hulls(truth(step), place_m)

    def at_pairs(steps: IntArray, rows: IntArray, place_m: FloatArray) -> FloatArray:
        found = np.empty(len(steps))
        order = np.argsort(steps, kind="stable")
        for some in np.split(order, np.flatnonzero(np.diff(steps[order])) + 1):
            found[some] = to_hulls(only(truth(int(steps[some[0]])), rows[some]), place_m[some])
        return found

    return _least(paths, ships.per_trial, at_step, at_pairs, closing_mps)


def _least(
    paths: Paths,
    per_trial: int,
    at_step: Callable[[int, FloatArray], FloatArray],
    at_pairs: Callable[[IntArray, IntArray, FloatArray], FloatArray],
    closing_mps: float,
) -> Least:
    count, m, _ = paths.position_m.shape
    step_s = float(np.median(np.diff(paths.t_ns))) * 1e-9 if count > 1 else 1.0
    stride = max(round(1.0 / step_s), 1)
    steps = np.arange(0, int(paths.last.max()) + 1, stride)
    near = np.stack([at_step(int(i), np.repeat(paths.position_m[i], per_trial, axis=0)) for i in steps])
    trial = np.repeat(np.arange(m), per_trial)
    near[steps[:, None] > paths.last[trial]] = np.inf
    least, where = np.full(m, np.inf), np.zeros(m, dtype=np.int64)
    _keep(least, where, near.ravel(), np.repeat(steps, m * per_trial), np.tile(trial, len(steps)))
    # what may hide between two of them, and from the last one to the end: halve until nothing can
    after = np.vstack((near[1:], np.full((1, m * per_trial), np.inf)))
    k, row = np.nonzero(np.isfinite(near))
    start, before, then, width = steps[k], near[k, row], after[k, row], stride
    while width > 1 and len(start):
        ends = np.isfinite(then)
        bound = np.where(ends, (before + np.where(ends, then, 0.0)) / 2, before)
        bound -= closing_mps * step_s * width * np.where(ends, 0.5, 1.0)
        hides = bound < least[trial[row]]
        start, row, before, then = start[hides], row[hides], before[hides], then[hides]
        half = width // 2
        middle = start + half
        valid = middle <= paths.last[trial[row]]
        found = np.full(len(start), np.inf)
        if valid.any():
            place = paths.position_m[middle[valid], trial[row[valid]]]
            found[valid] = at_pairs(middle[valid], row[valid], place)
            _keep(least, where, found[valid], middle[valid], trial[row[valid]])
        start = np.concatenate((start, middle[valid]))
        row = np.concatenate((row, row[valid]))
        before, then = np.concatenate((before, found[valid])), np.concatenate((found, then[valid]))
        width -= half  # the longer of the two halves: a bound for both
    return Least(least, where)


def _keep(least: FloatArray, where: IntArray, found: FloatArray, steps: IntArray, trial: IntArray) -> None:
    """Take what is nearer, the earliest step where several are."""
    order = np.lexsort((steps, found, trial))
    number, first = np.unique(trial[order], return_index=True)
    best = order[first]
    nearer = found[best] < least[number]
    least[number[nearer]] = found[best][nearer]
    where[number[nearer]] = steps[best][nearer]
