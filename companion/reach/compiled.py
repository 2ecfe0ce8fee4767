"""The kernel as one loop, for numba: the same arithmetic in the same order as `kernel.nearest`.

Which kernel runs is chosen by name, never by what happens to be installed.  Both give the same bits
where the compiler keeps IEEE order, which numba does unless asked for fast mathematics; what is
promised is 1e-9 m.
"""

from collections.abc import Callable
from functools import lru_cache
from math import sqrt
from typing import Literal

import numpy as np

from companion.errors import ConfigError
from companion.messages import FloatArray
from companion.reach.arcs import Arcs
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel, nearest

BLOCK = 64  # ships at once: their best breakpoints stay in the first cache


def kernel(name: Literal["numpy", "numba"]) -> Kernel:
    """The implementation of `kernel.nearest` called `name`; raises `ConfigError` where numba is missing."""
    if name == "numpy":
        return nearest
    compiled()
    return nearest_compiled


def nearest_compiled(
    arcs: Arcs, r1: FloatArray, r2: FloatArray, north: FloatArray, east: FloatArray
) -> Distances:
    """See `kernel.nearest`."""
    out = np.empty((3, len(north)))
    h0, h1, h2 = arcs.support
    widths = (arcs.cos_width, arcs.sin_width)
    compiled()(arcs.north, arcs.east, h0, h1, h2, arcs.table, *widths, r1, r2, north, east, out)
    return out[0], out[1], out[2]


@lru_cache(maxsize=1)
def compiled() -> Callable[..., None]:
    """`loop`, compiled; raises `ConfigError` without numba."""
    try:
        from numba import njit  # noqa: PLC0415 - an extra
    except ImportError:
        raise ConfigError(
            'the reach kernel "numba" needs numba: pip install "companion[fast]", or choose "numpy"'
        ) from None
    made: Callable[..., None] = njit(cache=True, error_model="numpy")(loop)
    return made


def loop(
    n_north: FloatArray,
    n_east: FloatArray,
    h0: FloatArray,
    h1: FloatArray,
    h2: FloatArray,
    t: FloatArray,
    cos_width: FloatArray,
    sin_width: FloatArray,
    r1: FloatArray,
    r2: FloatArray,
    north: FloatArray,
    east: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` (3, m) with distances and directions; plain Python, and what numba compiles."""
    breaks, columns = n_north.shape
    points = len(north)
    step = 1 if columns > 1 else 0
    edge, best = np.empty(BLOCK), np.empty(BLOCK, dtype=np.int64)
    for first in range(0, points, BLOCK):
        size = min(BLOCK, points - first)
        edge[:] = -np.inf
        best[:] = 0
        for j in range(breaks):
            for k in range(size):
                i = first + k
                c = i * step
                h = h0[j, c] + r1[i] * h1[j, c] + r2[i] * h2[j, c]
                over = n_north[j, c] * north[i] + n_east[j, c] * east[i] - h
                better = over > edge[k]
                best[k] = j if better else best[k]
                edge[k] = over if better else edge[k]
        for k in range(size):
            i = first + k
            c = i * step
            f = best[k] * columns + c
            a, b = r1[i], r2[i]
            along = t[0, f] * east[i] - t[1, f] * north[i]
            past = along - (t[3, f] + a * t[7, f] + b * t[11, f])
            before = along - (t[2, f] + a * t[6, f] + b * t[10, f])
            run = max(past, 0.0) + min(before, 0.0)
            if past > 0:
                radius = t[5, f] + a * t[9, f] + b * t[13, f]
            else:
                radius = t[4, f] + a * t[8, f] + b * t[12, f]
            across = edge[k] + radius
            length = sqrt(across * across + run * run)
            distance = length - radius
            if edge[k] <= 0:  # inside all tangent lines: the shallowest edge, or an arc met radially
                distance, across, run, length = edge[k], 1.0, 0.0, 1.0
                for j in range(breaks):
                    g = j * columns + c
                    radius = t[5, g] + a * t[9, g] + b * t[13, g]
                    h = h0[j, c] + a * h1[j, c] + b * h2[j, c]
                    u = (n_north[j, c] * north[i] + n_east[j, c] * east[i] - h) + radius
                    centre = t[3, g] + a * t[7, g] + b * t[11, g]
                    w = t[0, g] * east[i] - t[1, g] * north[i] - centre
                    if w < 0 or u * sin_width[j, c] < w * cos_width[j, c]:
                        continue
                    reach = sqrt(u * u + w * w)
                    if reach > 0 and reach - radius > distance:
                        distance, across, run, length, f = reach - radius, u, w, reach, g
            out[0, i] = distance
            out[1, i] = (across * t[0, f] - run * t[1, f]) / length
            out[2, i] = (across * t[1, f] + run * t[0, f]) / length
