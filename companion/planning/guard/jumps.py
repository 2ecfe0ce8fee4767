"""Jumps of the vehicle's own position: until one is explained, the position is known that much worse.

What motion and the declared accuracy do not explain is added up as a vector.  A position that jumps back
explains itself; else the jump is believed only after a while at the surface without another one.
"""

import math

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import OwnState

SETTLED_S = 30.0  # at the surface, without a jump
SLACK_MPS = 0.2  # velocities measured over ground are this uncertain
GAP_S = 2.0  # states farther apart: it may have stopped and gone on, only its speed is bounded


class Jumps:
    """`unexplained_m` enlarges the declared position error."""

    def __init__(self, config: Config) -> None:
        self._guard = config.guard
        self._fastest_mps = config.vehicle.max_speed_mps + config.guard.current_mps
        self._surfaced_depth_m = config.vehicle.surfaced_depth_m
        self._last: OwnState | None = None
        self._off = (0.0, 0.0)
        self._allowed_m = 0.0
        self._settling_since: Instant | None = None

    @property
    def unexplained_m(self) -> float:
        """How far the position may be off beyond what is declared."""
        off = math.hypot(*self._off)
        return off if off > self._allowed_m else 0.0

    def look(self, now: Instant, own: OwnState, submerged_s: float) -> float:
        """How far (m) this state jumped beyond what motion explains; 0 within the declared accuracy."""
        last, self._last = self._last, own
        if last is None or own.stamp == last.stamp:
            return 0.0
        self._settle(now, own)
        dt = elapsed_s(last.stamp, own.stamp)
        north = own.north_m - last.north_m - 0.5 * (last.velocity_ned_mps[0] + own.velocity_ned_mps[0]) * dt
        east = own.east_m - last.east_m - 0.5 * (last.velocity_ned_mps[1] + own.velocity_ned_mps[1]) * dt
        allowed = 2 * self._guard.own_position_error_m + self._guard.own_position_drift_mps * submerged_s
        allowed += SLACK_MPS * max(dt, 0.0)
        off = math.hypot(north, east)
        moved_m = math.hypot(own.north_m - last.north_m, own.east_m - last.east_m)
        if off <= allowed or (dt > GAP_S and moved_m <= self._fastest_mps * dt + allowed):
            return 0.0
        self._off = self._off[0] + north, self._off[1] + east
        self._allowed_m = allowed
        self._settling_since = None
        return off

    def _settle(self, now: Instant, own: OwnState) -> None:
        if own.depth_m > self._surfaced_depth_m:
            self._settling_since = None
            return
        if self._settling_since is None:
            self._settling_since = now
        if elapsed_s(self._settling_since, now) >= SETTLED_S:
            self._off = (0.0, 0.0)
