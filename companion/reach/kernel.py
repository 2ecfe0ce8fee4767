"""The one numerical kernel: signed distance and direction from `Arcs` to points, in numpy.

It is the reference and the default.  `compiled.py` has the same function for numba; which of them
runs is named by the caller, never decided by what is installed: a replay computes what was computed.
"""

from collections.abc import Callable

import numpy as np

from companion.messages import FloatArray, IntArray
from companion.reach.arcs import Arcs
from companion.reach.interface import Distances

LEAST_M = 1e-150  # a distance whose square is still a number; below it a point counts as inside

Kernel = Callable[[Arcs, FloatArray, FloatArray, FloatArray, FloatArray], Distances]


def nearest(arcs: Arcs, r1: FloatArray, r2: FloatArray, north: FloatArray, east: FloatArray) -> Distances:
    """One point (m,) for each of m sets, or m points for a single set; r1, r2 (m,)."""
    columns, points = len(arcs.column), len(north)
    over = _over_tangents(arcs, r1, r2, north, east)
    best = over.argmax(axis=0)
    flat = best * columns + arcs.column
    row = arcs.column if columns == points else np.arange(points)
    edge = over.ravel().take(best * points + row)
    t = arcs.table.take(flat, axis=1)
    pieces = t[2:6] + r1 * t[6:10] + r2 * t[10:14]
    along = t[0] * east - t[1] * north
    run = along - np.clip(along, pieces[0], pieces[1])  # 0 on the edge itself
    radius = np.where(along > pieces[1], pieces[3], pieces[2])
    out = edge + radius
    length = np.sqrt(out * out + run * run)
    inside = np.flatnonzero(edge <= LEAST_M)
    if inside.size:
        length[inside] = 1.0
    distance = length - radius
    away_north = (out * t[0] - run * t[1]) / length
    away_east = (out * t[1] + run * t[0]) / length
    if inside.size:
        distance[inside], away_north[inside], away_east[inside] = _within(
            arcs, flat[inside] % columns, r1[inside], r2[inside], over[:, inside], north[inside], east[inside]
        )
    return distance, away_north, away_east


def _over_tangents(
    arcs: Arcs, r1: FloatArray, r2: FloatArray, north: FloatArray, east: FloatArray
) -> FloatArray:
    """(J, m) signed distances to the tangent lines at the breakpoints; in place, for the cache's sake."""
    h0, h1, h2 = arcs.support
    over: FloatArray = arcs.north * north
    part = arcs.east * east
    over += part
    over -= h0
    over -= np.multiply(h1, r1, out=part)
    over -= np.multiply(h2, r2, out=part)
    return over


def _within(
    arcs: Arcs,
    column: IntArray,
    r1: FloatArray,
    r2: FloatArray,
    over: FloatArray,
    north: FloatArray,
    east: FloatArray,
) -> Distances:
    """The same inside all tangent lines: the shallowest edge, or an arc that is met radially."""
    flat = np.arange(len(over))[:, None] * len(arcs.column) + column
    t = arcs.table.take(flat, axis=1)  # (14, J, m)
    centre, radius = t[3:6:2] + r1 * t[7:10:2] + r2 * t[11:14:2]
    out, run = over + radius, t[0] * east - t[1] * north - centre
    length = np.sqrt(out * out + run * run)
    before_next = out * arcs.sin_width.take(flat) >= run * arcs.cos_width.take(flat)
    met = (run >= 0) & before_next & (length > LEAST_M)
    radial = np.where(met, length - radius, -np.inf)
    edge, arc = over.argmax(axis=0), radial.argmax(axis=0)
    points = np.arange(len(north))
    on_edge, on_arc = over[edge, points], radial[arc, points]
    j = np.where(on_arc > on_edge, arc, edge)
    # on an edge the gradient is its normal, on an arc the direction from its centre
    a, b, c = (
        np.where(on_arc > on_edge, x[j, points], y) for x, y in ((out, 1.0), (run, 0.0), (length, 1.0))
    )
    n_north, n_east = t[0, j, points], t[1, j, points]
    return np.maximum(on_arc, on_edge), (a * n_north - b * n_east) / c, (a * n_east + b * n_north) / c
