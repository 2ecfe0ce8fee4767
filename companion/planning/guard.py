"""The last word on every velocity: a guard that trusts nobody.

It uses the vehicle's own state, the autopilot's heartbeat and the exact reachable sets, nothing
of the field or the network.  It starts closed and opens only while every precondition holds.

Distance rule, for every ship i, with d_i the distance to the ship's tube over the lookahead and
n_i the direction away from it (a control barrier, as a half-space in the velocity):

    n_i . v  >=  -rate * (d_i - delta - own position error)

The tube over [now, now + lookahead] does not move within the lookahead and only shrinks as time
passes, so holding the rule keeps d_i from falling below the margin.  The velocity returned is the
one nearest to the wanted one that satisfies every rule and the speed limit.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion import reach
from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import AutopilotHeartbeat, FloatArray, OwnState, Reason, Tracks
from companion.planning.creep import creep
from companion.planning.halfspace import nearest_velocity

Velocity = tuple[float, float, float]

CHANGE_TOLERANCE_MPS = 1e-6  # below this a velocity counts as let through unchanged


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the guard lets through: `velocity_ned_mps` is None while it is closed."""

    velocity_ned_mps: Velocity | None
    changed: bool
    reasons: tuple[Reason, ...]
    distance_m: float = math.inf  # to the nearest tube over the lookahead


