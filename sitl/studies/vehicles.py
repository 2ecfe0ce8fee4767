"""Many vehicles at once, each a point with a velocity: what the tables are made with.

`Lag` is `sitl.vehicle.KinematicSubmarine` in rows; a test holds the two together.
"""

from dataclasses import dataclass, replace

import numpy as np

from companion.messages import FloatArray
from sitl.vehicle import STANDS_STILL_MPS


@dataclass(frozen=True, slots=True)
class Vehicles:
    """m vehicles: `position_m` (m, 2), `heading_rad` (m,) and `speed_mps` (m,) through the water."""

    position_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray

    @classmethod
    def at_rest(cls, count: int, place_m: tuple[float, float], heading_rad: float) -> "Vehicles":
        """All at one place."""
        return cls(np.tile(place_m, (count, 1)), np.full(count, heading_rad), np.zeros(count))


def shortened(velocity: FloatArray, limit_mps: float) -> FloatArray:
    """(m, 2) velocities, none above the limit."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return velocity * (limit_mps / np.maximum(speed, limit_mps))[:, None]


@dataclass(frozen=True, slots=True)
class Integrator:
    """The paper's x' = u."""

    max_speed_mps: float

    def step(self, vehicles: Vehicles, wanted: FloatArray, dt_s: float) -> Vehicles:
        """The vehicles `dt_s` later."""
        return replace(vehicles, position_m=vehicles.position_m + wanted * dt_s)


@dataclass(frozen=True, slots=True)
class Lag:
    """Turns into the wanted velocity at a limited rate; the speed follows with a lag."""

    max_speed_mps: float
    max_turn_rate_radps: float = 0.2
    speed_lag_s: float = 2.0
    turn_lag_s: float = 0.5

    def step(self, vehicles: Vehicles, wanted: FloatArray, dt_s: float) -> Vehicles:
        """The vehicles `dt_s` later."""
        heading, speed = vehicles.heading_rad, vehicles.speed_mps
        size = np.hypot(wanted[:, 0], wanted[:, 1])
        still = size < STANDS_STILL_MPS
        target = np.where(still, heading, np.arctan2(wanted[:, 1], wanted[:, 0]))
        error = _wrap(target - heading)
        limit = self.max_turn_rate_radps
        rate = np.clip(error / self.turn_lag_s, -limit, limit)
        rate = np.sign(error) * np.minimum(np.abs(rate), np.abs(error) / dt_s)
        turned = heading + rate * dt_s
        ahead = np.minimum(size, self.max_speed_mps) * np.maximum(np.cos(target - turned), 0.0)
        forward = np.where(still, size, ahead)
        share = -np.expm1(-dt_s / self.speed_lag_s)
        run = forward * dt_s + (speed - forward) * self.speed_lag_s * share
        along = heading + 0.5 * rate * dt_s
        step = run[:, None] * np.column_stack((np.cos(along), np.sin(along)))
        return Vehicles(vehicles.position_m + step, _wrap(turned), speed + (forward - speed) * share)


def _wrap(angle_rad: FloatArray) -> FloatArray:
    return angle_rad - 2 * np.pi * np.rint(angle_rad / (2 * np.pi))
