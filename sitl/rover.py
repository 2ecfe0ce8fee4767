"""The bundled ground vehicle: a differential drive whose wheels follow their commands with a lag.

    v = (left + right) / 2        r = (left - right) / track            (heading clockwise)

Numbers of a Clearpath Jackal: track 0.376 m, wheels up to 2 m/s.  It can turn on the spot; its wheels do not
slip.  A velocity becomes heading and forward speed, as on ArduPilot's Rover.
"""

import math
from dataclasses import dataclass

from companion.geodesy import wrap_pi
from sitl.vehicle import Demand, Limits, VehicleState

TRACK_M = 0.376
MAX_WHEEL_MPS = 2.0
MAX_WHEEL_MPS2 = 4.0
WHEEL_LAG_S = 0.1
HEADING_RATE = 3.0
LIMITS = Limits(max_speed_mps=0.5, max_turn_rate_radps=2.0)


@dataclass(frozen=True, slots=True)
class WheelState(VehicleState):
    """The common state, and the speeds of the wheels over ground."""

    left_mps: float = 0.0
    right_mps: float = 0.0


@dataclass(frozen=True, slots=True)
class Rover:
    """A `vehicle.Dynamics`."""

    limits: Limits = LIMITS

    def start(self, north_m: float, east_m: float, depth_m: float, heading_rad: float) -> VehicleState:  # noqa: ARG002
        """The vehicle at rest."""
        return WheelState(north_m, east_m, 0.0, wrap_pi(heading_rad))

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off, wheels braked."""
        left, right = self.pilot(state, demand) if demand is not None else (0.0, 0.0)
        before = (
            state
            if isinstance(state, WheelState)
            else WheelState(state.north_m, state.east_m, 0.0, state.heading_rad)
        )
        return self.move(before, left, right, dt_s)

    def pilot(self, state: VehicleState, demand: Demand) -> tuple[float, float]:
        """The loops: wheel speeds for a velocity."""
        north, east, _ = demand.velocity_ned_mps
        wanted = min(math.hypot(north, east), self.limits.max_speed_mps)
        target = state.heading_rad if demand.hold_heading else math.atan2(east, north)
        error = wrap_pi(target - state.heading_rad)
        ahead = wanted * max(math.cos(error), 0.0)
        limit = self.limits.max_turn_rate_radps
        turn = min(max(HEADING_RATE * error, -limit), limit)
        half = turn * TRACK_M / 2
        excess = max((abs(ahead) + abs(half)) / MAX_WHEEL_MPS, 1.0)  # turning goes on, both get slower
        return (ahead + half) / excess, (ahead - half) / excess

    def move(self, state: WheelState, left_mps: float, right_mps: float, dt_s: float) -> WheelState:
        """The kinematics: wheels approach their commands, the body follows the arc between them."""
        left = _approach(state.left_mps, left_mps, dt_s)
        right = _approach(state.right_mps, right_mps, dt_s)
        speed = (state.left_mps + state.right_mps + left + right) / 4  # mean over the step
        rate = (state.left_mps - state.right_mps + left - right) / (2 * TRACK_M)
        turned = rate * dt_s
        # the chord of an arc: exact for constant wheel speeds
        chord = speed * dt_s * (math.sin(turned / 2) / (turned / 2) if abs(turned) > 1e-9 else 1.0)
        along = state.heading_rad + turned / 2
        heading = wrap_pi(state.heading_rad + turned)
        forward, turning = (left + right) / 2, (left - right) / TRACK_M
        return WheelState(
            state.north_m + chord * math.cos(along),
            state.east_m + chord * math.sin(along),
            0.0,
            heading,
            forward,
            turning,
            velocity_ned_mps=(forward * math.cos(heading), forward * math.sin(heading), 0.0),
            left_mps=left,
            right_mps=right,
        )


def _approach(value: float, target: float, dt_s: float) -> float:
    change = (target - value) * -math.expm1(-dt_s / WHEEL_LAG_S)
    most = MAX_WHEEL_MPS2 * dt_s
    return value + min(max(change, -most), most)
