"""Six degrees of freedom in Fossen's notation:  M nu' + C(nu) nu + D(nu) nu + g(eta) = tau.

nu = (u, v, w, p, q, r): velocity through the water and turn rates in body axes (forward, starboard, down).
M holds the rigid body and the water that moves with it; C follows from M (Kirchhoff), so that it does no
work.  A constant current carries all of it along.  Plain floats: four evaluations a step must be cheap.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

Six = tuple[float, float, float, float, float, float]
Matrix = tuple[Six, ...]


def matrix(rows: Sequence[Sequence[float]]) -> Matrix:
    """A 6 x 6 matrix as tuples."""
    return tuple(tuple(float(x) for x in row) for row in rows)  # type: ignore[misc]


def inverse(m: Matrix) -> Matrix:
    """Its inverse."""
    return matrix(np.linalg.inv(np.array(m)).tolist())


def times(m: Matrix, x: Six) -> Six:
    """m x."""
    a, b, c, d, e, f = x
    return tuple(r[0] * a + r[1] * b + r[2] * c + r[3] * d + r[4] * e + r[5] * f for r in m)  # type: ignore[return-value]


def coriolis(m: Matrix, nu: Six) -> Six:
    """C(nu) nu: what the momentum M nu does in axes that turn."""
    u, v, w, p, q, r = nu
    a, b, c, d, e, f = times(m, nu)
    return (
        q * c - r * b,
        r * a - p * c,
        p * b - q * a,
        v * c - w * b + q * f - r * e,
        w * a - u * c + r * d - p * f,
        u * b - v * a + p * e - q * d,
    )


def energy_j(m: Matrix, nu: Six) -> float:
    """Kinetic energy of body and water."""
    return 0.5 * sum(a * b for a, b in zip(nu, times(m, nu), strict=True))


def to_ned(
    roll: float, pitch: float, yaw: float, body: tuple[float, float, float]
) -> tuple[float, float, float]:
    """A vector in body axes turned to north, east, down."""
    u, v, w = body
    cr, sr, cp, sp, cy, sy = (
        math.cos(roll),
        math.sin(roll),
        math.cos(pitch),
        math.sin(pitch),
        math.cos(yaw),
        math.sin(yaw),
    )
    return (
        cy * cp * u + (cy * sp * sr - sy * cr) * v + (cy * sp * cr + sy * sr) * w,
        sy * cp * u + (sy * sp * sr + cy * cr) * v + (sy * sp * cr - cy * sr) * w,
        -sp * u + cp * sr * v + cp * cr * w,
    )


def to_body(
    roll: float, pitch: float, yaw: float, ned: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The inverse of `to_ned`."""
    columns = [to_ned(roll, pitch, yaw, e) for e in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    a, b, c = (sum(x * y for x, y in zip(column, ned, strict=True)) for column in columns)
    return a, b, c


def angle_rates(roll: float, pitch: float, p: float, q: float, r: float) -> tuple[float, float, float]:
    """Rates of roll, pitch and yaw for body turn rates; the pitch stays clear of the vertical."""
    turned = q * math.sin(roll) + r * math.cos(roll)
    return p + turned * math.tan(pitch), q * math.cos(roll) - r * math.sin(roll), turned / math.cos(pitch)


def runge_kutta(
    rate: Callable[[tuple[float, ...]], tuple[float, ...]], x: tuple[float, ...], dt: float
) -> tuple[float, ...]:
    """One step of the classical fourth order."""
    k1 = rate(x)
    k2 = rate(tuple(a + 0.5 * dt * b for a, b in zip(x, k1, strict=True)))
    k3 = rate(tuple(a + 0.5 * dt * b for a, b in zip(x, k2, strict=True)))
    k4 = rate(tuple(a + dt * b for a, b in zip(x, k3, strict=True)))
    return tuple(
        a + dt / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(x, k1, k2, k3, k4, strict=True)
    )
