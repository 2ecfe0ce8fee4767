"""The vehicle itself: where it is, how fresh that is, and what its autopilot is ready for.

The local frame's origin is the first position ever heard and never moves, so every later
number in a log refers to one frame.
"""

import math

from companion.config import Autopilot
from companion.geodesy import LocalFrame
from companion.instant import Instant, elapsed_s
from companion.messages import AutopilotHeartbeat, OwnPosition, OwnState, Reason

JUMP_FLOOR_M = 30.0  # GNSS noise and the re-fix after a dive stay below this
JUMP_SPEED_MPS = 15.0  # no vehicle this project serves is faster
JUMP_MEMORY_S = 5.0  # how long a jump stays a reason


class Ownship:
    """Keeps the newest position and heartbeat; says what is wrong with them."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._limits = autopilot
        self._state: OwnState | None = None
        self._jumped_at: Instant | None = None
        self._jump_m = 0.0
        self.frame: LocalFrame | None = None
        self.heartbeat: AutopilotHeartbeat | None = None
        self.jumps = 0

    def observe_position(self, position: OwnPosition) -> None:
        """Take a position that carries a depth and a velocity; others say too little to steer by."""
        if position.depth_m is None or position.velocity_ned_mps is None:
            return
        if self.frame is None:
            self.frame = LocalFrame(position.latitude_deg, position.longitude_deg)
        north_m, east_m = self.frame.to_local(position.latitude_deg, position.longitude_deg)
        last = self._state
        if last is not None:
            if position.stamp < last.stamp:
                return
            self._watch_for_jump(last, position.stamp, north_m, east_m)
        heading = position.heading_rad
        if heading is None and last is not None:
            heading = last.heading_rad
        self._state = OwnState(
            position.stamp, north_m, east_m, position.depth_m, position.velocity_ned_mps, heading
        )

    def observe_heartbeat(self, heartbeat: AutopilotHeartbeat) -> None:
        """Take the autopilot's own word."""
        self.heartbeat = heartbeat

    def state(self) -> OwnState | None:
        """The newest state, however old: who steers by it checks its stamp."""
        return self._state

    def is_ready(self, now: Instant) -> bool:
        """Position and heartbeat are fresh, the vehicle is armed and takes velocity setpoints."""
        return (
            self._state is not None
            and elapsed_s(self._state.stamp, now) <= self._limits.position_timeout_s
            and self.heartbeat is not None
            and elapsed_s(self.heartbeat.stamp, now) <= self._limits.heartbeat_timeout_s
            and self.heartbeat.armed
            and self.heartbeat.takes_setpoints
        )

    def doubts(self, now: Instant) -> list[Reason]:
        """What an operator should know about the position."""
        if self._jumped_at is None or elapsed_s(self._jumped_at, now) > JUMP_MEMORY_S:
            return []
        return [Reason("own.position_jumped", f"own position jumped {self._jump_m:.0f} m")]

    def _watch_for_jump(self, last: OwnState, stamp: Instant, north_m: float, east_m: float) -> None:
        moved_m = math.hypot(north_m - last.north_m, east_m - last.east_m)
        if moved_m > JUMP_FLOOR_M + JUMP_SPEED_MPS * elapsed_s(last.stamp, stamp):
            self.jumps += 1
            self._jumped_at, self._jump_m = stamp, moved_m
