"""The one numerical kernel: signed distance and direction from `Arcs` to points, in numpy.

It is the reference and the default.  `compiled.py` has the same function for numba; which of them
runs is named by the caller, never decided by what is installed: a replay computes what was computed.
"""

from collections.abc import Callable

import numpy as np

from companion.messages import FloatArray, IntArray
from companion.reach.arcs import Arcs
from companion.reach.interface import Distances

Kernel = Callable[[Arcs, FloatArray, FloatArray, FloatArray, FloatArray], Distances]


def nearest(arcs: Arcs, r1: FloatArray, r2: FloatArray, north: FloatArray, east: FloatArray) -> Distances:
    """One point (m,) for each of m sets, or m points for a single set; r1, r2 (m,)."""
    columns, points = len(arcs.column), len(north)
    over = arcs.north * north + arcs.east * east - arcs.support_at(r1, r2)
    best = over.argmax(axis=0)
    flat = best * columns + arcs.column
    row = arcs.column if columns == points else np.arange(points)
    edge = over.ravel().take(best * points + row)
    t = arcs.table.take(flat, axis=1)
    pieces = t[2:6] + r1 * t[6:10] + r2 * t[10:14]
    along = t[0] * east - t[1] * north
    past = along - pieces[1]
    run = np.maximum(past, 0.0) + np.minimum(along - pieces[0], 0.0)  # 0 on the edge itself
    radius = np.where(past > 0, pieces[3], pieces[2])
    out = edge + radius
    length = np.sqrt(out * out + run * run)
    inside = edge <= 0
    some_inside = inside.any()
    if some_inside:
        length[inside] = 1.0
    distance = length - radius
    away_north = (out * t[0] - run * t[1]) / length
    away_east = (out * t[1] + run * t[0]) / length
    if some_inside:
        rows = np.flatnonzero(inside)
        distance[rows], away_north[rows], away_east[rows] = _within(
            arcs, flat[rows] % columns, r1[rows], r2[rows], over[:, rows], north[rows], east[rows]
        )
    return distance, away_north, away_east


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
    t = arcs.table
    n_north, n_east = t[0].take(flat), t[1].take(flat)
    centre = t[3].take(flat) + r1 * t[7].take(flat) + r2 * t[11].take(flat)
    radius = t[5].take(flat) + r1 * t[9].take(flat) + r2 * t[13].take(flat)
    out, run = over + radius, n_north * east - n_east * north - centre
    length = np.sqrt(out * out + run * run)
    met = (run >= 0) & (out * arcs.sin_width.take(flat) >= run * arcs.cos_width.take(flat)) & (length > 0)
    radial = np.where(met, length - radius, -np.inf)
    points = np.arange(len(north))
    edge, arc = over.argmax(axis=0), radial.argmax(axis=0)
    on_arc = radial[arc, points] > over[edge, points]
    j = np.where(on_arc, arc, edge)
    distance = np.where(on_arc, radial[j, points], over[j, points])
    # on an edge the gradient is its normal, on an arc the direction from its centre
    a, b, c = (np.where(on_arc, x[j, points], y) for x, y in ((out, 1.0), (run, 0.0), (length, 1.0)))
    away_north = (a * n_north[j, points] - b * n_east[j, points]) / c
    return distance, away_north, (a * n_east[j, points] + b * n_north[j, points]) / c
