"""The support function of a ship's reachable set, in closed form and in the ship's course frame.

Course frame: x along the reported course, y to starboard, origin at the reported antenna position;
an angle b is the direction (cos b, sin b).  The support h(b) is the largest value of
(cos b, sin b) . s over all points s of the set; it determines a convex set completely, and the
support of a Minkowski sum is the sum of the supports.
"""

import numpy as np

from companion.messages import FloatArray

Values = FloatArray | float


def support_straight(
    speed_mps: Values,
    age_s: Values,
    until_s: Values,
    *,
    speed_noise_mps: Values,
    course_noise_rad: Values,
    bow_m: Values = 0.0,
    stern_m: Values = 0.0,
    port_m: Values = 0.0,
    starboard_m: Values = 0.0,
    heading_offset_rad: Values = 0.0,
    heading_error_rad: Values = 0.0,
    position_error_m: Values = 0.0,
    directions_rad: Values,
) -> FloatArray:
    """(..., k) metres: support of everything the hull can cover from `age_s` until `until_s`.

    All arguments but the last broadcast to a common shape (...); `directions_rad` is (k,) or
    (..., k), from the course, clockwise.  `heading_offset_rad` is the hull's heading minus the
    course.  `until_s` below `age_s` counts as `age_s`.
    """
    directions = np.asarray(directions_rad, dtype=np.float64)
    near, far = motion_radii(speed_mps, age_s, until_s, speed_noise_mps)
    motion = support_motion(near[..., None], far[..., None], _last(course_noise_rad), directions)
    hull = support_hull(
        _last(bow_m),
        _last(stern_m),
        _last(port_m),
        _last(starboard_m),
        _last(heading_error_rad),
        directions - _last(heading_offset_rad),
    )
    return motion + hull + _last(position_error_m)


def motion_radii(
    speed_mps: Values, age_s: Values, until_s: Values, speed_noise_mps: Values
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest signed distance run along a ray, metres.

    A speed below its noise may be negative: the ship drifts astern, farthest at the end.
    """
    speed, noise, age = np.asarray(speed_mps), np.asarray(speed_noise_mps), np.asarray(age_s)
    until = np.maximum(age, until_s)
    slow = speed - noise
    return np.minimum(age * slow, until * slow), np.asarray(until * (speed + noise))


def support_motion(
    near_m: Values, far_m: Values, course_noise_rad: Values, directions_rad: Values
) -> FloatArray:
    """Support of hull(t conv V, T conv V), V the sector of velocities.

    With bounds that hold at every instant the displacement after tau is tau times a mean of
    velocities, and the means of all signals in V are conv V (Aumann): the set is exact for
    time-varying noise.  The union over tau in [t, T] is the convex hull of the sector from
    `near_m` to `far_m`, a ring's piece whose inner arc is replaced by its chord.
    """
    ahead = arc_cosine(directions_rad, course_noise_rad)
    astern = arc_cosine(directions_rad + np.pi, course_noise_rad)
    return np.maximum(np.maximum(far_m * ahead, near_m * ahead), -near_m * astern)


def support_hull(
    bow_m: Values,
    stern_m: Values,
    port_m: Values,
    starboard_m: Values,
    heading_error_rad: Values,
    directions_rad: Values,
) -> FloatArray:
    """Support of the hull rectangle around its antenna, turned by up to `heading_error_rad` either way.

    Directions are from the hull's heading.
    """
    turn = known_turn(heading_error_rad)
    longitudinal = (bow_m, np.negative(stern_m), np.negative(stern_m), bow_m)
    lateral = (starboard_m, starboard_m, np.negative(port_m), np.negative(port_m))
    supports = [
        np.hypot(x, y) * arc_cosine(directions_rad - np.arctan2(y, x), turn)
        for x, y in zip(longitudinal, lateral, strict=True)
    ]
    return np.asarray(np.maximum.reduce(np.broadcast_arrays(*supports)), dtype=np.float64)


def known_turn(heading_error_rad: Values) -> FloatArray:
    """The error taken as it is up to a quarter turn; a heading known worse counts as unknown (pi).

    The hull is then its circumscribed circle around the antenna: sound, and simpler than the hull
    of four arcs that overlap all round.
    """
    return np.where(np.asarray(heading_error_rad) > np.pi / 2, np.pi, heading_error_rad)


def arc_cosine(angle_rad: Values, half_angle_rad: Values) -> FloatArray:
    """Support in direction `angle_rad` of the unit arc of directions within +-`half_angle_rad`."""
    beyond = np.abs(np.remainder(np.asarray(angle_rad) + np.pi, 2 * np.pi) - np.pi) - half_angle_rad
    return np.asarray(np.cos(np.maximum(beyond, 0.0)), dtype=np.float64)


def _last(value: Values) -> FloatArray:
    return np.asarray(value, dtype=np.float64)[..., None]
