"""Watches the assumptions the guard's claim rests on, and says so when one is left.

Each is a configuration key: the tracking error, the current, the position's accuracy, and the bounds
that reports foretell.
"""

import math

import numpy as np

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import OwnState, Reason, Tracks
from companion.planning.guard.foretold import foretold
from companion.planning.guard.jumps import SLACK_MPS, Jumps
from companion.planning.guard.way_out import WayOut

MEMORY_S = 30.0  # a broken assumption stays a reason for this long
SMOOTHING_S = 5.0


class Watch:
    """Compares what happens with what was declared."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._own: OwnState | None = None
        self._surfaced_at: Instant | None = None
        self._sent = np.zeros(2)
        self._made = np.zeros(2)
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
        """The velocity made good against the one sent, both smoothed: a current beyond the declared one."""
        last = self._own
        dt = 0.0 if last is None else max(elapsed_s(last.stamp, own.stamp), 0.0)
        share = 1.0 - math.exp(-dt / SMOOTHING_S)
        self._sent += share * (np.array(sent) - self._sent)
        self._made += share * (np.array(own.velocity_ned_mps[:2]) - self._made)
        missing = float(np.hypot(*(self._sent - self._made)))
        allowed = self._config.guard.current_mps + SLACK_MPS
        if missing <= allowed or self._following_since is None:
            self._following_since = now
        turning_s = math.pi / self._config.vehicle.max_turn_rate_radps + 2 * SMOOTHING_S
        if elapsed_s(self._following_since, now) > turning_s:
            text = f"makes {missing:.1f} m/s less than sent, guard.current_mps = {allowed - SLACK_MPS:g}"
            self._note(now, "guard.current", text)
