"""The worst case: a ship that may do anything up to its top speed is within a disc around its report."""

import numpy as np

from companion.messages import FloatArray
from companion.reach.interface import Distances


def disc_distances(north_m: FloatArray, east_m: FloatArray, radius_m: FloatArray | float) -> Distances:
    """Signed distance to discs around the origin, and its gradient.

    At the very centre every direction leads out; north is as good as any.
    """
    length = np.hypot(north_m, east_m)
    off_centre = length > 0
    scale = 1.0 / np.where(off_centre, length, 1.0)
    return length - radius_m, np.where(off_centre, north_m * scale, 1.0), east_m * scale
