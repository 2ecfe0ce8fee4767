"""The bundled boat: three degrees of freedom (surge, sway, yaw) in Fossen's notation, and its inner loops.

Coefficients of CyberShip II (1.255 m, 23.8 kg) from R. Skjetne, O. N. Smogeli, T. I. Fossen, "A nonlinear
ship manoeuvering model: identification and adaptive control with experiments for a model ship", Modeling,
Identification and Control 25 (2004), scaled by Froude's law to 3.8 m: lengths by L, times by sqrt(L), masses
by L^3.  Compared number by number with three independent implementations of that model.

A velocity becomes heading and forward speed over ground, without crabbing; a zero velocity is "heading north,
speed 0", as measured on ArduPilot's Rover; the current carries the boat aside.
"""

import math
from dataclasses import dataclass

from companion.geodesy import wrap_pi
from sitl.rigid_body import runge_kutta
from sitl.vehicle import Demand, Limits, VehicleState

L = 3.0
LENGTH_M = 1.255 * L
SUBSTEP_S = 0.05


def _scaled(value: float, length: float, time: float, mass: float = 1.0) -> float:
    """A model's value in units kg^mass m^length s^time at full scale."""
    return float(value * L ** (3 * mass + length + time / 2))


_MASS, _XG = _scaled(23.8, 0, 0), 0.046 * L
M11 = _MASS + _scaled(2.0, 0, 0)
M22 = _MASS + _scaled(10.0, 0, 0)
M23 = _MASS * _XG
M33 = _scaled(1.76 + 1.0, 2, 0)
X_U, X_UU, X_UUU = _scaled(0.72253, 0, -1), _scaled(1.32742, -1, 0), _scaled(5.86643, -2, 1)
Y_V, Y_VV, Y_R = _scaled(0.88965, 0, -1), _scaled(36.47287, -1, 0), _scaled(7.25, 1, -1)
Y_RV, Y_VR, Y_RR = _scaled(0.805, 0, 0), _scaled(0.845, 0, 0), _scaled(3.45, 1, 0)
N_V, N_VV, N_R = _scaled(0.0313, 1, -1), _scaled(3.95645, 0, 0), _scaled(1.9, 2, -1)
N_RV, N_VR, N_RR = _scaled(0.13, 1, 0), _scaled(0.08, 1, 0), _scaled(0.75, 2, 0)

MAX_THRUST_N, MAX_YAW_NM = 1500.0, 900.0
SPEED_RATE, YAW_RATE, YAW_DAMPING = 0.8, 0.8, 2.0
LIMITS = Limits()


def drag(u: float, v: float, r: float) -> tuple[float, float, float]:
    """D(nu) nu."""
    return (
        X_U * u + X_UU * u * abs(u) + X_UUU * u**3,
        (Y_V + Y_VV * abs(v) + Y_RV * abs(r)) * v + (Y_R + Y_VR * abs(v) + Y_RR * abs(r)) * r,
        -(N_V + N_VV * abs(v) + N_RV * abs(r)) * v + (N_R - N_VR * abs(v) + N_RR * abs(r)) * r,
    )


def acceleration(u: float, v: float, r: float, thrust_n: float, yaw_nm: float) -> tuple[float, float, float]:
    """nu' of M nu' + C(nu) nu + D(nu) nu = tau."""
    sideways = M22 * v + M23 * r
    d = drag(u, v, r)
    surge = thrust_n + sideways * r - d[0]
    sway = -M11 * u * r - d[1]
    yaw = yaw_nm - sideways * u + M11 * u * v - d[2]
    det = M22 * M33 - M23 * M23
    return surge / M11, (M33 * sway - M23 * yaw) / det, (M22 * yaw - M23 * sway) / det


def energy_j(u: float, v: float, r: float) -> float:
    """Kinetic energy of the boat and the water that moves along."""
    return 0.5 * (M11 * u * u + M22 * v * v + 2 * M23 * v * r + M33 * r * r)


