"""The third dimension: which ships count, now that the vehicle may pass beneath them.

A ship's set reaches from the surface down to its draught plus a margin.  Every way out dives to the
cruise depth as fast as the vehicle can; a ship counts for as long as the vehicle is not surely below it.
"""

from dataclasses import dataclass

import numpy as np

from companion.config import Config
from companion.messages import BoolArray, FloatArray, OwnState, Tracks

VERTICAL_LAG_S = 2.0  # until a vertical command is made good


@dataclass(frozen=True, slots=True)
class Dive:
    """The least depth of the vehicle while it flies a way out, and the least at which each ship is passed.

    It rises at `up_mps` for the first `begin_s` and the lag, then goes down to `target_m`.
    """

    clear_m: FloatArray  # (n,)
    start_m: float
    up_mps: float
    begin_s: float
    down_mps: float
    target_m: float

    @classmethod
    def of(cls, config: Config, tracks: Tracks, own: OwnState, downs_mps: tuple[float, ...]) -> "Dive":
        """From the state now; `downs_mps` are the vertical velocities that may still act."""
        guard, vehicle = config.guard, config.vehicle
        up = max(0.0, *(-down for down in (*downs_mps, own.velocity_ned_mps[2])))
        return cls(
            draught_m(tracks, guard.draught_per_length) + guard.draught_margin_m + guard.depth_error_m,
            own.depth_m,
            up,
            guard.setpoint_delay_s + 1.0 / config.timing.rate_hz,
            vehicle.max_vertical_speed_mps,
            min(vehicle.cruise_depth_m, vehicle.max_depth_m),
        )

    def depth_m(self, t_s: FloatArray) -> FloatArray:
        """The least depth from `t_s` (T,) on."""
        shallowest = self.start_m - self.up_mps * (self.begin_s + VERTICAL_LAG_S)
        diving_s = np.maximum(t_s - self.begin_s - VERTICAL_LAG_S, 0.0)
        deepest = max(self.target_m, shallowest)
        return np.minimum(shallowest + self.down_mps * diving_s, deepest)

    def counts(self, t_s: FloatArray) -> BoolArray:
        """(T, n) whether the vehicle may touch a ship at or after `t_s` (T,)."""
        return np.asarray(self.depth_m(t_s)[:, None] < self.clear_m)

    def command_mps(self, depth_m: float) -> float:
        """Down velocity toward the target."""
        return min(max(0.5 * (self.target_m - depth_m), -self.down_mps), self.down_mps)


def draught_m(tracks: Tracks, per_length: float) -> FloatArray:
    """(n,) what static data says, else a share of the length."""
    return np.where(
        np.isnan(tracks.draught_m), per_length * (tracks.bow_m + tracks.stern_m), tracks.draught_m
    )
