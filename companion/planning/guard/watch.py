"""Watches the assumptions the guard's claim rests on, and says so when one is left.

Each is a configuration key: the tracking error, the current, the position's accuracy, and the bounds
that reports foretell.
"""

import math

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import OwnState, Reason, Tracks
from companion.planning.guard.foretold import foretold
from companion.planning.guard.jumps import GAP_S, Jumps
from companion.planning.guard.rollout import STILL_MPS, Motion, held, motion_of
from companion.planning.guard.way_out import WayOut

MEMORY_S = 30.0  # a broken assumption stays a reason for this long
SMOOTHING_S = 5.0
MEASURED_MPS = 0.1  # a velocity over ground is known this well, smoothed; what hides in it shows as tracking


class Watch:
    """Compares what happens with what was declared."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._own: OwnState | None = None
        self._surfaced_at: Instant | None = None
        self._expected: Motion | None = None  # the model told what was sent
        self._missing = 0.0
        self._following_since: Instant | None = None
        self._broken: dict[str, tuple[Instant, Reason]] = {}
        self._unforetold: str | None = None
        self._jumps = Jumps(config)
        self.is_foretold = True
        self.has_jumped = False  # in the last look, farther than before

    @property
    def unexplained_m(self) -> float:
        """What the position may be off beyond what is declared."""
        return self._jumps.unexplained_m

    def submerged_s(self, now: Instant) -> float:
        """How long the vehicle has been under water."""
        return 0.0 if self._surfaced_at is None else max(elapsed_s(self._surfaced_at, now), 0.0)

    def look(
        self, now: Instant, own: OwnState, flown: WayOut | None, sent: tuple[float, float]
    ) -> list[Reason]:
        """What is, or lately was, outside its declared bound.

        `flown` is the way out being flown, if one is; `sent` the velocity sent last.
        """
        self._jump(now, own)
        if self._surfaced_at is None or own.depth_m <= self._config.vehicle.surfaced_depth_m:
            self._surfaced_at = now
        self._tracking(now, own, flown)
        self._shortfall(now, own, sent)
        self._own = own
        if self._unforetold is not None:
            self._note(now, "guard.report_unforetold", self._unforetold)
            self._unforetold = None
        self._broken = {k: v for k, v in self._broken.items() if elapsed_s(v[0], now) <= MEMORY_S}
        return [reason for _, reason in self._broken.values()]

    def compare(self, before: Tracks, after: Tracks) -> None:
        """New reports against what the old ones foretold; sets `is_foretold`."""
        found = foretold(before, after)
        self.is_foretold = found.holds
        if len(found.strays):
            text = f"MMSI {found.strays[0]} left its declared bounds ({len(found.strays)} ships)"
            self._unforetold = text

    def _note(self, now: Instant, code: str, text: str) -> None:
        self._broken[code] = now, Reason(code, text)

    def _jump(self, now: Instant, own: OwnState) -> None:
        """A position that the last one and the velocity do not explain."""
        before_m = self.unexplained_m
        off = self._jumps.look(now, own, self.submerged_s(now))
        self.has_jumped = self.unexplained_m > before_m
        if off > 0:
            self._note(now, "guard.position_accuracy", f"own position jumped {off:.0f} m")
        elif self.unexplained_m > 0:
            text = f"own position may be {self.unexplained_m:.0f} m off since a jump: margins are that wider"
            self._note(now, "guard.position_accuracy", text)

    def _tracking(self, now: Instant, own: OwnState, flown: WayOut | None) -> None:
        if flown is None:
            return
        off, allowed = flown.deviation_m(own), self._config.guard.tracking_error_m
        if off > allowed:
            text = f"{off:.1f} m off the way out, guard.tracking_error_m = {allowed:g}"
            self._note(now, "guard.tracking", text)

    def _shortfall(self, now: Instant, own: OwnState, sent: tuple[float, float]) -> None:
        """What is made good along the velocity sent, against what the model makes of it, smoothed."""
        vehicle = self._config.vehicle
        dt = 0.0 if self._own is None else max(elapsed_s(self._own.stamp, own.stamp), 0.0)
        if self._expected is None or dt > GAP_S:
            self._expected = motion_of(own, 0.0, math.atan2(sent[1], sent[0]))
        elif dt > 0:
            self._expected = held(self._expected, sent, dt, vehicle)[-1]
        # a drift across is led back; what a way out cannot do without is the speed along it
        north, east = (sent[k] / max(math.hypot(*sent), STILL_MPS) for k in (0, 1))
        expected, made = self._expected.velocity_mps, own.velocity_ned_mps
        missing = (expected[0] - made[0]) * north + (expected[1] - made[1]) * east
        self._missing += -math.expm1(-dt / SMOOTHING_S) * (missing - self._missing)
        declared = self._config.guard.current_mps
        if self._missing <= declared + MEASURED_MPS or self._following_since is None:
            self._following_since = now
        if elapsed_s(self._following_since, now) > math.pi / vehicle.max_turn_rate_radps + 2 * SMOOTHING_S:
            text = f"makes {self._missing:.1f} m/s less than sent, guard.current_mps = {declared:g}"
            self._note(now, "guard.current", text)
