"""Free water around one place: the cheap proof that whatever is wanted leaves a way out.

Stopping is a way out for a vehicle that comes to rest where no set can come before the information
ends.  Let no tube reach within r (beyond the margins) of a place p0.  Tubes only shrink while time passes,
so from any p nearer to p0 than r less the way it takes to stop, stopping is a way out: nothing
needs to be rolled out.  Without this proof the guard looks for a way out as ever.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.config import Config
from companion.instant import Instant, after, elapsed_s
from companion.messages import OwnState
from companion.planning.guard.clearance import Clearance
from companion.planning.guard.margins import BETWEEN_M, Margins
from companion.reach import Slices

AHEAD_S = 30.0  # a berth is proven for this long: ships whose bounds end meanwhile are grown so far
WIDEST_M = 250.0  # farther than this nobody needs to know


@dataclass(frozen=True, slots=True)
class Berth:
    """No set comes within the margins and `radius_m` of a place before `until`, nor ever to one at rest."""

    north_m: float
    east_m: float
    radius_m: float
    until: Instant

    @classmethod
    def around(cls, own: OwnState, slices: Slices, now: Instant, margins: Margins, config: Config) -> "Berth":
        """The widest at the vehicle's place, up to `WIDEST_M`."""
        lookahead_s = config.guard.lookahead_s + AHEAD_S
        speed = config.vehicle.max_speed_mps
        clearance = Clearance(slices, now, margins, speed, lookahead_s, own.position_m)
        radius = -math.inf
        if not clearance.unknown.any():
            place = own.position_m[:1], own.position_m[1:]
            radius = float(clearance.room_to_stay(np.zeros(1), *place, beyond_m=WIDEST_M)[0])
        return cls(own.north_m, own.east_m, min(radius, WIDEST_M), after(now, AHEAD_S))

    def holds(self, now: Instant, own: OwnState, to_stop_m: float) -> bool:
        """Whether the vehicle stays inside, coming to rest within `to_stop_m`."""
        return now <= self.until and self._away_m(own) + to_stop_m < self.radius_m

    def may_be_better(self, now: Instant, own: OwnState, to_stop_m: float) -> bool:
        """Whether asking again can help: it has run out, or the vehicle has come far enough."""
        return now > self.until or self._away_m(own) >= max(to_stop_m - self.radius_m, LEAST_M)

    def _away_m(self, own: OwnState) -> float:
        return math.hypot(own.north_m - self.north_m, own.east_m - self.east_m)


LEAST_M = 2.0  # moved, before it is looked at again


def to_stop_m(now: Instant, own: OwnState, config: Config) -> float:
    """How far the vehicle may go, whatever it was and is told, before a command to stop has stopped it."""
    vehicle, guard = config.vehicle, config.guard
    moving = math.hypot(own.velocity_ned_mps[0], own.velocity_ned_mps[1])
    fastest = max(moving, vehicle.max_speed_mps)
    held_s = guard.setpoint_delay_s + 1.0 / config.timing.rate_hz + vehicle.speed_lag_s
    aside_m = moving * vehicle.speed_lag_s  # motion across the hull dies out beside the rest
    return moving * max(elapsed_s(own.stamp, now), 0.0) + fastest * held_s + aside_m + BETWEEN_M
