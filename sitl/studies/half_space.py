"""The usual safety filter, for comparison: a half-space in the velocity for every ship, and a QP.

    minimise |v - w|^2   subject to   n_i . v >= -rate (d_i - margin)   for every ship i,   |v| <= limit

d_i is the distance to the ship's tube over a short lookahead, n_i the direction away from it (a control
barrier).  The speed limit is a polygon of `SIDES` sides around the circle; what is still too fast is
shortened.  It keeps a distance; it knows no way out.
"""

import numpy as np
import quadprog

from companion import reach
from companion.config import Config
from companion.instant import Instant
from companion.messages import AutopilotHeartbeat, FloatArray, OwnState, Tracks
from companion.planning.guard import Intended, Velocity, Verdict

RATE_PER_S, LOOKAHEAD_S = 0.2, 20.0
SIDES = 32
HEADINGS = 72  # of the least bad velocity where the QP has no solution


class HalfSpaceFilter:
    """Asked like the guard; a velocity that is none counts as zero."""

    def __init__(self, config: Config) -> None:
        self._margin_m = config.field.delta_m + config.guard.own_position_error_m
        self._limit = config.vehicle.max_speed_mps
        angle = np.arange(SIDES) * (2 * np.pi / SIDES)
        self._inward = -np.column_stack((np.cos(angle), np.sin(angle)))
        self._speed = np.full(SIDES, -self._limit)

    def __call__(
        self,
        now: Instant,
        own: OwnState,
        heartbeat: AutopilotHeartbeat,  # noqa: ARG002 - asked like the guard
        tracks: Tracks,
        wanted: Velocity | None,
        intended: Intended | None = None,  # noqa: ARG002
    ) -> Verdict:
        """The nearest velocity that every rule allows, or the least bad."""
        w = np.zeros(2) if wanted is None or not np.isfinite(wanted).all() else np.array(wanted[:2])
        nearest = reach.tube(tracks, now, tracks.age_s(now) + LOOKAHEAD_S).nearest(own.position_m)
        bound = np.minimum(-RATE_PER_S * (nearest.distance_m - self._margin_m), self._limit)
        rules = np.vstack((nearest.away, self._inward))
        bounds = np.concatenate((bound, self._speed))
        try:
            kept = quadprog.solve_qp(np.eye(2), w, rules.T.copy(), bounds)[0]
        except ValueError:  # no velocity satisfies every rule
            kept = self._least_bad(nearest.away, bound)
        kept = kept * min(self._limit / max(float(np.hypot(*kept)), 1e-9), 1.0)
        return Verdict((float(kept[0]), float(kept[1]), 0.0), bool(np.abs(kept - w).max() > 1e-6), ())

    def _least_bad(self, away: FloatArray, bound: FloatArray) -> FloatArray:
        """(2,) the velocity whose worst violation is smallest, among headings at full speed and rest."""
        heading = np.arange(HEADINGS) * (2 * np.pi / HEADINGS)
        v = np.vstack((np.zeros(2), self._limit * np.column_stack((np.cos(heading), np.sin(heading)))))
        best: FloatArray = v[int(np.argmax((v @ away.T - bound).min(axis=1)))]
        return best