class Guard:
    """Stateless but for its limits: the same inputs give the same verdict."""

    def __init__(self, config: Config) -> None:
        self._autopilot = config.autopilot
        self._vehicle = config.vehicle
        self._guard = config.guard
        self._margin_m = config.field.delta_m + config.guard.own_position_error_m

    def check(
        self,
        now: Instant,
        own: OwnState | None,
        heartbeat: AutopilotHeartbeat | None,
        tracks: Tracks,
        reports_heard: int,
        wanted_ned_mps: Velocity | None,
    ) -> Verdict:
        """Judge one wanted velocity (NED, m/s)."""
        if self._is_prestream(now, heartbeat):
            text = "zero velocity so that PX4 admits OFFBOARD (autopilot.prestream_offboard)"
            return Verdict((0.0, 0.0, 0.0), False, (Reason("guard.prestream", text),))
        missing = self._missing(now, own, heartbeat, reports_heard, wanted_ned_mps)
        if missing or own is None or wanted_ned_mps is None:
            return Verdict(None, False, tuple(missing))
        reasons: list[Reason] = []
        horizontal, distance_m = self._keep_distance(now, own, tracks, np.array(wanted_ned_mps[:2]), reasons)
        horizontal = creep(horizontal, own, self._vehicle)  # also where the guard itself says "hold"
        down = self._limit_vertical(own, wanted_ned_mps[2], reasons)
        velocity = (float(horizontal[0]), float(horizontal[1]), down)
        changed = math.dist(velocity, wanted_ned_mps) > CHANGE_TOLERANCE_MPS
        return Verdict(velocity, changed, tuple(reasons), distance_m)

    def _is_prestream(self, now: Instant, heartbeat: AutopilotHeartbeat | None) -> bool:
        """PX4 outside OFFBOARD ignores setpoints but wants to see a stream before it admits the mode."""
        return (
            self._autopilot.prestream_offboard
            and heartbeat is not None
            and heartbeat.firmware == "px4"
            and not heartbeat.takes_setpoints
            and elapsed_s(heartbeat.stamp, now) <= self._autopilot.heartbeat_timeout_s
        )

    def _missing(
        self,
        now: Instant,
        own: OwnState | None,
        heartbeat: AutopilotHeartbeat | None,
        reports_heard: int,
        wanted: Velocity | None,
    ) -> list[Reason]:
        """Preconditions that do not hold."""
        missing: list[Reason] = []

        def need(holds: bool, code: str, text: str) -> None:
            if not holds:
                missing.append(Reason(code, text))

        if heartbeat is None:
            need(False, "guard.no_heartbeat", "no autopilot heartbeat heard yet")
        else:
            silent_s = elapsed_s(heartbeat.stamp, now)
            limit_s = self._autopilot.heartbeat_timeout_s
            need(silent_s <= limit_s, "guard.heartbeat_lost", f"no autopilot heartbeat for {silent_s:.1f} s")
            need(heartbeat.armed, "guard.disarmed", "vehicle is disarmed")
            need(
                heartbeat.takes_setpoints,
                "guard.mode",
                f"autopilot is in {heartbeat.mode}, not GUIDED or OFFBOARD: hands off",
            )
        if own is None:
            need(False, "guard.no_position", "no own position heard yet")
        else:
            old_s = elapsed_s(own.stamp, now)
            limit_s = self._autopilot.position_timeout_s
            need(old_s <= limit_s, "guard.position_lost", f"own position is {old_s:.1f} s old")
            numbers = (own.north_m, own.east_m, own.depth_m, *own.velocity_ned_mps)
            need(all(map(math.isfinite, numbers)), "guard.position_invalid", "own position is not a number")
        need(reports_heard > 0, "guard.no_report", "no contact report ever heard: that is not an empty sea")
        need(wanted is not None, "guard.no_plan", "the planner gave no velocity")
        if wanted is not None:
            need(all(map(math.isfinite, wanted)), "guard.plan_invalid", "the planner's velocity is no number")
        return missing

    def _keep_distance(
        self, now: Instant, own: OwnState, tracks: Tracks, wanted: FloatArray, reasons: list[Reason]
    ) -> tuple[FloatArray, float]:
        """The nearest horizontal velocity (2,) that satisfies the distance rule and the speed limit."""
        limit_mps = self._vehicle.max_speed_mps
        if not len(tracks):
            return _shorten(wanted, limit_mps, reasons), math.inf
        age_s = tracks.age_s(now)
        nearest = reach.tube(tracks, now, age_s + self._guard.lookahead_s).nearest(own.position_m)
        room_m = nearest.distance_m - self._margin_m
        bound_mps = -self._guard.approach_rate_per_s * room_m
        # a set that grows at top speed around us cannot be left: such water is unknown, so hold in it
        unknown = (age_s + self._guard.lookahead_s > tracks.validity_s) & (room_m < 0)
        if unknown.any():
            text = f"{int(unknown.sum())} ships silent for too long can be here: holding"
            reasons.append(Reason("guard.unknown_water", text))
            wanted = np.zeros(2)
        # a ship whose rule even full speed straight at it satisfies cannot matter
        binding = np.flatnonzero((bound_mps > -limit_mps) & ~unknown)
        velocity = _shorten(wanted, limit_mps, reasons)
        closest = int(np.argmin(nearest.distance_m))
        distance_m = float(nearest.distance_m[closest])
        if distance_m < self._margin_m and not unknown[closest]:
            reasons.append(
                Reason(
                    "guard.inside_margin",
                    f"{distance_m:.1f} m from where MMSI {tracks.mmsi[closest]} can be "
                    f"within {self._guard.lookahead_s:g} s",
                )
            )
        if binding.size:
            kept, feasible = nearest_velocity(
                velocity, nearest.away[binding], np.minimum(bound_mps[binding], limit_mps), limit_mps
            )
            if not feasible:
                reasons.append(
                    Reason("guard.no_way_out", "no velocity keeps away from every ship: flying the least bad")
                )
            elif float(np.abs(kept - velocity).max()) > CHANGE_TOLERANCE_MPS:
                mmsi = tracks.mmsi[binding[int(np.argmax(bound_mps[binding]))]]
                reasons.append(Reason("guard.distance", f"kept from closing on MMSI {mmsi}"))
            velocity = kept
        return velocity, distance_m

    def _limit_vertical(self, own: OwnState, down_mps: float, reasons: list[Reason]) -> float:
        """The down velocity within the climb limit and above the floor."""
        limit = self._vehicle.max_vertical_speed_mps
        kept = min(max(down_mps, -limit), limit)
        floor_m = self._vehicle.max_depth_m
        if own.depth_m + kept > floor_m and kept > 0:  # one second ahead
            kept = max(0.0, floor_m - own.depth_m) if own.depth_m < floor_m else -limit
            reasons.append(Reason("guard.depth", f"kept above vehicle.max_depth_m = {floor_m:g}"))
        return kept


def _shorten(velocity: FloatArray, limit_mps: float, reasons: list[Reason]) -> FloatArray:
    speed = float(np.hypot(velocity[0], velocity[1]))
    if speed <= limit_mps * (1 + 1e-9):
        return velocity
    reasons.append(Reason("guard.speed", f"{speed:.2f} m/s cut to vehicle.max_speed_mps = {limit_mps:g}"))
    return velocity * (limit_mps / speed)
