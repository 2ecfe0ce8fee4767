"""Watches the assumptions the guard's claim rests on, and says so when one is left.

Each is a configuration key: the tracking error, the current, the position's accuracy, and the bounds
that reports foretell.
"""

import math

import numpy as np

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, IntArray, OwnState, Reason, Tracks
from companion.planning.guard.way_out import WayOut
from companion.reach import support_straight

MEMORY_S = 30.0  # a broken assumption stays a reason for this long
SMOOTHING_S = 5.0
SLACK_MPS = 0.2  # velocities measured over ground are this uncertain
DIRECTIONS = np.linspace(0.0, 2 * np.pi, 64, endpoint=False)


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
        self.is_foretold = True

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
        old, new = _changed(before, after)
        self.is_foretold = True
        if not len(old):
            return
        elapsed: FloatArray = np.asarray((after.measured_at_ns[new] - before.measured_at_ns[old]) * 1e-9)
        reach = support_straight(
            before.sog_mps[old],
            elapsed,
            elapsed,
            speed_noise_mps=before.speed_noise_mps[old],
            course_noise_rad=before.course_noise_rad[old],
            position_error_m=before.position_error_m[old] + after.position_error_m[new],
            directions_rad=DIRECTIONS,
        )
        angle = before.cog_rad[old][:, None] + DIRECTIONS
        moved_north = (after.north_m[new] - before.north_m[old])[:, None]
        moved_east = (after.east_m[new] - before.east_m[old])[:, None]
        beyond = (np.cos(angle) * moved_north + np.sin(angle) * moved_east - reach).max(axis=1)
        turned = np.abs(np.remainder(after.cog_rad[new] - before.cog_rad[old] + np.pi, 2 * np.pi) - np.pi)
        course = turned > before.course_noise_rad[old] + after.course_noise_rad[new]
        speed = np.abs(after.sog_mps[new] - before.sog_mps[old])
        faster = speed > before.speed_noise_mps[old] + after.speed_noise_mps[new]
        straight = (before.model[old] == 0) & (after.model[new] == 0) & (elapsed <= before.validity_s[old])
        strays = straight & ((beyond > 0) | course | faster)
        if strays.any():
            self.is_foretold = False
            k = int(np.flatnonzero(strays)[0])
            self._unforetold = (
                f"MMSI {after.mmsi[new[k]]} left its declared bounds ({int(strays.sum())} ships)"
            )

    def _note(self, now: Instant, code: str, text: str) -> None:
        self._broken[code] = now, Reason(code, text)

    def _jump(self, now: Instant, own: OwnState) -> None:
        """A position that the last one and the velocity do not explain."""
        last = self._own
        if last is None or own.stamp == last.stamp:
            return
        dt = elapsed_s(last.stamp, own.stamp)
        north = last.north_m + 0.5 * (last.velocity_ned_mps[0] + own.velocity_ned_mps[0]) * dt
        east = last.east_m + 0.5 * (last.velocity_ned_mps[1] + own.velocity_ned_mps[1]) * dt
        off = math.hypot(own.north_m - north, own.east_m - east)
        guard = self._config.guard
        allowed = 2 * guard.own_position_error_m + guard.own_position_drift_mps * self.submerged_s(now)
        allowed += SLACK_MPS * max(dt, 0.0)
        if off > allowed:
            text = f"own position jumped {off:.0f} m, declared accuracy explains {allowed:.0f} m"
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


def _changed(before: Tracks, after: Tracks) -> tuple[IntArray, IntArray]:
    """Rows of single-place ships whose position is newer, in the old tracks and in the new."""
    shared, old, new = np.intersect1d(before.mmsi, after.mmsi, return_indices=True)
    alone = np.array(
        [(before.mmsi == m).sum() == 1 and (after.mmsi == m).sum() == 1 for m in shared], dtype=np.bool_
    )
    newer = after.measured_at_ns[new] > before.measured_at_ns[old]
    keep = newer & alone if len(shared) else np.zeros(0, dtype=np.bool_)
    return old[keep], new[keep]
