"""Before a vehicle leaves clear water: sail the whole crossing in thought, on the sets as they will be.

Nothing is heard on the way, so every set is known in advance, and so is every decision of the planner.  A
crossing that comes too near to a set in thought would in the water; then the information is too old, or the
traffic too dense, and the honest answer is to hold, or to surface and listen again.

No vehicle does exactly what is wanted, and where the way forks a little decides.  So several cross in
thought, `CAST`: a point, others that lag, slower ones.  All of them must be safe, by a margin.
"""

import math
from dataclasses import dataclass, fields, replace

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
# ... enough to see where the way forks: with the first four 2 of 100 went wrong on reports 420 s old
CAST = (
    (0.01, 1e3, 1.0),
    (2.0, 0.2, 1.0),
    (2.0, 0.2, 0.95),
    (4.0, 0.15, 1.0),
    (1.0, 0.3, 0.98),
    (3.0, 0.18, 1.0),
    (2.0, 0.2, 0.9),
    (4.0, 0.15, 0.93),
)
TURN_LAG_S = 0.5
STEP_S = 0.5
EAGER = -math.expm1(-STEP_S / TURN_LAG_S)
CROWDED = 0.8  # played on in smaller arrays when fewer than this share of the vehicles is undecided
SLOWEST = 4.0  # a crossing longer than this many times the straight way is none


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """Of m vehicles: whether the crossing is safe (m,), and its least distance to a set (m,).

    A crossing is not played on once it comes nearer than is to be kept: that is its distance then.
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
        place = np.repeat(position_m, cast, axis=0)
        lag_s, turns, share = (np.tile(column, m) for column in np.array(CAST).T)
        limit = share * config.vehicle.max_speed_mps
        self._cast = _Cast(
            place=place,
            heading=np.arctan2(*(goal_m - place).T[::-1]),
            speed=np.zeros(m * cast),
            closest=np.full(m * cast, np.inf),
            arrived=np.zeros(m * cast, dtype=np.bool_),
            limit=limit,
            turns=turns,
            follows=-np.expm1(-STEP_S / lag_s),
        )
        longest_s = SLOWEST * float(np.hypot(*(goal_m - place).T).max()) / float(limit.min())
        self._news = within_s < longest_s
        self._steps = int(min(longest_s, within_s) / STEP_S) + 1 if len(tracks) else 0
        self._step = 0
        self._who = np.arange(m)  # the vehicles still played
        self._safe, self._closest = np.zeros(m, dtype=np.bool_), np.full(m, np.inf)

    def advance(self, steps: int = 1) -> bool:
        """Play on for some steps; whether it is over."""
        for _ in range(steps):
            undecided = self._note()
            if self._step >= self._steps or not undecided.any():
                return True
            if undecided.mean() < CROWDED:
                self._keep(undecided)
            self._move()
            self._step += 1
        return False

    def rehearsed(self) -> Rehearsed:
        """What came of it, once it is over."""
        return Rehearsed(self._safe, self._closest)

    def _note(self) -> BoolArray:
        """Write down what is known of the vehicles played; whose crossing is undecided yet."""
        shape = (-1, len(CAST))
        arrived = self._cast.arrived.reshape(shape).all(axis=1)
        closest = self._cast.closest.reshape(shape).min(axis=1)
        failed = closest < self._keep_m  # one is enough
        over = self._step >= self._steps and (self._news or self._steps == 0)
        self._closest[self._who] = closest
        self._safe[self._who] = ~failed & (arrived | over)
        undecided: BoolArray = ~(failed | arrived)
        return undecided

    def _keep(self, vehicles: BoolArray) -> None:
        """Play on with some of the vehicles."""
        casts = np.repeat(vehicles, len(CAST))
        self._tracks = only(self._tracks, np.flatnonzero(np.repeat(casts, self._k)))
        self._who, self._cast = self._who[vehicles], self._cast.only(casts)

    def _move(self) -> None:
        c, goal_m = self._cast, self._goal_m
        t = after(self._begin, self._step * STEP_S)
        around = np.repeat(c.place, self._k, axis=0)
        push = self._steering.push(self._tracks, t, around, goal_m)
        near = push.nearest.distance_m  # of tubes: the sets themselves are no nearer
        if (near < self._keep_m).any():
            near = reach.at(self._tracks, t, kernel=self._kernel).nearest(around).distance_m
        near = near.reshape(len(c.place), self._k).min(axis=1)
        closest = np.where(c.arrived, c.closest, np.minimum(c.closest, near))
        arrived = c.arrived | (np.hypot(*(goal_m - c.place).T) <= self._config.goal.radius_m)
        u = self._steering.horizontal(self._tracks, self._steering.pull(c.place, goal_m, Phase.CROSS), push)
        wanted, target = np.hypot(u[:, 0], u[:, 1]), np.arctan2(u[:, 1], u[:, 0])
        error = np.remainder(target - c.heading + np.pi, 2 * np.pi) - np.pi
        free = c.turns > 1.0
        most = np.where(free, np.pi, c.turns * STEP_S)
        heading = c.heading + np.clip(np.where(free, error, EAGER * error), -most, most)
        ahead = np.minimum(wanted, c.limit) * np.maximum(np.cos(target - heading), 0.0)
        speed = c.speed + c.follows * (ahead - c.speed)
        run = (STEP_S * speed)[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
        self._cast = replace(
            c, place=c.place + run, heading=heading, speed=speed, closest=closest, arrived=arrived
        )


@dataclass(frozen=True, slots=True)
class _Cast:
    """Who sails in thought: all casts of the first vehicle, of the second, and so on; columns (n,)."""

    place: FloatArray  # (n, 2)
    heading: FloatArray
    speed: FloatArray
    closest: FloatArray
    arrived: BoolArray
    limit: FloatArray
    turns: FloatArray
    follows: FloatArray

    def only(self, which: BoolArray) -> "_Cast":
        """Some of the rows."""
        return _Cast(*(getattr(self, f.name)[which] for f in fields(self)))
