"""The bundled submarine: the torpedo with its autopilot's inner loops for speed, heading and depth rate.

Its autopilot knows the current (an EKF with DVL) and steers against it; on a heading that is not yet the
wanted one it makes only the wanted velocity's share along the hull.
"""

import math
from dataclasses import dataclass

from companion.geodesy import wrap_pi
from sitl.rigid_body import Six, angle_rates, runge_kutta, to_body, to_ned
from sitl.torpedo import (
    FIN_LIMIT_RAD,
    MASS,
    N_FIN,
    N_RR,
    N_UR,
    X_UU,
    Actuators,
    acceleration,
    forces,
    restoring,
)
from sitl.vehicle import STANDS_STILL_MPS, Demand, Limits, VehicleState

SUBSTEP_S = 0.05
MAX_THRUST_N = 120.0
MAX_HEAVE_N = 60.0
MAX_TUNNEL_NM = 60.0
MAX_PITCH_RAD = 0.45
SPEED_RATE = 1.2  # of the loops, per second
YAW_RATE, YAW_DAMPING = 0.8, 3.0
PITCH_RATE, PITCH_DAMPING = 1.0, 3.0
HEAVE_RATE = 0.8
SINK_GAIN = 2.0
LIMITS = Limits()


@dataclass(frozen=True, slots=True)
class BodyState(VehicleState):
    """What six degrees of freedom need beyond the common state, through the water in body axes."""

    sway_mps: float = 0.0
    heave_mps: float = 0.0
    roll_rate_radps: float = 0.0
    pitch_rate_radps: float = 0.0
    yaw_rate_radps: float = 0.0

    @property
    def nu(self) -> Six:
        """(u, v, w, p, q, r)."""
        return (
            self.speed_mps,
            self.sway_mps,
            self.heave_mps,
            self.roll_rate_radps,
            self.pitch_rate_radps,
            self.yaw_rate_radps,
        )


@dataclass(frozen=True, slots=True)
class Submarine:
    """A `vehicle.Dynamics`; `limits` holds what the loops ask for at most, the physics sets the lags."""

    limits: Limits = LIMITS
    current_ned_mps: tuple[float, float] = (0.0, 0.0)

    def start(self, north_m: float, east_m: float, depth_m: float, heading_rad: float) -> VehicleState:
        """The vehicle at rest through water: it drifts with the current."""
        drift = (*self.current_ned_mps, 0.0)
        heading = wrap_pi(heading_rad)
        return BodyState(north_m, east_m, max(depth_m, 0.0), heading, velocity_ned_mps=drift)

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off, neutrally buoyant."""
        body = state if isinstance(state, BodyState) else _of(state)
        count = max(math.ceil(dt_s / SUBSTEP_S - 1e-9), 1)
        for _ in range(count):
            actuators = Actuators() if demand is None else self.pilot(body, demand)
            body = self.move(body, actuators, dt_s / count)
        return body

    def pilot(self, state: BodyState, demand: Demand) -> Actuators:
        """The loops: from a velocity over ground to thrust, fins and tunnel thrusters."""
        limits = self.limits
        north, east, down = demand.velocity_ned_mps
        north, east = north - self.current_ned_mps[0], east - self.current_ned_mps[1]
        wanted = math.hypot(north, east)
        stands = wanted < STANDS_STILL_MPS
        error = 0.0 if stands else wrap_pi(math.atan2(east, north) - state.heading_rad)
        ahead = wanted if stands else min(wanted, limits.max_speed_mps) * max(math.cos(error), 0.0)
        down = _within(down, limits.max_vertical_speed_mps)

        u, _, w, _, q, r = state.nu
        sink = to_ned(state.roll_rad, state.pitch_rad, 0.0, (u, state.sway_mps, w))[2]
        climb = _within((down + SINK_GAIN * (down - sink)) / max(u, 1.0), math.sin(MAX_PITCH_RAD))
        pitch = -math.asin(climb) * min(max(u, 0.0), 1.0)
        along = ahead / max(math.cos(state.pitch_rad), 0.5)  # a horizontal speed is wanted
        thrust = X_UU * along * abs(along) + MASS[0][0] * SPEED_RATE * (along - u)
        turn = _within(YAW_RATE * error, limits.max_turn_rate_radps)
        yaw_nm = N_RR * turn * abs(turn) + N_UR * u * turn + MASS[5][5] * YAW_DAMPING * (turn - r)
        tilt = PITCH_RATE * (pitch - state.pitch_rad)
        pitch_nm = MASS[4][4] * PITCH_DAMPING * (tilt - q)
        pitch_nm += restoring(0.0, math.sin(state.pitch_rad), 1.0)[4]
        heave = _within(MASS[2][2] * HEAVE_RATE * (down - sink), MAX_HEAVE_N)
        rudder, yaw_left = _allot(yaw_nm, u)
        planes, pitch_left = _allot(pitch_nm, u)
        return Actuators(_within(thrust, MAX_THRUST_N), rudder, planes, heave, pitch_left, yaw_left)

    def move(self, state: BodyState, actuators: Actuators, dt_s: float) -> BodyState:
        """The physics alone: `dt_s` later with the actuators held."""
        drift = self.current_ned_mps

        def rate(x: tuple[float, ...]) -> tuple[float, ...]:
            roll, pitch, yaw, *nu = x[3:]
            north, east, down = to_ned(roll, pitch, yaw, (nu[0], nu[1], nu[2]))
            turning = angle_rates(roll, pitch, nu[3], nu[4], nu[5])
            gravity = restoring(math.sin(roll), math.sin(pitch), math.cos(pitch))
            changed = acceleration(tuple(nu), gravity, forces(actuators, nu[0]))  # type: ignore[arg-type]
            return (north + drift[0], east + drift[1], down, *turning, *changed)

        place = (
            state.north_m,
            state.east_m,
            state.depth_m,
            state.roll_rad,
            state.pitch_rad,
            state.heading_rad,
        )
        new = runge_kutta(rate, (*place, *state.nu), dt_s)
        north, east, depth, roll, pitch, yaw, *nu = new
        through = to_ned(roll, pitch, yaw, (nu[0], nu[1], nu[2]))
        if depth <= 0.0:  # at the surface: no higher
            depth, through = 0.0, (through[0], through[1], max(through[2], 0.0))
            nu[:3] = to_body(roll, pitch, yaw, through)
        return BodyState(
            north,
            east,
            depth,
            wrap_pi(yaw),
            nu[0],
            angle_rates(roll, pitch, nu[3], nu[4], nu[5])[2],
            roll,
            pitch,
            (through[0] + drift[0], through[1] + drift[1], through[2]),
            nu[1],
            nu[2],
            nu[3],
            nu[4],
            nu[5],
        )


def _of(state: VehicleState) -> BodyState:
    return BodyState(
        state.north_m,
        state.east_m,
        state.depth_m,
        state.heading_rad,
        state.speed_mps,
        state.turn_rate_radps,
        state.roll_rad,
        state.pitch_rad,
        state.velocity_ned_mps,
        yaw_rate_radps=state.turn_rate_radps,
    )


def _allot(moment_nm: float, u: float) -> tuple[float, float]:
    """Fin angle for a moment, and what is left to the tunnel thrusters."""
    power = N_FIN * max(u, 0.0) ** 2
    fin = _within(moment_nm / power, FIN_LIMIT_RAD) if power > 1.0 else 0.0
    return fin, _within(moment_nm - power * fin, MAX_TUNNEL_NM)


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
