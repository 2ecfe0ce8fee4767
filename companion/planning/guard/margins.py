"""How far from every set a planned position must stay, so that the true one stays delta away."""

from dataclasses import dataclass

import numpy as np

from companion.config import Config
from companion.messages import FloatArray

RAMP_S = 3.0  # a plan begins where the vehicle is: tracking errors take this long to build up
BETWEEN_M = 0.15  # how far a turning or braking vehicle may be from the straight run between two points


@dataclass(frozen=True, slots=True)
class Margins:
    """delta + localisation error + tracking error, metres, t seconds from now.

    The localisation error grows at `drift_mps` for as long as the vehicle is under water, which it has
    been for `submerged_s`.
    """

    delta_m: float
    position_m: float
    drift_mps: float
    tracking_m: float
    submerged_s: float

    @classmethod
    def of(cls, config: Config, submerged_s: float, unexplained_m: float = 0.0) -> "Margins":
        """The declared ones, and what the position has jumped without an explanation."""
        guard = config.guard
        drift = guard.own_position_drift_mps if config.vehicle.cruise_depth_m > 0 else 0.0
        return cls(
            config.field.delta_m,
            guard.own_position_error_m + unexplained_m,
            drift,
            guard.tracking_error_m,
            submerged_s,
        )

    def at(self, t_s: FloatArray | float) -> FloatArray:
        """Under way, t seconds after a plan's begin; same shape."""
        build_up = np.minimum(np.asarray(t_s) / RAMP_S, 1.0)
        return np.asarray(self.localised(t_s) + BETWEEN_M + self.tracking_m * build_up)

    def localised(self, t_s: FloatArray | float) -> FloatArray:
        """Without tracking error."""
        return np.asarray(
            self.delta_m + self.position_m + self.drift_mps * (self.submerged_s + np.asarray(t_s))
        )
