"""Can this report come from the ship we know?  Innovation gate and impossible speed.

A constant-velocity Kalman filter runs beside each ship, on the plane through its newest fix:

    x = (north, east, v_north, v_east),   x' = F(dt) x + w,   z = x or its first half

with w a white acceleration.  A report is plausible when its normalised innovation squared is
inside the chi-square gate *and* the way from the last fix is possible at all.  The filter judges;
it never moves the set that is steered by.
"""

import math
from dataclasses import dataclass

import numpy as np
from filterpy.kalman import KalmanFilter

from companion.geodesy import LocalFrame
from companion.instant import elapsed_s
from companion.messages import ContactReport, FloatArray, TargetKind
from companion.picture.area import distance_m
from companion.picture.bounds import Assumptions

GATE = {4: 23.5, 2: 18.4}  # chi-square quantiles 0.9999 for 4 and 2 degrees of freedom
_ACCELERATION_MPS2 = {TargetKind.CLASS_A: 0.5, TargetKind.CLASS_B: 1.5, TargetKind.UNKNOWN: 1.5}
_VELOCITY_SIGMA_MPS = 0.5
_SPEED_MARGIN = 1.25  # what is possible is a little more than what is expected
_IDENTITY = np.eye(4)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A ship's fix with its filter: mean (4,) in m and m/s relative to the fix, covariance (4, 4)."""

    report: ContactReport
    plane: LocalFrame
    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
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
        self._filters = {n: KalmanFilter(dim_x=4, dim_z=n) for n in GATE}

    def begin(self, report: ContactReport) -> Motion:
        """The motion a single report tells; its position must be there."""
        velocity = _velocity_mps(report)
        sigma_m = self._sigma_m(report)
        sigma_mps = _VELOCITY_SIGMA_MPS if velocity else self._assumptions.top_speed_mps(report) / 2
        mean = np.array((0.0, 0.0, *(velocity or (0.0, 0.0))))
        covariance = np.diag((sigma_m**2, sigma_m**2, sigma_mps**2, sigma_mps**2))
        return Motion(report, _plane(report), mean, covariance)

    def judge(self, known: Motion, report: ContactReport) -> Judgement:
        """Whether `report`, measured after `known`, can be the same ship."""
        dt = elapsed_s(known.report.measured_at, report.measured_at)
        if not self.can_lead_to(known.report, report):
            return Judgement(False, math.inf, self.begin(report))
        moved = known.plane.to_local(*_place(report))
        velocity = _velocity_mps(report)
        measured = np.array((*moved, *(velocity or ())))
        kalman = self._filters[len(measured)]
        kalman.x, kalman.P = known.mean, known.covariance
        kalman.predict(F=_transition(dt), Q=_disturbance(dt, _ACCELERATION_MPS2[report.kind]))
        sigma_m = self._sigma_m(report)
        variances = np.array((sigma_m, sigma_m, _VELOCITY_SIGMA_MPS, _VELOCITY_SIGMA_MPS)) ** 2
        size = len(measured)
        kalman.update(measured, R=np.diag(variances[:size]), H=_IDENTITY[:size])
        innovation = float(kalman.y @ kalman.SI @ kalman.y)
        surprise = innovation + float(np.linalg.slogdet(kalman.S)[1])
        mean = kalman.x - np.array((*moved, 0.0, 0.0))
        after = Motion(report, _plane(report), mean, np.array(kalman.P))
        return Judgement(innovation <= GATE[size], surprise, after)

    def can_lead_to(self, before: ContactReport, report: ContactReport) -> bool:
        """Whether the way from one place to the other is possible at all in the time between."""
        top_mps = max(self._assumptions.top_speed_mps(before), self._assumptions.top_speed_mps(report))
        dt = elapsed_s(before.measured_at, report.measured_at)
        time_s = dt + before.age_error_s + report.age_error_s
        errors_m = self._assumptions.position_error_m(before) + self._assumptions.position_error_m(report)
        return distance_m(*_place(before), *_place(report)) <= _SPEED_MARGIN * top_mps * time_s + errors_m

    def _sigma_m(self, report: ContactReport) -> float:
        """The bounds are taken for two sigma here."""
        return self._assumptions.position_error_m(report) / 2 + (report.sog_mps or 0.0) * report.age_error_s


def _place(report: ContactReport) -> tuple[float, float]:
    assert report.latitude_deg is not None
    assert report.longitude_deg is not None
    return report.latitude_deg, report.longitude_deg


def _plane(report: ContactReport) -> LocalFrame:
    return LocalFrame(*_place(report))


def _velocity_mps(report: ContactReport) -> tuple[float, float] | None:
    if report.sog_mps is None or report.cog_rad is None:
        return None
    return report.sog_mps * math.cos(report.cog_rad), report.sog_mps * math.sin(report.cog_rad)


def _transition(dt: float) -> FloatArray:
    f = np.eye(4)
    f[0, 2] = f[1, 3] = dt
    return f


def _disturbance(dt: float, acceleration_mps2: float) -> FloatArray:
    """Covariance of an unknown acceleration over `dt`.

    Position and velocity are left uncorrelated, for between two reports a ship may turn and turn
    back; the rank-one form of a constant acceleration refuses pilot boats that reverse.
    """
    position_m, velocity_mps = acceleration_mps2 * dt * dt / 2, acceleration_mps2 * dt
    return np.diag((position_m**2, position_m**2, velocity_mps**2, velocity_mps**2))
