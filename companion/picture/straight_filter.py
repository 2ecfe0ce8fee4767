"""The gate's filter: a ship that goes on straight, but for an unknown acceleration.

On the plane through its newest fix, with filterpy's names:

    x = (north, east, v_north, v_east),   x' = F(dt) x + w,   z = x or its first half

All noises are alike in north and east, so the two axes never mix and share one 2 x 2 covariance: the update
is a dozen products, a hundred times cheaper than filterpy's general one, which the tests hold it against.
"""

import math

import msgspec

from companion.messages import ContactReport

VELOCITY_SIGMA_MPS = 0.5
_VELOCITY_R = VELOCITY_SIGMA_MPS**2
Pair = tuple[float, float]  # north, east


class Motion(msgspec.Struct, frozen=True, gc=False):
    """A ship's fix with its filter, relative to the fix.  One is made of every report: flat, and no tuple."""

    report: ContactReport
    north_m: float
    east_m: float
    north_mps: float
    east_mps: float
    position_m2: float  # the covariance of either axis: position, both, velocity
    both_m2ps: float
    velocity_m2ps2: float
    cog_before_rad: float | None = None  # of the fix before, where it was of the same motion
    since_s: float = 0.0  # from that to this one

    @property
    def turn_radps(self) -> float:
        """The rate at which the course changed between the last two fixes; 0 where it cannot be told."""
        before, course = self.cog_before_rad, self.report.cog_rad
        if before is None or course is None or self.since_s <= 0:
            return 0.0
        return math.remainder(course - before, math.tau) / self.since_s


def update(
    known: Motion,
    report: ContactReport,
    moved_m: Pair,
    velocity_mps: Pair | None,
    dt: float,
    drift: Pair,
    sigma_m: float,
) -> tuple[float, float, Motion]:
    """Squared innovation; the root of its covariance's determinant; the motion after `report`.

    `moved_m` is the way from the old fix to the new, `velocity_mps` what the report says of it, if anything;
    `drift` the process noise, of position and velocity, m2 and m2/s2; `sigma_m` the position's error.
    """
    moved_n, moved_e = moved_m
    fast_n, fast_e = known.north_mps, known.east_mps
    a, b, c = known.position_m2, known.both_m2ps, known.velocity_m2ps2
    a, b, c = a + dt * (2 * b + dt * c) + drift[0], b + dt * c, c + drift[1]
    expected_n, expected_e = known.north_m + dt * fast_n, known.east_m + dt * fast_e
    off_n, off_e = moved_n - expected_n, moved_e - expected_e
    s = a + sigma_m * sigma_m
    cog = known.report.cog_rad
    if velocity_mps is None:
        k, m = a / s, b / s
        motion = Motion(
            report,
            expected_n + k * off_n - moved_n,
            expected_e + k * off_e - moved_e,
            fast_n + m * off_n,
            fast_e + m * off_e,
            (1 - k) * a,
            (1 - k) * b,
            c - m * b,
            cog,
            dt,
        )
        return (off_n * off_n + off_e * off_e) / s, s, motion
    more_n, more_e = velocity_mps[0] - fast_n, velocity_mps[1] - fast_e
    w = c + _VELOCITY_R
    det = s * w - b * b
    # the inverse of ((s, b), (b, w)); the same for both axes
    p, q, r = w / det, -b / det, s / det
    innovation = p * (off_n * off_n + off_e * off_e) + r * (more_n * more_n + more_e * more_e)
    innovation += 2 * q * (off_n * more_n + off_e * more_e)
    kp, kv = a * p + b * q, a * q + b * r  # gains of the position
    mp, mv = b * p + c * q, b * q + c * r  # and of the velocity
    motion = Motion(
        report,
        expected_n + kp * off_n + kv * more_n - moved_n,
        expected_e + kp * off_e + kv * more_e - moved_e,
        fast_n + mp * off_n + mv * more_n,
        fast_e + mp * off_e + mv * more_e,
        a - kp * a - kv * b,
        b - kp * b - kv * c,
        c - mp * b - mv * c,
        cog,
        dt,
    )
    return innovation, det, motion
