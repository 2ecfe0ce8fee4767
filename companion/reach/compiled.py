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
from companion.reach.kernel import LEAST_M, Kernel, nearest

BLOCK = 64  # first all best edges, then all distances: the processor overlaps either, not both


def choose_kernel(name: Literal["numpy", "numba"]) -> Kernel:
    """The implementation of `kernel.nearest` called `name`; raises `ConfigError` where numba is missing."""
    if name == "numpy":
        return nearest
    edges, ends, one = np.ones((1, 1, 5)), np.ones((1, 1, 16)), np.ones(1)
    compiled()(edges, ends, one, one, one, one, np.empty((3, 1)))  # compile now, not in the first step
    return nearest_compiled


def nearest_compiled(
    arcs: Arcs, r1: FloatArray, r2: FloatArray, north: FloatArray, east: FloatArray
) -> Distances:
    """See `kernel.nearest`."""
    out = np.empty((3, len(north)))
    compiled()(*arcs.packed, r1, r2, north, east, out)
    return out[0], out[1], out[2]


@lru_cache(maxsize=1)
def compiled() -> Callable[..., None]:
    """`loop`, compiled; raises `ConfigError` without numba."""
    try:
        from numba import njit  # noqa: PLC0415 - an extra
    except ImportError:
        raise ConfigError(
            'reach.kernel = "numba" needs numba: pip install "companion[fast]", or choose "numpy"'
        ) from None
    made: Callable[..., None] = njit(cache=True, error_model="numpy")(loop)
    return made


def loop(
    edges: FloatArray,
    ends: FloatArray,
    r1: FloatArray,
    r2: FloatArray,
    north: FloatArray,
    east: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` (3, m) with distances and directions; plain Python, and what numba compiles.

    `edges` (n, J, 5) has normals and supports, `ends` (n, J, 16) the rows of `Arcs.table` and the
    cosine and sine of the widths.
    """
    step = 1 if len(edges) > 1 else 0
    most, best = np.empty(BLOCK), np.empty(BLOCK, dtype=np.int64)
    for first in range(0, len(north), BLOCK):
        size = min(BLOCK, len(north) - first)
        for k in range(size):
            i = first + k
            c, x, y, a, b = i * step, north[i], east[i], r1[i], r2[i]
            highest, at = -np.inf, 0
            for j in range(edges.shape[1]):
                over = edges[c, j, 0] * x + edges[c, j, 1] * y - edges[c, j, 2]
                over = over - a * edges[c, j, 3] - b * edges[c, j, 4]
                at = j if over > highest else at
                highest = over if over > highest else highest
            most[k], best[k] = highest, at
        for k in range(size):
            i = first + k
            c, x, y, a, b = i * step, north[i], east[i], r1[i], r2[i]
            t = ends[c, best[k]]
            along = t[0] * y - t[1] * x
            begin, end = t[2] + a * t[6] + b * t[10], t[3] + a * t[7] + b * t[11]
            run = along - min(max(along, begin), end)
            after, before = t[5] + a * t[9] + b * t[13], t[4] + a * t[8] + b * t[12]
            radius = after if along > end else before
            across = most[k] + radius
            length = sqrt(across * across + run * run)
            distance = length - radius
            if most[k] <= LEAST_M:  # inside all tangent lines: the shallowest edge, or an arc met radially
                distance, across, run, length = most[k], 1.0, 0.0, 1.0
                for j in range(edges.shape[1]):
                    e, s = edges[c, j], ends[c, j]
                    radius = s[5] + a * s[9] + b * s[13]
                    u = (e[0] * x + e[1] * y - e[2] - a * e[3] - b * e[4]) + radius
                    w = s[0] * y - s[1] * x - (s[3] + a * s[7] + b * s[11])
                    if w < 0 or u * s[15] < w * s[14]:
                        continue
                    reach = sqrt(u * u + w * w)
                    if reach > LEAST_M and reach - radius > distance:
                        distance, across, run, length, t = reach - radius, u, w, reach, s
            out[0, i] = distance
            out[1, i] = (across * t[0] - run * t[1]) / length
            out[2, i] = (across * t[1] + run * t[0]) / length
