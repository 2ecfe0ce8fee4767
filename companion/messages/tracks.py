"""What is believed of the vehicle and of every ship: the state between report and set."""

import math
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from companion.instant import Instant
from companion.messages.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class OwnState:
    """The vehicle in the local frame, metres and m/s, NED."""

    stamp: Instant
    north_m: float
    east_m: float
    depth_m: float
    velocity_ned_mps: tuple[float, float, float]
    heading_rad: float | None

    @property
    def position_m(self) -> FloatArray:
        """(2,) north, east."""
        return np.array((self.north_m, self.east_m))

    def distance_to_m(self, point_m: FloatArray) -> float:
        """Horizontal distance to a point (2,)."""
        return math.hypot(point_m[0] - self.north_m, point_m[1] - self.east_m)


class Model(IntEnum):
    """Which obstacle model describes a contact."""

    STRAIGHT = 0  # course and speed known within bounds (the paper's ship)
    DISC = 1  # anywhere at up to `disc_speed_mps`
    TURNING = 2  # as STRAIGHT, but course and hull turn at a bounded rate
    KITE = 3  # around the straight prediction, as far as ships were recorded to stray from it
    BOX = 4  # the same, along and across the track independently


SPREAD_AGES_S = (60.0, 120.0, 300.0, 600.0)  # the ages at which `Tracks.spread_m` is stated


def _nothing() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class Tracks:
    """All contacts as arrays, one row each, rows in MMSI order.  Arrays are read-only.

    The reported point is the antenna.  `heading_rad` is the hull's orientation, which is known
    within `heading_error_rad` (pi = unknown: the hull is then its circumscribed circle).
    Every bound is a bound, not a standard deviation.
    """

    revision: int  # grows with every change; equal revisions are equal tracks
    mmsi: IntArray
    measured_at_ns: IntArray
    north_m: FloatArray
    east_m: FloatArray
    cog_rad: FloatArray
    sog_mps: FloatArray
    heading_rad: FloatArray
    bow_m: FloatArray
    stern_m: FloatArray
    port_m: FloatArray
    starboard_m: FloatArray
    position_error_m: FloatArray
    speed_noise_mps: FloatArray
    course_noise_rad: FloatArray
    heading_error_rad: FloatArray
    disc_speed_mps: FloatArray  # of the disc model
    top_speed_mps: FloatArray  # how fast every set grows on all sides beyond its validity
    validity_s: FloatArray  # age up to which the model's bounds hold
    model: IntArray  # of `Model`
    names: tuple[str, ...] = ()
    turn_rate_radps: FloatArray = field(default_factory=_nothing)  # of TURNING, clockwise; default 0
    turn_rate_error_radps: FloatArray = field(default_factory=_nothing)
    draught_m: FloatArray = field(default_factory=_nothing)  # NaN: not available, the default
    # of KITE and BOX: metres ahead, astern and abeam at each of `SPREAD_AGES_S`, 0 at age 0 and linear
    # between; (n, 4, 3), or (n, 0, 3) while no row needs it
    spread_m: FloatArray = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if len(self.draught_m) != len(self.mmsi):
            object.__setattr__(self, "draught_m", np.full(len(self.mmsi), np.nan))
        for name in ("turn_rate_radps", "turn_rate_error_radps"):
            if len(getattr(self, name)) != len(self.mmsi):
                object.__setattr__(self, name, np.zeros(len(self.mmsi)))
        if self.spread_m.ndim != 3:
            object.__setattr__(self, "spread_m", np.empty((len(self.mmsi), 0, 3)))

    @classmethod
    def empty(cls) -> "Tracks":
        """No contacts."""
        x, ids = np.empty(0), np.empty(0, dtype=np.int64)
        return cls(0, ids, ids, x, x, x, x, x, x, x, x, x, x, x, x, x, x, x, x, ids)

    def __len__(self) -> int:
        return len(self.mmsi)

    def age_s(self, now: Instant) -> FloatArray:
        """(n,) seconds since each contact's position was measured, never negative."""
        age: FloatArray = np.maximum((now - self.measured_at_ns) * 1e-9, 0.0)
        return age
