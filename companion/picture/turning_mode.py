"""The second mode of the gate: a ship that goes on turning as it did between its last two reports.

    x' = F(w, dt) x,   F the coordinated turn at rate w

Asked only about what the straight filter refuses, a few reports in a thousand.
"""

import math

import numpy as np
from filterpy.kalman import KalmanFilter

from companion.messages import FloatArray

_LEAST_RADPS = math.radians(0.02)  # slower is straight
_FASTEST_RADPS = math.radians(20.0)
_IDENTITY = np.eye(4)


class TurningMode:
    """A filterpy Kalman filter with the turn in its transition; keeps no state of its own."""

    def __init__(self) -> None:
        self._filters = {n: KalmanFilter(dim_x=4, dim_z=n) for n in (2, 4)}

    def judge(
        self,
        state: tuple[float, ...],
        covariance: tuple[float, float, float],
        turn_radps: float,
        measured: tuple[float, ...],
        dt: float,
        drift: tuple[float, float],
        variance: tuple[float, float],
    ) -> tuple[float, float]:
        """Normalised innovation squared and surprise of `measured`, (north, east) or with velocities.

        `state` is north, east, v_north, v_east; `covariance` that of either axis: position, both, velocity;
        `drift` and `variance` are those of position and velocity.
        """
        if not _LEAST_RADPS <= abs(turn_radps) <= _FASTEST_RADPS or dt <= 0:
            return math.inf, math.inf
        size = len(measured)
        position, both, velocity = covariance
        kalman = self._filters[size]
        kalman.x = np.array(state)
        kalman.P = np.kron(((position, both), (both, velocity)), np.eye(2))
        kalman.predict(F=turn(turn_radps, dt), Q=np.diag(np.repeat(drift, 2)))
        kalman.update(np.array(measured), R=np.diag(np.repeat(variance, 2)[:size]), H=_IDENTITY[:size])
        innovation = float(kalman.y @ kalman.SI @ kalman.y)
        return innovation, innovation + float(np.linalg.slogdet(kalman.S)[1])


def turn(rate_radps: float, dt: float) -> FloatArray:
    """(4, 4) transition of (north, east, v_north, v_east) at a constant turn rate, clockwise."""
    angle = rate_radps * dt
    along, aside = math.sin(angle) / rate_radps, (1 - math.cos(angle)) / rate_radps
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array(
        (
            (1.0, 0.0, along, -aside),
            (0.0, 1.0, aside, along),
            (0.0, 0.0, cos, -sin),
            (0.0, 0.0, sin, cos),
        )
    )
