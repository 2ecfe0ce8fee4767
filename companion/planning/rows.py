"""One row of numbers per contact: what a network reads.

The order of `COLUMNS` is part of the models' format.  Positions are the vehicle's, relative to the
reported antenna position, in the local north-east frame.
"""

import math

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray, Tracks

COLUMNS = (
    "north_m",
    "east_m",
    "course_rad",
    "speed_mps",
    "age_s",
    "until_age_s",
    "speed_noise_mps",
    "course_noise_rad",
    "heading_rad",
    "heading_error_rad",
    "bow_m",
    "stern_m",
    "port_m",
    "starboard_m",
    "position_error_m",
)
TURNING_COLUMNS = (*COLUMNS, "turn_rate_radps", "turn_rate_error_radps")

HEADING, HEADING_ERROR, POSITION_ERROR = map(
    COLUMNS.index, ("heading_rad", "heading_error_rad", "position_error_m")
)
BOW, STERN, PORT, STARBOARD = map(COLUMNS.index, ("bow_m", "stern_m", "port_m", "starboard_m"))
UNKNOWN_HEADING_RAD = math.pi / 2  # a heading error above it counts as unknown


class ContactRows:
    """Fills the rows; what only a new report changes is kept while the tracks are the same object.

    `circles`: hulls of unknown heading are given as their circles, see `as_circles`.
    """

    def __init__(self, *, circles: bool = False) -> None:
        self._circles = circles
        self._tracks: Tracks | None = None
        self._rows = np.zeros((0, len(COLUMNS)))

    def fill(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray | float, position_m: FloatArray
    ) -> FloatArray:
        """(n, 15) the rows for a vehicle at `position_m` (2,), or one per row (n, 2).

        They are valid until the next call.
        """
        if tracks is not self._tracks:
            self._keep(tracks)
        rows = self._rows
        rows[:, 0] = position_m[..., 0] - tracks.north_m
        rows[:, 1] = position_m[..., 1] - tracks.east_m
        rows[:, 4] = tracks.age_s(now)
        np.maximum(rows[:, 4], until_age_s, out=rows[:, 5])
        return rows

    def _keep(self, tracks: Tracks) -> None:
        self._tracks = tracks
        self._rows = np.zeros((len(tracks), len(COLUMNS)))
        columns = (tracks.cog_rad, tracks.sog_mps)
        self._rows[:, 2:4] = np.column_stack(columns)
        self._rows[:, 6:] = np.column_stack(
            (
                tracks.speed_noise_mps,
                tracks.course_noise_rad,
                tracks.heading_rad,
                tracks.heading_error_rad,
                tracks.bow_m,
                tracks.stern_m,
                tracks.port_m,
                tracks.starboard_m,
                tracks.position_error_m,
            )
        )
        if self._circles:
            as_circles(self._rows)


def as_circles(rows: FloatArray) -> None:
    """Change, in place, rows of unknown heading: the hull's circle around the antenna as position error.

    The same set: a hull that may lie any way is the disc to its farthest corner, and discs add up.
    """
    of = rows[:, HEADING_ERROR] > UNKNOWN_HEADING_RAD
    length, width = (np.maximum(rows[of, a], rows[of, b]) for a, b in ((BOW, STERN), (PORT, STARBOARD)))
    rows[of, POSITION_ERROR] += np.hypot(length, width)
    for gone in (HEADING, HEADING_ERROR, BOW, STERN, PORT, STARBOARD):
        rows[of, gone] = 0.0
