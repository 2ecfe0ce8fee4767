"""How the bundled vehicles move: `step` turns a command into motion, and nothing else.

A vehicle is one object with `start` and `step`; both are pure, all that changes is in the
frozen `VehicleState`.  Another model of the same vehicle (say, six degrees of freedom) is another
class with these two methods, and may keep its own extra states in a subclass of `VehicleState`.

Axes: local NED, metres, seconds, radians.  "Through water" is without, "over ground" with the
ocean current.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol

from companion.geodesy import wrap_pi

STANDS_STILL_MPS = 0.05  # a wanted velocity below this gives no direction to turn to
_GRAVITY_MPS2 = 9.80665


@dataclass(frozen=True, slots=True)
class Demand:
    """What the autopilot wants of the hull: a velocity over ground, NED.

    `hold_heading`: come to rest as the hull lies.  Without it a zero velocity is a velocity,
    and a boat turns it into "heading north, speed 0".
    """

    velocity_ned_mps: tuple[float, float, float]
    hold_heading: bool = False


@dataclass(frozen=True, slots=True)
class VehicleState:
    """Pose and motion; `speed_mps` is forward through water, `velocity_ned_mps` is over ground."""

    north_m: float
    east_m: float
    depth_m: float
    heading_rad: float
    speed_mps: float = 0.0
    turn_rate_radps: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    velocity_ned_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Limits:
    """What the hull and its propulsion can do."""

    max_speed_mps: float = 2.5
    max_vertical_speed_mps: float = 0.5
    max_turn_rate_radps: float = 0.2
    speed_lag_s: float = 2.0
    vertical_lag_s: float = 1.0
    turn_lag_s: float = 0.5


class Dynamics(Protocol):
    """A model of a vehicle."""

    def start(self, north_m: float, east_m: float, depth_m: float, heading_rad: float) -> VehicleState:
        """The vehicle at rest through water."""
        ...

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off."""
        ...


@dataclass(frozen=True, slots=True)
class _Hull:
    limits: Limits = Limits()
    current_ned_mps: tuple[float, float] = (0.0, 0.0)

    def start(self, north_m: float, east_m: float, depth_m: float, heading_rad: float) -> VehicleState:
        """The vehicle at rest through water: it drifts with the current."""
        over_ground = (*self.current_ned_mps, 0.0)
        heading = wrap_pi(heading_rad)
        return VehicleState(north_m, east_m, max(depth_m, 0.0), heading, velocity_ned_mps=over_ground)

    def _turn(self, state: VehicleState, to_rad: float, dt_s: float) -> tuple[float, float]:
        """New heading and mean turn rate: proportional, limited, and never past the target."""
        error = wrap_pi(to_rad - state.heading_rad)
        limit = self.limits.max_turn_rate_radps
        wanted = min(max(error / self.limits.turn_lag_s, -limit), limit)
        turned = min(abs(wanted) * dt_s, abs(error))
        rate = math.copysign(turned / dt_s, wanted)
        return wrap_pi(state.heading_rad + rate * dt_s), rate

    def _move(
        self, state: VehicleState, turned: tuple[float, float], pushed: tuple[float, float], dt_s: float
    ) -> VehicleState:
        """The state after turning to (heading, at rate) and lagging towards (forward, down) speeds."""
        (heading, rate), (forward, down) = turned, pushed
        speed, run = _lagged(state.speed_mps, forward, self.limits.speed_lag_s, dt_s)
        sink, drop = _lagged(state.velocity_ned_mps[2], down, self.limits.vertical_lag_s, dt_s)
        depth = state.depth_m + drop
        if depth <= 0.0:
            depth, sink = 0.0, max(sink, 0.0)
        along = state.heading_rad + 0.5 * rate * dt_s  # mid-step heading: second order in dt
        drift_north, drift_east = self.current_ned_mps
        return replace(
            state,
            north_m=state.north_m + run * math.cos(along) + drift_north * dt_s,
            east_m=state.east_m + run * math.sin(along) + drift_east * dt_s,
            depth_m=depth,
            heading_rad=heading,
            speed_mps=speed,
            turn_rate_radps=rate,
            velocity_ned_mps=(
                speed * math.cos(heading) + drift_north,
                speed * math.sin(heading) + drift_east,
                sink,
            ),
        )


@dataclass(frozen=True, slots=True)
class KinematicSubmarine(_Hull):
    """A torpedo-shaped vehicle: thrust along the hull, so that it turns into the wanted velocity.

    Its autopilot knows the current (an EKF with DVL) and steers against it; on a heading that is
    not yet the wanted one it makes only the wanted velocity's share along the hull.
    """

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off, neutrally buoyant."""
        if demand is None:
            return self._move(state, (state.heading_rad, 0.0), (0.0, 0.0), dt_s)
        limits = self.limits
        north, east, down = demand.velocity_ned_mps
        north, east = north - self.current_ned_mps[0], east - self.current_ned_mps[1]
        wanted = math.hypot(north, east)
        target = state.heading_rad if wanted < STANDS_STILL_MPS else math.atan2(east, north)
        heading, rate = self._turn(state, target, dt_s)
        forward = min(wanted, limits.max_speed_mps) * max(math.cos(target - heading), 0.0)
        if wanted < STANDS_STILL_MPS:
            forward = wanted
        down = min(max(down, -limits.max_vertical_speed_mps), limits.max_vertical_speed_mps)
        moved = self._move(state, (heading, rate), (forward, down), dt_s)
        pitch = -math.atan2(moved.velocity_ned_mps[2], max(moved.speed_mps, 1.0))
        roll = math.atan2(moved.speed_mps * rate, _GRAVITY_MPS2)
        return replace(moved, pitch_rad=pitch, roll_rad=roll)


@dataclass(frozen=True, slots=True)
class KinematicBoat(_Hull):
    """A surface vehicle: a velocity becomes heading and forward speed over ground, without crabbing.

    A zero velocity is "heading north, speed 0", as measured on ArduPilot's Rover; the current
    carries it aside.
    """

    def step(self, state: VehicleState, demand: Demand | None, dt_s: float) -> VehicleState:
        """The state `dt_s` later, the demand held all the while; None: motors off."""
        if demand is None:
            return self._move(state, (state.heading_rad, 0.0), (0.0, 0.0), dt_s)
        north, east, _ = demand.velocity_ned_mps
        wanted = min(math.hypot(north, east), self.limits.max_speed_mps)
        target = state.heading_rad if demand.hold_heading else math.atan2(east, north)
        heading, rate = self._turn(state, target, dt_s)
        # the speed controller closes its loop on the forward speed over ground
        drift_north, drift_east = self.current_ned_mps
        helping = drift_north * math.cos(heading) + drift_east * math.sin(heading)
        forward = wanted * max(math.cos(target - heading), 0.0) - helping
        limit = self.limits.max_speed_mps
        moved = self._move(state, (heading, rate), (min(max(forward, -limit), limit), 0.0), dt_s)
        return replace(moved, depth_m=0.0)


def _lagged(value: float, target: float, lag_s: float, dt_s: float) -> tuple[float, float]:
    """A first-order lag: the value after `dt_s`, and its integral over `dt_s`."""
    share = -math.expm1(-dt_s / lag_s)
    return value + (target - value) * share, target * dt_s + (value - target) * lag_s * share
