"""How long one step of one vehicle takes: the planner as on the board, one vehicle, all its ships."""

from collections.abc import Callable

import numpy as np

from companion.instant import instant
from companion.messages import Tracks
from sitl.studies.case import Crossing
from sitl.studies.planners import PLANNERS
from sitl.studies.ships import draw

STEPS = 300


def step_ms(
    case: Crossing, seed: int, planner: str, kernel: str, clock: Callable[[], float]
) -> tuple[float, float]:
    """(p50, max) milliseconds over `STEPS` moments of the straight way across; `clock` in seconds."""
    tracks: Tracks = draw(case, seed, range(1)).reported
    made = PLANNERS[planner].make(case, tracks, 1, kernel)
    start, goal = np.array([case.start_m]), np.array([case.goal_m])
    taken: list[float] = []
    for share in np.linspace(0.0, 0.95, STEPS + 5):  # the first few warm up
        now = instant(case.information_s + share * case.horizon_s)
        position = start + share * (goal - start)
        began = clock()
        made.wish(now, position, np.zeros((1, 2)))
        taken.append((clock() - began) * 1e3)
    p50, most = np.quantile(taken[5:], (0.5, 1.0)).tolist()
    return round(p50, 3), round(most, 3)
