"""What many reports say, as columns: the only loop over them on the way to the tracks."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from companion.messages import ContactReport, FloatArray, IntArray


class Said(NamedTuple):
    """(n,) each, in the units of `ContactReport`; NaN where nothing is said."""

    latitude_deg: FloatArray
    longitude_deg: FloatArray
    cog_rad: FloatArray
    sog_mps: FloatArray
    heading_rad: FloatArray
    turn_rate_radps: FloatArray
    accurate: FloatArray  # 1 or 0
    age_error_s: FloatArray
    navigational_status: FloatArray
    measured_at: IntArray

    @classmethod
    def of(cls, reports: Sequence[ContactReport]) -> "Said":
        """The columns of n reports."""
        rows = [
            (
                r.latitude_deg,
                r.longitude_deg,
                r.cog_rad,
                r.sog_mps,
                r.heading_rad,
                r.turn_rate_radps,
                r.accurate,
                r.age_error_s,
                r.navigational_status,
            )
            for r in reports
        ]
        columns = np.array(rows, dtype=np.float64).reshape(-1, 9).T.copy()  # None becomes NaN
        latitude, longitude, cog, sog, heading, turn, accurate, age_error, status = columns
        measured_at = np.array([r.measured_at for r in reports], dtype=np.int64)
        return cls(latitude, longitude, cog, sog, heading, turn, accurate, age_error, status, measured_at)
