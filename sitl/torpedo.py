"""A torpedo-shaped vehicle, 2 m long, in six degrees of freedom: the plant, without any control.

Coefficients of the REMUS 100 (1.33 m) from T. Prestero, "Verification of a Six-Degree of Freedom Simulation
Model for the REMUS Autonomous Underwater Vehicle", MIT/WHOI 2001, scaled to 2 m as a geometrically similar
body: a coefficient that multiplies lengths to the k-th power grows by (2 / 1.33)^k.  The terms linear in sway
and yaw are those of the steering model of L. Fodrea, "Obstacle avoidance control for the REMUS autonomous
underwater vehicle", NPS 2002 (Y_v -66.6, Y_r 2.2, N_v -4.47, N_r -6.87 at 1.543 m/s), with which it holds a
straight course; the pitch plane has the same, as the fins are a cross.  They include what the water that
moves along does (Munk's moment), which is in C(nu) here: the lift of body and fins is left.  Weight equals
buoyancy.
"""

from dataclasses import dataclass

from sitl.rigid_body import Matrix, Six, coriolis, inverse, matrix, times

LENGTH_M = 2.0
RADIUS_M = 0.15
SCALE = LENGTH_M / 1.33
GRAVITY_MPS2 = 9.80665
FIN_LIMIT_RAD = 0.237  # 13.6 degrees, Prestero's table 2.2


@dataclass(frozen=True, slots=True)
class Actuators:
    """Propeller thrust, fin angles, and what the tunnel thrusters add: newtons, radians, newton metres.

    A positive rudder turns to starboard, positive stern planes pitch the bow up.
    """

    thrust_n: float = 0.0
    rudder_rad: float = 0.0
    planes_rad: float = 0.0
    heave_n: float = 0.0
    pitch_nm: float = 0.0
    yaw_nm: float = 0.0


S2, S3, S4, S5 = (SCALE**k for k in (2, 3, 4, 5))
MASS_KG = 30.48 * S3
GRAVITY_BELOW_M = 0.0196 * SCALE  # centre of gravity below that of buoyancy
_IX, _IY = 0.177 * S5, 3.45 * S5
_XU, _YV, _YR, _KP, _NR = 0.93 * S3, 35.5 * S3, 1.93 * S4, 0.0704 * S5, 4.88 * S5
_MZ = MASS_KG * GRAVITY_BELOW_M

# rigid body and added mass; the body is as good as symmetric above and below, port and starboard
MASS: Matrix = matrix(
    (
        (MASS_KG + _XU, 0, 0, 0, _MZ, 0),
        (0, MASS_KG + _YV, 0, -_MZ, 0, -_YR),
        (0, 0, MASS_KG + _YV, 0, _YR, 0),
        (0, -_MZ, 0, _IX + _KP, 0, 0),
        (_MZ, 0, _YR, 0, _IY + _NR, 0),
        (0, -_YR, 0, 0, 0, _IY + _NR),
    )
)
INVERSE = inverse(MASS)

X_UU = 1.62 * S2
Y_VV, Y_RR, Y_UV, Y_UR = 131.0 * S2, 0.632 * S4, 66.6 / 1.543 * S2, (2.2 / 1.543 + 0.93) * S3
N_VV, N_RR = 3.18 * S3, 94.0 * S5
N_UV, N_UR = (35.5 - 0.93 - 4.47 / 1.543) * S3, (6.87 / 1.543 + 1.93) * S4
K_PP = 0.13 * S5
Y_FIN, N_FIN = 9.64 * S2, 6.15 * S3


def damping(nu: Six) -> Six:
    """D(nu) nu: drag, and the lift of body and fixed fins."""
    u, v, w, p, q, r = nu
    return (
        X_UU * u * abs(u),
        Y_VV * v * abs(v) - Y_RR * r * abs(r) + Y_UV * u * v - Y_UR * u * r,
        Y_VV * w * abs(w) + Y_RR * q * abs(q) + Y_UV * u * w + Y_UR * u * q,
        K_PP * p * abs(p),
        -N_VV * w * abs(w) + N_RR * q * abs(q) + N_UV * u * w + N_UR * u * q,
        N_VV * v * abs(v) + N_RR * r * abs(r) - N_UV * u * v + N_UR * u * r,
    )


def restoring(sin_roll: float, sin_pitch: float, cos_pitch: float) -> Six:
    """g(eta) of a neutrally buoyant body whose weight acts below its buoyancy."""
    moment = MASS_KG * GRAVITY_MPS2 * GRAVITY_BELOW_M
    return (0.0, 0.0, 0.0, moment * cos_pitch * sin_roll, moment * sin_pitch, 0.0)


def forces(actuators: Actuators, u: float) -> Six:
    """tau: fins work by the flow past them."""
    flow = u * abs(u)
    return (
        actuators.thrust_n,
        -Y_FIN * flow * actuators.rudder_rad,
        Y_FIN * flow * actuators.planes_rad + actuators.heave_n,
        0.0,
        N_FIN * flow * actuators.planes_rad + actuators.pitch_nm,
        N_FIN * flow * actuators.rudder_rad + actuators.yaw_nm,
    )


def acceleration(nu: Six, gravity: Six, tau: Six) -> Six:
    """nu'."""
    c, d = coriolis(MASS, nu), damping(nu)
    net = tuple(t - a - b - g for t, a, b, g in zip(tau, c, d, gravity, strict=True))
    return times(INVERSE, net)  # type: ignore[arg-type]