@dataclass(frozen=True, slots=True)
class BoatState(VehicleState):
    """What three degrees of freedom need beyond the common state."""

    sway_mps: float = 0.0


@dataclass(frozen=True, slots=True)
class Boat:
    """A `vehicle.Dynamics`."""

    limits: Limits = LIMITS
    current_ned_mps: tuple[float, float] = (0.0, 0.0)

    def start(self, north_m: float, east_m: float, depth_m: float, heading_rad: float) -> VehicleState:  # noqa: ARG002
        """The boat at rest through water: it drifts with the current."""
        drift = (*self.current_ned_mps, 0.0)
        return BoatState(north_m, east_m, 0.0, wrap_pi(heading_rad), velocity_ned_mps=drift)

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off."""
        boat = state if isinstance(state, BoatState) else _of(state)
        count = max(math.ceil(dt_s / SUBSTEP_S - 1e-9), 1)
        for _ in range(count):
            thrust, yaw = (0.0, 0.0) if demand is None else self.pilot(boat, demand)
            boat = self.move(boat, thrust, yaw, dt_s / count)
        return boat

    def pilot(self, state: BoatState, demand: Demand) -> tuple[float, float]:
        """The loops: thrust and yaw moment."""
        north, east, _ = demand.velocity_ned_mps
        limits = self.limits
        wanted = min(math.hypot(north, east), limits.max_speed_mps)
        heading = state.heading_rad
        target = heading if demand.hold_heading else math.atan2(east, north)
        error = wrap_pi(target - heading)
        # the speed controller closes its loop on the forward speed over ground
        drift_north, drift_east = self.current_ned_mps
        helping = drift_north * math.cos(heading) + drift_east * math.sin(heading)
        u, v, r = state.speed_mps, state.sway_mps, state.turn_rate_radps
        ahead = _within(wanted * max(math.cos(error), 0.0) - helping, limits.max_speed_mps)
        turn = _within(YAW_RATE * error, limits.max_turn_rate_radps)
        balance = drag(ahead, 0.0, 0.0)[0] - (M22 * v + M23 * r) * r
        thrust = balance + M11 * SPEED_RATE * (ahead - u)
        steady = drag(u, v, turn)[2] + (M22 - M11) * u * v + M23 * u * turn
        yaw = steady + M33 * YAW_DAMPING * (turn - r)
        return _within(thrust, MAX_THRUST_N), _within(yaw, MAX_YAW_NM)

    def move(self, state: BoatState, thrust_n: float, yaw_nm: float, dt_s: float) -> BoatState:
        """The physics alone: `dt_s` later with thrust and moment held."""
        drift = self.current_ned_mps

        def rate(x: tuple[float, ...]) -> tuple[float, ...]:
            _, _, yaw, u, v, r = x
            cos, sin = math.cos(yaw), math.sin(yaw)
            along = (u * cos - v * sin + drift[0], u * sin + v * cos + drift[1], r)
            return (*along, *acceleration(u, v, r, thrust_n, yaw_nm))

        nu = (state.speed_mps, state.sway_mps, state.turn_rate_radps)
        north, east, yaw, u, v, r = runge_kutta(
            rate, (state.north_m, state.east_m, state.heading_rad, *nu), dt_s
        )
        cos, sin = math.cos(yaw), math.sin(yaw)
        over_ground = (u * cos - v * sin + drift[0], u * sin + v * cos + drift[1], 0.0)
        return BoatState(north, east, 0.0, wrap_pi(yaw), u, r, velocity_ned_mps=over_ground, sway_mps=v)


def _of(state: VehicleState) -> BoatState:
    return BoatState(
        state.north_m,
        state.east_m,
        0.0,
        state.heading_rad,
        state.speed_mps,
        state.turn_rate_radps,
        velocity_ned_mps=state.velocity_ned_mps,
    )


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
