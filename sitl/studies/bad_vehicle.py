"""A vehicle that is as bad as declared: current, delay and position error at their bounds."""

import math
from collections import deque
from typing import Literal

import numpy as np

from companion.config import Config
from companion.instant import Instant
from companion.messages import FloatArray, OwnState
from companion.planning.guard import Velocity
from sitl.boat import Boat
from sitl.submarine import Submarine
from sitl.vehicle import (
    Demand,
    Dynamics,
    KinematicBoat,
    KinematicSubmarine,
    Limits,
    VehicleState,
)

SIM_S = 0.1
Bodies = Literal["points", "physics"]


class BadVehicle:
    """The bundled vehicle at the edge of what the configuration declares.

    A constant current of the declared size, a constant delay up to the declared one, and a position
    that is off by all that is declared, in one direction for ever.
    """

    def __init__(
        self, config: Config, rng: np.random.Generator, start_m: FloatArray, bodies: Bodies = "points"
    ) -> None:
        guard, vehicle = config.guard, config.vehicle
        drift = polar(guard.current_mps, rng)
        limits = Limits(
            vehicle.max_speed_mps,
            vehicle.max_vertical_speed_mps,
            vehicle.max_turn_rate_radps,
            vehicle.speed_lag_s,
        )
        current = (float(drift[0]), float(drift[1]))
        floats = vehicle.cruise_depth_m == 0
        self._dynamics: Dynamics
        if bodies == "physics":
            self._dynamics = Boat(current_ned_mps=current) if floats else Submarine(current_ned_mps=current)
        else:
            self._dynamics = (KinematicBoat if floats else KinematicSubmarine)(limits, current)
        self._state: VehicleState = self._dynamics.start(
            float(start_m[0]),
            float(start_m[1]),
            vehicle.cruise_depth_m,
            float(rng.uniform(-math.pi, math.pi)),
        )
        self._delay_s = float(rng.uniform(0.0, guard.setpoint_delay_s)) if guard.setpoint_delay_s else 0.0
        self._off = polar(1.0, rng)
        self._error_m = guard.own_position_error_m
        self._error_mps = guard.own_position_drift_mps if vehicle.cruise_depth_m > 0 else 0.0
        self._queue: deque[tuple[float, Velocity]] = deque()
        self._flown: Velocity = (0.0, 0.0, 0.0)

    @property
    def true_m(self) -> FloatArray:
        """(2,) where it is."""
        return np.array((self._state.north_m, self._state.east_m))

    def measured(self, now: Instant) -> OwnState:
        """Where it believes to be."""
        state = self._state
        off = self._off * (self._error_m + self._error_mps * now * 1e-9)
        return OwnState(
            now,
            state.north_m + float(off[0]),
            state.east_m + float(off[1]),
            state.depth_m,
            state.velocity_ned_mps,
            state.heading_rad,
        )

    def send(self, t: float, velocity: Velocity) -> None:
        """A setpoint that takes effect after the delay."""
        self._queue.append((t + self._delay_s, velocity))

    def move(self, t: float) -> None:
        """One simulated step from `t` on."""
        while self._queue and self._queue[0][0] <= t + 1e-9:
            self._flown = self._queue.popleft()[1]
        self._state = self._dynamics.step(self._state, Demand(self._flown), SIM_S)


def polar(length: float, rng: np.random.Generator) -> FloatArray:
    """(2,) a vector of that length in any direction."""
    angle = rng.uniform(-math.pi, math.pi)
    return np.array((length * math.cos(angle), length * math.sin(angle)))
