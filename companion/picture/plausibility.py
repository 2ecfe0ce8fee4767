"""Can this report come from the ship we know?  Innovation gate and impossible speed.

A constant-velocity Kalman filter runs beside each ship, on the plane through its newest fix:

    x = (north, east, v_north, v_east),   x' = F(dt) x + w,   z = x or its first half

with w an unknown acceleration.  All its noises are alike in north and east, so the two axes never mix and
share one 2 x 2 covariance: the update is a dozen products, twenty times cheaper than the general filter,
which the tests hold it against.  A report is plausible when its normalised innovation squared is inside the
chi-square gate *and* the way from the last fix is possible at all; one that the straight filter refuses is
tried again with the turn the ship was in (`turning_mode`).  The filter judges; it never moves the set that
is steered by.
"""

import math
from typing import NamedTuple

from companion.instant import NS_PER_S, elapsed_s
from companion.messages import ContactReport, TargetKind
from companion.picture.area import distance_m, offset_m
from companion.picture.bounds import Assumptions
from companion.picture.turning_mode import TurningMode

GATE = {4: 23.5, 2: 18.4}  # chi-square quantiles 0.9999 for 4 and 2 degrees of freedom
_GATE_BOTH, _GATE_POSITION = GATE[4], GATE[2]
_CLASS_A = TargetKind.CLASS_A
_SLUGGISH_MPS2, _NIMBLE_MPS2 = 0.5, 1.5  # accelerations of class A, and of all others
_PLANE_M = 10_000.0
_VELOCITY_SIGMA_MPS = 0.5
_SPEED_MARGIN = 1.25  # what is possible is a little more than what is expected

Pair = tuple[float, float]


class Motion(NamedTuple):
    """A ship's fix with its filter, relative to the fix."""

    report: ContactReport
    offset_m: Pair  # north, east
    velocity_mps: Pair
    covariance: tuple[float, float, float]  # of either axis: position, both, velocity
    turn_radps: float = 0.0  # of the course between the last two fixes


class Judgement(NamedTuple):
    """What the gate found.

    `surprise` is twice the negative log likelihood but for a constant: the squared, normalised
    innovation and ln |S|, S its covariance.  Of two places that both fit it is smaller for the one
    that foretold the report; the bare innovation would be smaller for the vaguer one.  It is infinite
    for impossible speed.
    """

    plausible: bool
    surprise: float
    motion: Motion  # the filter after this report, should it be believed


class Gate:
    """Judges reports against motions; keeps no state of its own."""

    def __init__(self, assumptions: Assumptions) -> None:
        self._assumptions = assumptions
        self._turning = TurningMode()
        # at hand, since every report is judged: what any ship can do, and two sigma of either flag
        self._any_ship_mps = _SPEED_MARGIN * assumptions.contacts.top_speed_mps
        self._errors_m = assumptions.contacts.coarse_position_error_m, assumptions.contacts.position_error_m

    def begin(self, report: ContactReport, turn_radps: float = 0.0) -> Motion:
        """The motion a single report tells; its position must be there."""
        velocity = _velocity_mps(report)
        sigma_m = self._sigma_m(report)
        sigma_mps = _VELOCITY_SIGMA_MPS if velocity else self._assumptions.top_speed_mps(report) / 2
        return Motion(report, (0.0, 0.0), velocity or (0.0, 0.0), (sigma_m**2, 0.0, sigma_mps**2), turn_radps)

    def judge(self, known: Motion, report: ContactReport) -> Judgement:
        """Whether `report`, measured after `known`, can be the same ship."""
        before = known.report
        dt = (report.measured_at - before.measured_at) / NS_PER_S
        moved = offset_m(
            before.latitude_deg,  # type: ignore[arg-type]  # reports with a position only, in all of this
            before.longitude_deg,  # type: ignore[arg-type]
            report.latitude_deg,  # type: ignore[arg-type]
            report.longitude_deg,  # type: ignore[arg-type]
        )
        off_m = math.hypot(moved[0], moved[1])
        at_ease_m = min(self._any_ship_mps * dt, _PLANE_M)
        if off_m > at_ease_m and not self._is_possible(before, report, moved, dt):
            return Judgement(False, math.inf, self.begin(report))
        acceleration = _SLUGGISH_MPS2 if report.kind is _CLASS_A else _NIMBLE_MPS2
        drift = (acceleration * dt * dt / 2) ** 2, (acceleration * dt) ** 2
        sigma_m2 = self._sigma_m(report) ** 2
        velocity = _velocity_mps(report)
        turn = _turn_radps(before, report, dt)
        straight = _update(known, moved, velocity, dt, drift, sigma_m2)
        gate = _GATE_POSITION if velocity is None else _GATE_BOTH
        if straight[0] <= gate:
            return Judgement(True, straight[1], Motion(report, straight[2], straight[3], straight[4], turn))
        innovation, surprise = self._turning.judge(
            (*known.offset_m, *known.velocity_mps),
            known.covariance,
            known.turn_radps,
            (*moved, *(velocity or ())),
            dt,
            drift,
            (sigma_m2, _VELOCITY_SIGMA_MPS**2),
        )
        if innovation <= gate:
            return Judgement(True, surprise, self.begin(report, turn))
        return Judgement(False, straight[1], Motion(report, *straight[2:], turn))

    def can_lead_to(self, before: ContactReport, report: ContactReport) -> bool:
        """Whether the way from one place to the other is possible at all in the time between."""
        moved = offset_m(*_place(before), *_place(report))
        return self._is_possible(before, report, moved, elapsed_s(before.measured_at, report.measured_at))

    def _is_possible(self, before: ContactReport, report: ContactReport, moved_m: Pair, dt: float) -> bool:
        """The distance on the plane serves up to 10 km, beyond it that on the sphere."""
        off_m = math.hypot(*moved_m)
        time_s = dt + before.age_error_s + report.age_error_s
        top_mps = max(self._assumptions.top_speed_mps(before), self._assumptions.top_speed_mps(report))
        errors_m = self._assumptions.position_error_m(before) + self._assumptions.position_error_m(report)
        room_m = _SPEED_MARGIN * top_mps * time_s + errors_m
        if off_m < _PLANE_M:
            return off_m <= room_m
        return distance_m(*_place(before), *_place(report)) <= room_m

    def _sigma_m(self, report: ContactReport) -> float:
        """The bounds are taken for two sigma here."""
        return self._errors_m[report.accurate] / 2 + (report.sog_mps or 0.0) * report.age_error_s


