"""The pull toward the goal: minus the gradient of eq. (6), in the two readings the paper leaves open.

    proportional:  -grad (K_p/2 |x - g|^2) = K_p (g - x)          eq. (6) to the letter
    unit:          K_p (g - x) / |g - x|                          a pull of constant strength

The paper's own figure (18.8 m to the sets) fits the unit reading: force balance against
K_r/(d - delta)^3 lies at delta + (K_r/K_p)^(1/3) = 19.4 m, whatever the distance to the goal.
"""

import math
from typing import Literal

import numpy as np

from companion.messages import FloatArray


def attraction(
    position_m: FloatArray, goal_m: FloatArray, k_p: float, reading: Literal["unit", "proportional"]
) -> FloatArray:
    """(2,) the attractive velocity, m/s, for a position (2,) and a goal (2,) in the local frame.

    Positions (m, 2) of m vehicles, each with its goal or all with one, give (m, 2).
    """
    offset = goal_m - position_m
    if reading == "proportional":
        return k_p * offset
    if offset.ndim == 1:
        distance_m = math.hypot(offset[0], offset[1])
        return offset * (k_p / distance_m) if distance_m > 0 else offset
    distances_m = np.hypot(offset[:, 0], offset[:, 1])
    return offset * (k_p / np.where(distances_m > 0, distances_m, np.inf))[:, None]
