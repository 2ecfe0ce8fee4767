"""Polygons for drawing, from nothing but a support function."""

from collections.abc import Callable

import numpy as np

from companion.messages import FloatArray

POINTS = 360
STEP_RAD = 1e-5  # between the two tangents whose crossing is the boundary point
APART_M = 1e-4


def polygon_around(support: Callable[[FloatArray], FloatArray], north_m: float, east_m: float) -> FloatArray:
    """(m, 2) closed convex polygon whose corners lie on the boundary of the set.

    `support` maps angles (k,) to the support around (`north_m`, `east_m`).  Arcs become chords of a
    degree: 4e-5 of their radius inside.
    """
    angle = np.linspace(0, 2 * np.pi, POINTS, endpoint=False)
    second = angle + STEP_RAD
    h, h_next = support(angle), support(second)
    north = (h * np.sin(second) - h_next * np.sin(angle)) / np.sin(STEP_RAD)
    east = (h_next * np.cos(angle) - h * np.cos(second)) / np.sin(STEP_RAD)
    corners = np.column_stack((north, east))
    # one corner of the set has many tangents: keep it once
    apart = np.hypot(*(corners - np.roll(corners, 1, axis=0)).T) > APART_M
    kept = corners[apart] if apart.any() else corners[:1]
    return np.asarray(np.vstack((kept, kept[:1])) + np.array((north_m, east_m)))
