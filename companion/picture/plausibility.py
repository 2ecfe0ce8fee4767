"""Can this report come from the ship we know?  Innovation gate and impossible speed.

A constant-velocity Kalman filter runs beside each ship (`straight_filter`).  A report is plausible when its
normalised innovation squared is inside the chi-square gate *and* the way from the last fix is possible at
all; one that the straight filter refuses is tried again with the turn the ship was in (`turning_mode`).  The
filter judges; it never moves the set that is steered by.
"""

import math
from typing import NamedTuple

import msgspec
from msgspec.structs import replace

from companion.instant import NS_PER_S, elapsed_s
from companion.messages import ContactReport, TargetKind
from companion.picture.area import distance_m, offset_m
from companion.picture.bounds import Assumptions
from companion.picture.straight_filter import VELOCITY_SIGMA_MPS, Motion, Pair, update
from companion.picture.turning_mode import TurningMode

GATE = {4: 23.5, 2: 18.4}  # chi-square quantiles 0.9999 for 4 and 2 degrees of freedom
_GATE_BOTH, _GATE_POSITION = GATE[4], GATE[2]
_CLASS_A = TargetKind.CLASS_A
_SLUGGISH_MPS2, _NIMBLE_MPS2 = 0.5, 1.5  # accelerations of class A, and of all others
_PLANE_M = 10_000.0
_SPEED_MARGIN = 1.25  # what is possible is a little more than what is expected


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


class _Found(msgspec.Struct, gc=False):
    """What the straight filter makes of a report; see `straight_filter.update`."""

    innovation: float
    gate: float
    det: float
    motion: Motion
    moved_m: Pair
    drift: Pair


class Gate:
    """Judges reports against motions; keeps no state of its own."""

    def __init__(self, assumptions: Assumptions) -> None:
        self._assumptions = assumptions
        self._turning = TurningMode()
        # at hand, since every report is judged: what any ship can do, and two sigma of either flag
        self._any_ship_mps = _SPEED_MARGIN * assumptions.contacts.top_speed_mps
        errors_m = assumptions.contacts.coarse_position_error_m, assumptions.contacts.position_error_m
        self._sigmas_m = errors_m[0] / 2, errors_m[1] / 2

    def begin(self, report: ContactReport) -> Motion:
        """The motion a single report tells; its position must be there."""
        velocity = _velocity_mps(report)
        sigma_m = self._sigma_m(report)
        sigma_mps = VELOCITY_SIGMA_MPS if velocity else self._assumptions.top_speed_mps(report) / 2
        north_mps, east_mps = velocity or (0.0, 0.0)
        return Motion(report, 0.0, 0.0, north_mps, east_mps, sigma_m**2, 0.0, sigma_mps**2)

    def follow(self, known: Motion, report: ContactReport) -> Motion | None:
        """The motion after `report`, measured after `known`, where it goes on straight, as nearly always.

        None says no more than that `judge` is to be asked.
        """
        found = self._go_on(known, report)
        return found.motion if found is not None and found.innovation <= found.gate else None

    def judge(self, known: Motion, report: ContactReport) -> Judgement:
        """Whether `report`, measured after `known`, can be the same ship."""
        found = self._go_on(known, report)
        if found is None:
            return Judgement(False, math.inf, self.begin(report))
        motion, gate = found.motion, found.gate
        surprise = found.innovation + 2 * math.log(found.det)
        if found.innovation <= gate:
            return Judgement(True, surprise, motion)
        turned, surprise_turned = self._turning.judge(
            (known.north_m, known.east_m, known.north_mps, known.east_mps),
            (known.position_m2, known.both_m2ps, known.velocity_m2ps2),
            known.turn_radps,
            (*found.moved_m, *(_velocity_mps(report) or ())),
            motion.since_s,
            found.drift,
            (self._sigma_m(report) ** 2, VELOCITY_SIGMA_MPS**2),
        )
        if turned <= gate:
            anew = replace(self.begin(report), cog_before_rad=motion.cog_before_rad, since_s=motion.since_s)
            return Judgement(True, surprise_turned, anew)
        return Judgement(False, surprise, motion)

    def _go_on(self, known: Motion, report: ContactReport) -> _Found | None:
        """None for an impossible way."""
        before = known.report
        dt = (report.measured_at - before.measured_at) / NS_PER_S
        north_m, east_m = moved_m = offset_m(
            before.latitude_deg,  # type: ignore[arg-type]  # reports with a position only, in all of this
            before.longitude_deg,  # type: ignore[arg-type]
            report.latitude_deg,  # type: ignore[arg-type]
            report.longitude_deg,  # type: ignore[arg-type]
        )
        at_ease_m = min(self._any_ship_mps * dt, _PLANE_M)
        if north_m * north_m + east_m * east_m > at_ease_m * at_ease_m and not self._is_possible(
            before, report, moved_m, dt
        ):
            return None
        # what an unknown acceleration adds to the variances of position and velocity
        faster = (_SLUGGISH_MPS2 if report.kind is _CLASS_A else _NIMBLE_MPS2) * dt
        drift = (faster * dt / 2) ** 2, faster**2
        velocity = _velocity_mps(report)
        innovation, det, motion = update(known, report, moved_m, velocity, dt, drift, self._sigma_m(report))
        gate = _GATE_POSITION if velocity is None else _GATE_BOTH
        return _Found(innovation, gate, det, motion, moved_m, drift)

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
        return self._sigmas_m[report.accurate] + (report.sog_mps or 0.0) * report.age_error_s


def _place(report: ContactReport) -> Pair:
    assert report.latitude_deg is not None
    assert report.longitude_deg is not None
    return report.latitude_deg, report.longitude_deg


def _velocity_mps(report: ContactReport) -> Pair | None:
    sog, cog = report.sog_mps, report.cog_rad
    return None if sog is None or cog is None else (sog * math.cos(cog), sog * math.sin(cog))
