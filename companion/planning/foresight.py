"""What the planner will do: its own steering played forward from where the vehicle is, for the guard to see.

A planner that means well goes where there is a way, but the way may bend: between the sterns and bows of two
lanes no single run leads out.  Told what is intended, the guard verifies that as a way out like any other.

Played a few moments a step, by the exact sets, as slow as the guard assumes the vehicle to be.  Ships whose
sets are expensive (turning) are left out: what comes of it is an offer, and the guard looks at every ship.
"""

import math

import numpy as np

from companion.config import Config
from companion.instant import Instant, after, elapsed_s
from companion.messages import FloatArray, IntArray, OwnState, Phase, Tracks
from companion.planning.far import Boxes, far_m, playable
from companion.planning.field import ExactRepulsion
from companion.planning.guard import Intended
from companion.planning.guard.rollout import Motion, motion_of, moved
from companion.planning.steering import Steering
from companion.reach.kernel import Kernel, nearest
from companion.reach.shapes import only

STEP_S = 1.0
EVERY_S = 5.0  # from one beginning to the next at least
MOMENTS_A_S = 60  # ... so long as a step's part of them is no more than
ROWS_A_STEP, ROWS_BESIDES = 600, 80  # of sets, and what a moment costs beside them: 1 ms


class Foresight:
    """Keeps what is intended; advanced once a step."""

    def __init__(self, config: Config, kernel: Kernel = nearest) -> None:
        self._config = config
        self._steering = Steering(config, ExactRepulsion(config.field, kernel))
        self._speed_mps = max(config.vehicle.max_speed_mps - config.guard.current_mps, 0.1)
        self._boxes = Boxes()
        self._begun_at: Instant | None = None
        self._ships = Tracks.empty()
        self._motion: Motion | None = None  # while it is played
        self._rows: list[tuple[float, float, float, float, float]] = []
        self.intended: Intended | None = None  # as last known

    def forget(self) -> None:
        """Nothing is intended any more."""
        self._begun_at = self._motion = self.intended = None

    def look(self, now: Instant, own: OwnState, tracks: Tracks, goal_m: FloatArray) -> None:
        """Play on, or begin again when it is time."""
        if self._motion is None and (self._begun_at is None or elapsed_s(self._begun_at, now) >= EVERY_S):
            self._begun_at, self._rows = now, []
            self._ships = only(tracks, self._who_matters(now, own, tracks))
            toward = math.atan2(goal_m[1] - own.east_m, goal_m[0] - own.north_m)
            self._motion = motion_of(own, max(elapsed_s(own.stamp, now), 0.0), toward)
        wanted = math.ceil(MOMENTS_A_S / self._config.timing.rate_hz)
        for _ in range(max(min(ROWS_A_STEP // (len(self._ships) + ROWS_BESIDES), wanted), 1)):
            if self._motion is not None:
                self._play(self._motion, goal_m)

    def _play(self, motion: Motion, goal_m: FloatArray) -> None:
        """One moment."""
        assert self._begun_at is not None
        t = STEP_S * len(self._rows)
        place = np.array((motion.north_m, motion.east_m))
        there = float(np.hypot(*(goal_m - place))) <= self._config.goal.radius_m
        if there or t >= self._config.guard.way_out_s:
            self._rows.append((t, motion.north_m, motion.east_m, 0.0, 0.0))
            rows = np.array(self._rows)
            self.intended = Intended(self._begun_at, rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3:])
            self._motion = None
            return
        u = self._steering.pull(place, goal_m, Phase.CROSS)
        if len(self._ships):
            push = self._steering.push(self._ships, after(self._begun_at, t), place, goal_m)
            u = self._steering.horizontal(self._ships, u, push)
        u = u * min(self._speed_mps / max(float(np.hypot(u[0], u[1])), 1e-9), 1.0)
        north, east = float(u[0]), float(u[1])
        self._rows.append((t, motion.north_m, motion.east_m, north, east))
        self._motion = moved(motion, (north, east), STEP_S, self._config.vehicle)

    def _who_matters(self, now: Instant, own: OwnState, tracks: Tracks) -> IntArray:
        """Rows of ships that can push meanwhile."""
        length_s, age = self._config.guard.way_out_s, tracks.age_s(now)
        until = np.minimum(tracks.validity_s, age + length_s)
        far = self._boxes.nearest(tracks, now, until, own.position_m).distance_m
        near = far < far_m(self._config.field) + self._speed_mps * length_s
        return playable(tracks, age, near)
