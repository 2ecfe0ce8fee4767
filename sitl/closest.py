"""Where a distance was smallest over a run, without computing it at every step.  Pure.

A distance between moving things changes by no more than the closing speed: it is computed every
`COARSE_S`, and gaps are halved only while something smaller can hide in them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray, IntArray, Tracks

CLOSING_SPEED_MPS = 25.0  # a fast ferry and the vehicle, head on
COARSE_S = 1.0


@dataclass(frozen=True, slots=True)
class Distances:
    """The distance to the nearest of some sets, at the steps where it was computed.

    `step` (k,) grows; `nearest_m` (k,) is inf where there is no set; `row` (k,) is the nearest
    set's row, or -1.
    """

    step: IntArray
    nearest_m: FloatArray
    row: IntArray

    def least(self) -> int | None:
        """Index into the arrays of the smallest distance; None when there never was a set."""
        if not np.isfinite(self.nearest_m).any():
            return None
        return int(np.argmin(self.nearest_m))


def search(
    t_s: FloatArray, distance_m: Callable[[int], FloatArray], jumps: IntArray, limit_m: float
) -> Distances:
    """Distances wherever they can be the smallest of the run or below `limit_m`, and every `COARSE_S`.

    `t_s` (n,) are the steps' times; `distance_m(step)` gives (m,) distances, m = 0 for none;
    `jumps` are the steps at which the things measured to are other than at the step before.
    """
    found: dict[int, tuple[float, int]] = {}

    def compute(steps: IntArray) -> None:
        for step in steps.tolist():
            distances = distance_m(step)
            row = int(np.argmin(distances)) if len(distances) else -1
            found[step] = (float(distances[row]) if row >= 0 else np.inf, row)

    def known() -> tuple[IntArray, FloatArray]:
        steps = np.array(sorted(found), dtype=np.int64)
        return steps, np.array([found[step][0] for step in steps.tolist()])

    due = _coarse(t_s, jumps)
    while len(due):
        compute(due)
        steps, nearest_m = known()
        # between two steps no distance is smaller than where both closing lines meet
        passed_m = CLOSING_SPEED_MPS * np.diff(t_s[steps])
        bound_m = np.minimum(nearest_m[:-1], nearest_m[1:])
        both = np.isfinite(nearest_m[:-1]) & np.isfinite(nearest_m[1:])
        bound_m[both] = (nearest_m[:-1][both] + nearest_m[1:][both] - passed_m[both]) / 2
        open_gap = (bound_m < max(float(nearest_m.min()), limit_m)) & (np.diff(steps) > 1)
        due = (steps[:-1][open_gap] + steps[1:][open_gap]) // 2
    steps, nearest_m = known()
    return Distances(steps, nearest_m, np.array([found[step][1] for step in steps.tolist()], dtype=np.int64))


def _coarse(t_s: FloatArray, jumps: IntArray) -> IntArray:
    """The first step of every `COARSE_S`, the last step, and both sides of every jump."""
    if not len(t_s):
        return np.zeros(0, dtype=np.int64)
    _, first = np.unique(np.floor((t_s - t_s[0]) / COARSE_S), return_index=True)
    sides = np.concatenate((jumps, jumps - 1))
    every = np.concatenate((first, [len(t_s) - 1], sides[sides >= 0]))
    return np.unique(every).astype(np.int64)


def to_hulls(truth: Tracks, position_m: FloatArray) -> FloatArray:
    """(n,) distance from a position (2,), or one each (n, 2), to each true hull, minus the depth inside it.

    The rectangle's own formula: a second path to what the reachable sets say with every bound at
    zero.  A hull of unknown heading is the circle it lies in.
    """
    north, east = position_m[..., 0] - truth.north_m, position_m[..., 1] - truth.east_m
    cos, sin = np.cos(truth.heading_rad), np.sin(truth.heading_rad)
    ahead = north * cos + east * sin - (truth.bow_m - truth.stern_m) / 2
    right = east * cos - north * sin - (truth.starboard_m - truth.port_m) / 2
    beyond_end = np.abs(ahead) - (truth.bow_m + truth.stern_m) / 2
    beyond_side = np.abs(right) - (truth.starboard_m + truth.port_m) / 2
    outside = np.hypot(np.maximum(beyond_end, 0.0), np.maximum(beyond_side, 0.0))
    rectangle = outside + np.minimum(np.maximum(beyond_end, beyond_side), 0.0)
    longest = np.maximum(truth.bow_m, truth.stern_m)
    widest = np.maximum(truth.port_m, truth.starboard_m)
    circle = np.hypot(north, east) - np.hypot(longest, widest)
    return np.asarray(np.where(truth.heading_error_rad < np.pi, rectangle, circle))
