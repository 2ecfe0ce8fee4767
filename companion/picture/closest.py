"""Closest point of approach, with both ships first brought to one common time.

A contact's position is as old as its report, our own is as old as ours: each is carried along its own
velocity to `now` before they are compared.  It is a figure for people, straight lines both; what is
steered by are the sets.
"""

from typing import NamedTuple

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray, Tracks


class Approach(NamedTuple):
    """Per contact, (n,) each."""

    range_m: FloatArray  # between the antennas now, straight prediction
    bearing_rad: FloatArray  # from us, clockwise from north
    cpa_m: FloatArray
    tcpa_s: FloatArray  # negative when it has passed; 0 when nothing moves


def approaches(
    tracks: Tracks, now: Instant, own_at: Instant, own_m: FloatArray, own_mps: FloatArray
) -> Approach:
    """For our position (2,) and velocity (2,), north and east, measured at `own_at`."""
    age = tracks.age_s(now)
    theirs = tracks.sog_mps[:, None] * np.column_stack((np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)))
    there = np.column_stack((tracks.north_m, tracks.east_m)) + age[:, None] * theirs
    here = own_m + own_mps * ((now - own_at) * 1e-9)
    off, closing = there - here, theirs - own_mps
    speed2 = (closing**2).sum(axis=1)
    moving = speed2 > 1e-6
    tcpa = np.where(moving, -(off * closing).sum(axis=1) / np.where(moving, speed2, 1.0), 0.0)
    least = off + np.maximum(tcpa, 0.0)[:, None] * closing  # after it has passed, it is as near as now
    return Approach(
        np.hypot(off[:, 0], off[:, 1]),
        np.mod(np.arctan2(off[:, 1], off[:, 0]), 2 * np.pi),
        np.hypot(least[:, 0], least[:, 1]),
        tcpa,
    )
