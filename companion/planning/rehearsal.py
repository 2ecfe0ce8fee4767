"""Before a vehicle leaves clear water: sail the whole crossing in thought, on the sets as they will be.

Nothing is heard on the way, so every set is known in advance, and so is every decision of the planner.  A
crossing that comes too near to a set in thought would in the water; then the information is too old, or the
traffic too dense, and the honest answer is to hold, or to surface and listen again.

No vehicle does exactly what is wanted, and where the way forks a little decides.  So several cross in
thought, `CAST`: a point, others that lag, a slower one.  All of them must be safe, by a margin.
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
    """Of m vehicles: whether the crossing is safe (m,), and its least distance to a set (m,).

    The distance is exact where it is below what was to be kept, elsewhere it is at least that.
    """

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
        play = self.begin(tracks, now, position_m, goal_m)
        while not play.advance():
            pass
        return play.rehearsed()

    def begin(
        self,
        tracks: Tracks,
        now: Instant,
        position_m: FloatArray,
        goal_m: FloatArray,
        *,
        margin_m: float = MARGIN_M,
        within_s: float = np.inf,
    ) -> "Play":
        """The same, to be played little by little: who has not arrived `within_s` will have news by then."""
        keep_m = self._config.field.delta_m + margin_m
        return Play(
            self._config, self._steering, self._kernel, tracks, now, position_m, goal_m, keep_m, within_s
        )


class Play:
    """A rehearsal under way."""

    def __init__(
        self,
        config: Config,
        steering: Steering,
        kernel: Kernel,
        tracks: Tracks,
        now: Instant,
        position_m: FloatArray,
        goal_m: FloatArray,
        keep_m: float,
        within_s: float,
    ) -> None:
        self._config, self._steering, self._kernel = config, steering, kernel
        self._begin, self._goal_m, self._keep_m = now, goal_m, keep_m
        m, cast = len(position_m), len(CAST)
        self._k = len(tracks) // m
        self._tracks = only(tracks, np.tile(np.arange(m * self._k).reshape(m, self._k), (1, cast)).ravel())
        self._place = place = np.repeat(position_m, cast, axis=0)
        lag_s, self._turns, share = (np.tile(column, m) for column in np.array(CAST).T)
        self._limit = share * config.vehicle.max_speed_mps
        self._follows, self._eager = -np.expm1(-STEP_S / lag_s), -np.expm1(-STEP_S / TURN_LAG_S)
        n = m * cast
        self._closest, self._arrived, self._speed = (
            np.full(n, np.inf),
            np.zeros(n, dtype=np.bool_),
            np.zeros(n),
        )
        self._heading = np.arctan2(*(goal_m - place).T[::-1])
        longest_s = SLOWEST * float(np.hypot(*(goal_m - place).T).max()) / float(self._limit.min())
        self._news = within_s < longest_s
        self._steps = int(min(longest_s, within_s) / STEP_S) + 1 if len(tracks) else 0
        self._step = 0

    def advance(self, steps: int = 1) -> bool:
        """Play on for some steps; whether it is over."""
        for _ in range(steps):
            if self._step >= self._steps or (self._arrived | (self._closest < self._keep_m)).all():
                return True
            self._move()
            self._step += 1
        return False

    def rehearsed(self) -> Rehearsed:
        """What came of it, once it is over."""
        over = self._arrived | self._news | (self._steps == 0)
        safe: BoolArray = np.all((over & (self._closest >= self._keep_m)).reshape(-1, len(CAST)), axis=1)
        return Rehearsed(safe, self._closest.reshape(-1, len(CAST)).min(axis=1))

    def _move(self) -> None:
        t, goal_m, place = after(self._begin, self._step * STEP_S), self._goal_m, self._place
        around = np.repeat(place, self._k, axis=0)
        push = self._steering.push(self._tracks, t, around, goal_m)
        near = push.nearest.distance_m  # of tubes: the sets themselves are no nearer
        if (near < self._keep_m).any():
            near = reach.at(self._tracks, t, kernel=self._kernel).nearest(around).distance_m
        near = near.reshape(len(place), self._k).min(axis=1)
        self._closest = np.where(self._arrived, self._closest, np.minimum(self._closest, near))
        self._arrived |= np.hypot(*(goal_m - place).T) <= self._config.goal.radius_m
        u = self._steering.horizontal(self._tracks, self._steering.pull(place, goal_m, Phase.CROSS), push)
        wanted, target = np.hypot(u[:, 0], u[:, 1]), np.arctan2(u[:, 1], u[:, 0])
        error = np.remainder(target - self._heading + np.pi, 2 * np.pi) - np.pi
        free = self._turns > 1.0
        most = np.where(free, np.pi, self._turns * STEP_S)
        self._heading = self._heading + np.clip(np.where(free, error, self._eager * error), -most, most)
        ahead = np.minimum(wanted, self._limit) * np.maximum(np.cos(target - self._heading), 0.0)
        self._speed = self._speed + self._follows * (ahead - self._speed)
        course = np.column_stack((np.cos(self._heading), np.sin(self._heading)))
        self._place = place + (STEP_S * self._speed)[:, None] * course
