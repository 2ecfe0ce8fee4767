"""A stored way out: a path in time from where the vehicle was to a place to stay, and how to fly it."""

import math
from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, OwnState

FOLLOW_PER_S = 0.25  # velocity toward the planned position per metre away from it
ROUNDING_S = 1e-6
TURNING_MPS = 0.1  # commanded to turn on the spot
STOP_S = np.array((0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0))  # after the command to stop


@dataclass(frozen=True, slots=True)
class Orders:
    """Velocities commanded in turn: each row of `velocity_mps` (K, 2), north and east, from `t_s` (K,) on."""

    t_s: FloatArray
    velocity_mps: FloatArray

    def at(self, t_s: FloatArray) -> FloatArray:
        """(m, 2) those that act at `t_s` (m,), the first one before them all."""
        return np.asarray(self.velocity_mps[np.searchsorted(self.t_s, t_s, side="right").clip(min=1) - 1])


@dataclass(frozen=True, slots=True)
class WayOut:
    """`t_s` (T,), `north_m`, `east_m` (T,): where the vehicle shall be, seconds after `begin`.

    The run's velocity is commanded from `run_s` to `stop_s`; then it stays at the path's last point.  Before,
    it waits, and for the last `turn_s` of that turns on the spot until it lies along the run.  A course of
    many velocities has its `orders` in their place, up to `stop_s`.
    `verified`: every set is clear of it; else it is the least bad found.
    """

    begin: Instant
    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    velocity_mps: tuple[float, float]
    stop_s: float
    verified: bool
    run_s: float = 0.0
    turn_s: float = 0.0
    orders: Orders | None = None

    @property
    def end_m(self) -> tuple[float, float]:
        """Where it stays."""
        return float(self.north_m[-1]), float(self.east_m[-1])

    @property
    def speed_mps(self) -> float:
        """Of the run."""
        return math.hypot(*self.velocity_mps)

    def wait_s(self, now: Instant) -> float:
        """How long it still waits."""
        return max(self.run_s - elapsed_s(self.begin, now), 0.0)

    def position_m(self, now: Instant) -> tuple[float, float]:
        """Where the vehicle shall be now."""
        t = elapsed_s(self.begin, now)
        return float(np.interp(t, self.t_s, self.north_m)), float(np.interp(t, self.t_s, self.east_m))

    def deviation_m(self, own: OwnState) -> float:
        """How far the vehicle is from where it shall be."""
        north, east = self.position_m(own.stamp)
        return math.hypot(own.north_m - north, own.east_m - east)

    def rest(self, now: Instant) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times from now, north and east of what is still to come."""
        gone_s = min(elapsed_s(self.begin, now), float(self.t_s[-1]))
        north, east = self.position_m(now)
        later = self.t_s > gone_s
        return (
            np.concatenate((np.zeros(1), self.t_s[later] - gone_s)),
            np.concatenate((np.array((north,)), self.north_m[later])),
            np.concatenate((np.array((east,)), self.east_m[later])),
        )

    def command(self, now: Instant, own: OwnState, delay_s: float, limit_mps: float) -> tuple[float, float]:
        """(north, east) velocity that follows it: the run's own, plus what leads back to the path."""
        north, east = self.position_m(own.stamp)
        acts_s = elapsed_s(self.begin, now) + delay_s
        if self.run_s - self.turn_s <= acts_s < self.run_s - ROUNDING_S and self.speed_mps > 0:
            # holding a place turns the hull any way: nothing leads back to the path for now
            share = TURNING_MPS / self.speed_mps
            return share * self.velocity_mps[0], share * self.velocity_mps[1]
        running = self.run_s - ROUNDING_S <= acts_s < self.stop_s
        along = self.velocity_mps if running else (0.0, 0.0)
        if running and self.orders is not None:
            along = tuple(self.orders.at(np.array((acts_s,)))[0].tolist())
        v_north = along[0] + FOLLOW_PER_S * (north - own.north_m)
        v_east = along[1] + FOLLOW_PER_S * (east - own.east_m)
        speed = math.hypot(v_north, v_east)
        cut = limit_mps / speed if speed > limit_mps else 1.0
        return v_north * cut, v_east * cut


def stopped(
    before_s: FloatArray,
    north_m: FloatArray,
    east_m: FloatArray,
    heading_rad: float,
    speed_mps: float,
    lag_s: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A path (T,) and the coasting to rest after it, at `speed_mps` along `heading_rad`."""
    run = speed_mps * lag_s * -np.expm1(-STOP_S / lag_s)
    run[-1] = speed_mps * lag_s
    return (
        np.concatenate((before_s, before_s[-1] + STOP_S)),
        np.concatenate((north_m, north_m[-1] + run * math.cos(heading_rad))),
        np.concatenate((east_m, east_m[-1] + run * math.sin(heading_rad))),
    )
