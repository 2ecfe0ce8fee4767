"""Which mode the autopilot is in and whose velocity it flies: the rules of its profile, no bytes.

The rules are those measured on the real ones: a setpoint with another mask or frame is dropped,
so is one outside the setpoint mode or while disarmed, and some time after the last one the
velocity is void.
"""

import math
from collections import Counter

from companion.instant import Instant, elapsed_s
from sitl.profiles import Flight, Mode, Profile
from sitl.vehicle import Demand

_STREAM_PROOF_S = 1.0  # PX4: how long a stream must have lasted before OFFBOARD
_IGNORE_VZ = 0x20
_REST = Demand((0.0, 0.0, 0.0), hold_heading=True)
_RISE = Demand((0.0, 0.0, -math.inf), hold_heading=True)


class Guided:
    """Modes, arming and velocity setpoints.

    `operator_mode` is the mode the operator wants (None: the setpoint mode): entered at the
    start, or, where the firmware asks for a stream of setpoints first, as soon as there is one.
    After that the operator's hands are off.  `complaints` collects texts for STATUSTEXT.
    """

    def __init__(self, profile: Profile, *, armed: bool, operator_mode: str | None) -> None:
        self.profile = profile
        self.armed = armed
        self.mode = next(mode for mode in profile.modes if mode.flight is Flight.REST)
        self.counts: Counter[str] = Counter()
        self.complaints: list[str] = []
        self._velocity: tuple[float, float, float] | None = None
        self._taken_at: Instant | None = None
        self._stream_since: Instant | None = None
        self._stream_at: Instant | None = None
        self._operator = profile.setpoint_mode if operator_mode is None else profile.mode(operator_mode)
        if self._operator is not None and self._can_enter(self._operator, Instant(0)):
            self._enter(self._operator)

    def offer(self, t: Instant, mask: int, frame: int, velocity: tuple[float, float, float]) -> None:
        """A velocity setpoint came in; take it or drop it, and count which."""
        if mask & _IGNORE_VZ:
            velocity = (*velocity[:2], 0.0)
        if mask not in self.profile.masks:
            self.counts["setpoint.mask"] += 1
            self._complain(self.profile.mask_complaint)
        elif frame not in self.profile.frames:
            self.counts["setpoint.frame"] += 1
        elif not all(map(math.isfinite, velocity)):
            self.counts["setpoint.nan"] += 1
        else:
            self._note_stream(t)
            self._take(t, velocity)

    def _take(self, t: Instant, velocity: tuple[float, float, float]) -> None:
        if not self.armed:
            self.counts["setpoint.disarmed"] += 1
        elif self.mode.flight is not Flight.SETPOINTS:
            self.counts["setpoint.mode"] += 1
        else:
            self.counts["setpoint.taken"] += 1
            self._velocity, self._taken_at = velocity, t

    def _note_stream(self, t: Instant) -> None:
        gap = self.profile.stream_gap_s
        if gap is None:
            return
        if self._stream_at is None or elapsed_s(self._stream_at, t) > gap:
            self._stream_since = t
        self._stream_at = t
        if self._operator is not None and self._can_enter(self._operator, t):
            self._enter(self._operator)

    def _can_enter(self, mode: Mode, t: Instant) -> bool:
        gap = self.profile.stream_gap_s
        if gap is None or mode.flight is not Flight.SETPOINTS:
            return True
        if self._stream_at is None or self._stream_since is None:
            return False
        lasted_s = elapsed_s(self._stream_since, self._stream_at)
        return lasted_s >= _STREAM_PROOF_S and elapsed_s(self._stream_at, t) <= gap

    def _enter(self, mode: Mode) -> None:
        self.mode = mode
        self._operator = None
        self._velocity = None
        # a firmware that asks for a stream also times it from the first moment
        self._taken_at = self._stream_at if mode.flight is Flight.SETPOINTS else None

    def change_mode(self, number: int, t: Instant) -> bool:
        """Enter the mode of this custom_mode number; False when it refuses."""
        mode = self.profile.mode(number)
        if mode is None or not self._can_enter(mode, t):
            self.counts["mode.refused"] += 1
            return False
        self._enter(mode)
        return True

    def arm(self, armed: bool) -> None:
        """Arm or disarm; a setpoint does not outlive it."""
        self.armed = armed
        self._velocity = self._taken_at = None

    def check_timeout(self, t: Instant) -> None:
        """Void the velocity when setpoints have stopped."""
        profile = self.profile
        if self._taken_at is None or elapsed_s(self._taken_at, t) <= profile.setpoint_timeout_s:
            return
        self.counts["setpoint.timeout"] += 1
        self._complain(profile.timeout_complaint)
        self._taken_at = None
        self._velocity = None if profile.timeout_holds_heading else (0.0, 0.0, 0.0)
        fallback = profile.mode(profile.after_timeout or "")
        if fallback is not None:
            self._enter(fallback)

    def demand(self, t: Instant) -> Demand | None:
        """What the hull is asked to do now; None while disarmed."""
        self.check_timeout(t)
        if not self.armed:
            return None
        if self.mode.flight is Flight.SURFACE:
            return _RISE
        if self.mode.flight is Flight.SETPOINTS and self._velocity is not None:
            return Demand(self._velocity)
        return _REST

    def _complain(self, text: str) -> None:
        if text:
            self.complaints.append(text)
