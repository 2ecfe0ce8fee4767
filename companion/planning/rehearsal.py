"""Before a vehicle leaves clear water: sail the whole crossing in thought, on the sets as they will be.

Nothing is heard on the way, so every set is known in advance, and so is every decision of the planner.  A
crossing that comes too near to a set in thought would in the water; then the information is too old, or the
traffic too dense, and the honest answer is to hold, or to surface and listen again.

No vehicle does exactly what is wanted, and where the way forks a little decides.  So several cross in
thought, `CAST`: a point, others that lag, a slower one.  All of them must be safe, by `MARGIN_M`.
"""

from dataclasses import dataclass

import numpy as np

from companion import reach
from companion.config import Config
from companion.instant import Instant, after
from companion.messages import BoolArray, FloatArray, Phase, Tracks
from companion.planning.steering import Steering
from companion.reach.kernel import Kernel, nearest
from companion.reach.shapes import only

MARGIN_M = 5.0  # a lag of 2 s and a turn rate of 0.2 rad/s cost 3.6 m at most
# lag of the speed in seconds, greatest turn rate in rad/s, share of full speed
CAST = ((0.01, 1e3, 1.0), (2.0, 0.2, 1.0), (2.0, 0.2, 0.95), (4.0, 0.15, 1.0))
TURN_LAG_S = 0.5
STEP_S = 0.5
SLOWEST = 4.0  # a crossing longer than this many times the straight way is none


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """Of m vehicles: whether the crossing is safe (m,), and its least distance to a set (m,)."""

    safe: BoolArray
    closest_m: FloatArray


class Rehearsal:
    """The planner's own steering, played forward; m vehicles at once as in `steering`."""

    def __init__(self, config: Config, steering: Steering, kernel: Kernel = nearest) -> None:
        self._config = config
        self._steering = steering
        self._kernel = kernel

    def __call__(self, tracks: Tracks, now: Instant, position_m: FloatArray, goal_m: FloatArray) -> Rehearsed:
        """The crossing from the positions (m, 2) to the goal (2,), leaving now."""
        m, cast = len(position_m), len(CAST)
        if not len(tracks):
            return Rehearsed(np.ones(m, dtype=np.bool_), np.full(m, np.inf))
        k = len(tracks) // m
        everyone = only(tracks, np.tile(np.arange(m * k).reshape(m, k), (1, cast)).ravel())
        closest, arrived = self._play(everyone, now, np.repeat(position_m, cast, axis=0), goal_m)
        keep_m = self._config.field.delta_m + MARGIN_M
        safe: BoolArray = np.all((arrived & (closest >= keep_m)).reshape(m, cast), axis=1)
        return Rehearsed(safe, closest.reshape(m, cast).min(axis=1))

    def _play(
        self, tracks: Tracks, now: Instant, place: FloatArray, goal_m: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Least distances and arrivals of all vehicles of all casts, cast by cast for each."""
        n = len(place)
        k = len(tracks) // n
        lag_s, turns, share = (np.tile(column, n // len(CAST)) for column in np.array(CAST).T)
        limit = share * self._config.vehicle.max_speed_mps
        follows, eager = -np.expm1(-STEP_S / lag_s), -np.expm1(-STEP_S / TURN_LAG_S)
        closest, arrived, speed = np.full(n, np.inf), np.zeros(n, dtype=np.bool_), np.zeros(n)
        heading = np.arctan2(*(goal_m - place).T[::-1])
        straight_m = float(np.hypot(*(goal_m - place).T).max())
        keep_m = self._config.field.delta_m + MARGIN_M
        for step in range(int(SLOWEST * straight_m / float(limit.min()) / STEP_S) + 1):
            t = after(now, step * STEP_S)
            around = np.repeat(place, k, axis=0)
            near = reach.at(tracks, t, kernel=self._kernel).nearest(around).distance_m
            closest = np.where(arrived, closest, np.minimum(closest, near.reshape(n, k).min(axis=1)))
            arrived |= np.hypot(*(goal_m - place).T) <= self._config.goal.radius_m
            if (arrived | (closest < keep_m)).all():
                break
            push = self._steering.push(tracks, t, around, goal_m)
            pull = self._steering.pull(place, goal_m, Phase.CROSS)
            u = self._steering.horizontal(tracks, pull, push)
            wanted, target = np.hypot(u[:, 0], u[:, 1]), np.arctan2(u[:, 1], u[:, 0])
            error = np.remainder(target - heading + np.pi, 2 * np.pi) - np.pi
            most = np.where(turns > 1.0, np.pi, turns * STEP_S)
            heading = heading + np.clip(np.where(turns > 1.0, error, eager * error), -most, most)
            ahead = np.minimum(wanted, limit) * np.maximum(np.cos(target - heading), 0.0)
            speed = speed + follows * (ahead - speed)
            place = place + (STEP_S * speed)[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
        return closest, arrived
