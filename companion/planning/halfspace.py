"""The velocity nearest to a wanted one under half-space rules and a speed limit.

    minimise |v - w|   subject to   n_i . v >= b_i  for all i,   |v| <= limit

In the plane the optimum is one of few points: w itself, its projection on one boundary, or a
corner of two boundaries (lines and the speed circle).  All are formed and tested at once.
"""

import numpy as np

from companion.messages import BoolArray, FloatArray

FEASIBLE_MPS = 1e-9  # rounding allowed when a candidate is tested
MOST_RULES = 12  # tightest rules used to form corners; every rule is tested
HEADINGS = 72  # resolution of the least bad velocity


def nearest_velocity(
    wanted: FloatArray, away: FloatArray, bound_mps: FloatArray, limit_mps: float
) -> tuple[FloatArray, bool]:
    """The best velocity (2,), and whether it satisfies every rule.

    `wanted` (2,), `away` (n, 2) unit vectors n_i, `bound_mps` (n,) b_i.  When no velocity
    satisfies all rules the one whose worst violation is smallest is returned, with False.
    """
    if _satisfies(wanted[None, :], away, bound_mps, limit_mps)[0]:
        return wanted, True
    tight = np.argsort(away @ wanted - bound_mps, kind="stable")[:MOST_RULES]
    candidates = _candidates(wanted, away[tight], bound_mps[tight], limit_mps)
    good = candidates[_satisfies(candidates, away, bound_mps, limit_mps)]
    if len(good):
        offset = good - wanted
        return good[int(np.argmin((offset * offset).sum(axis=1)))], True
    return _least_bad(away, bound_mps, limit_mps), False


def _satisfies(v: FloatArray, away: FloatArray, bound: FloatArray, limit: float) -> BoolArray:
    """(k,) which of the velocities (k, 2) satisfy every rule."""
    within = np.hypot(v[:, 0], v[:, 1]) <= limit + FEASIBLE_MPS
    holds: BoolArray = (v @ away.T >= bound - FEASIBLE_MPS).all(axis=1) & within
    return holds


def _candidates(wanted: FloatArray, n: FloatArray, b: FloatArray, limit: float) -> FloatArray:
    """(k, 2) every point where the optimum can lie."""
    speed = float(np.hypot(wanted[0], wanted[1]))
    points = [wanted[None, :] * (limit / speed if speed > limit else 1.0)]
    points.append(wanted + (b - n @ wanted)[:, None] * n)
    # corners of two lines, by Cramer's rule
    i, j = np.triu_indices(len(b), 1)
    det = n[i, 0] * n[j, 1] - n[i, 1] * n[j, 0]
    i, j, det = i[np.abs(det) > 1e-12], j[np.abs(det) > 1e-12], det[np.abs(det) > 1e-12]
    x = (b[i] * n[j, 1] - b[j] * n[i, 1]) / det
    y = (n[i, 0] * b[j] - n[j, 0] * b[i]) / det
    points.append(np.column_stack((x, y)))
    # corners of a line and the speed circle
    half = np.sqrt(np.maximum(limit**2 - b**2, 0.0))
    foot, along = b[:, None] * n, half[:, None] * np.column_stack((-n[:, 1], n[:, 0]))
    reaches = np.abs(b) <= limit
    points += [(foot + along)[reaches], (foot - along)[reaches]]
    return np.concatenate(points)


def _least_bad(away: FloatArray, bound: FloatArray, limit: float) -> FloatArray:
    """The velocity (2,) whose worst violation is smallest, among headings at full speed and rest."""
    heading = np.arange(HEADINGS) * (2 * np.pi / HEADINGS)
    v = np.concatenate((np.zeros((1, 2)), limit * np.column_stack((np.cos(heading), np.sin(heading)))))
    worst = (v @ away.T - bound).min(axis=1)
    best: FloatArray = v[int(np.argmax(worst))]
    return best
