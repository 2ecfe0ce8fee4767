"""Polygons for drawing, from support functions: corners of tangents, so that they contain the set."""

from collections.abc import Callable

import numpy as np

from companion.messages import FloatArray

POINTS = 180


def polygon_around(support: Callable[[FloatArray], FloatArray], i: int) -> FloatArray:
    """(POINTS + 1, 2) closed polygon around set i of a support function (k, 2) -> (n, k)."""
    angle = np.linspace(-np.pi, np.pi, POINTS, endpoint=False)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    h = support(normal)[i]
    following, h_next = np.roll(normal, -1, axis=0), np.roll(h, -1)
    det = np.sin(2 * np.pi / POINTS)
    north = (h * following[:, 1] - h_next * normal[:, 1]) / det
    east = (h_next * normal[:, 0] - h * following[:, 0]) / det
    corners = np.column_stack((north, east))
    return np.vstack((corners, corners[:1]))