def _update(
    known: Motion, moved: Pair, velocity: Pair | None, dt: float, drift: Pair, sigma_m2: float
) -> tuple[float, float, Pair, Pair, tuple[float, float, float]]:
    """Innovation squared, surprise, and the filter after: offset from the new fix, velocity, covariance."""
    a, b, c = known.covariance
    a, b, c = a + dt * (2 * b + dt * c) + drift[0], b + dt * c, c + drift[1]
    expected_n = known.offset_m[0] + dt * known.velocity_mps[0]
    expected_e = known.offset_m[1] + dt * known.velocity_mps[1]
    off_n, off_e = moved[0] - expected_n, moved[1] - expected_e
    fast_n, fast_e = known.velocity_mps
    s = a + sigma_m2
    if velocity is None:
        innovation, surprise = (off_n * off_n + off_e * off_e) / s, 2 * math.log(s)
        k, m = a / s, b / s
        after = (1 - k) * a, (1 - k) * b, c - m * b
        offset = expected_n + k * off_n - moved[0], expected_e + k * off_e - moved[1]
        return innovation, innovation + surprise, offset, (fast_n + m * off_n, fast_e + m * off_e), after
    more_n, more_e = velocity[0] - fast_n, velocity[1] - fast_e
    w = c + _VELOCITY_SIGMA_MPS**2
    det = s * w - b * b
    # the inverse of ((s, b), (b, w)); the same for both axes
    p, q, r = w / det, -b / det, s / det
    innovation = p * (off_n * off_n + off_e * off_e) + r * (more_n * more_n + more_e * more_e)
    innovation += 2 * q * (off_n * more_n + off_e * more_e)
    kp, kv = a * p + b * q, a * q + b * r  # gains of the position
    mp, mv = b * p + c * q, b * q + c * r  # and of the velocity
    offset = (
        expected_n + kp * off_n + kv * more_n - moved[0],
        expected_e + kp * off_e + kv * more_e - moved[1],
    )
    speed = fast_n + mp * off_n + mv * more_n, fast_e + mp * off_e + mv * more_e
    after = a - kp * a - kv * b, b - kp * b - kv * c, c - mp * b - mv * c
    return innovation, innovation + 2 * math.log(det), offset, speed, after


def _place(report: ContactReport) -> Pair:
    assert report.latitude_deg is not None
    assert report.longitude_deg is not None
    return report.latitude_deg, report.longitude_deg


def _velocity_mps(report: ContactReport) -> Pair | None:
    if report.sog_mps is None or report.cog_rad is None:
        return None
    return report.sog_mps * math.cos(report.cog_rad), report.sog_mps * math.sin(report.cog_rad)


def _turn_radps(before: ContactReport, report: ContactReport, dt: float) -> float:
    """The rate at which the course changed; 0 where it cannot be told."""
    if before.cog_rad is None or report.cog_rad is None or dt <= 0:
        return 0.0
    return math.remainder(report.cog_rad - before.cog_rad, math.tau) / dt
