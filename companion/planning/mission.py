"""Where the crossing stands: wait, listen at the surface, cross, surface at the goal.

    WAIT --ready--> LISTEN --heard enough--> CROSS --at goal--> SURFACE --surfaced--> ARRIVED
                      ^--surfaced-- RISE <--new reports needed--'

A surface vehicle (cruise depth 0) goes the same way without the dive.
"""

from collections.abc import Callable

from companion.config import Goal, Vehicle
from companion.instant import Instant, elapsed_s
from companion.messages import OwnState, Phase


class Mission:
    """Keeps the phase; `advance` is the only thing that moves it."""

    def __init__(self, vehicle: Vehicle, goal: Goal) -> None:
        self._vehicle = vehicle
        self._goal = goal
        self._listening_since: Instant | None = None
        self._idle_since: Instant | None = None
        self.phase = Phase.WAIT
        self.crossings = 0  # begun after listening

    def pause(self, now: Instant) -> Phase:
        """The phase while we do not steer: nothing moves, but how long it lasted is remembered."""
        if self._idle_since is None:
            self._idle_since = now
        return self.phase

    def advance(
        self,
        now: Instant,
        own: OwnState,
        to_goal_m: float,
        reports_heard: int,
        is_clear: Callable[[], bool],
        must_rise: Callable[[], bool] = lambda: False,
    ) -> Phase:
        """The phase now.

        `is_clear()`: no ship can be here, nor overhead before the vehicle has risen; asked only when
        the answer matters.
        `must_rise()`: new reports are needed, and the surface will be free.
        """
        idle_s = 0.0 if self._idle_since is None else elapsed_s(self._idle_since, now)
        self._idle_since = None
        # a surface vehicle's depth is its barometer's drift: some metres with every change of weather
        surfaced = self._vehicle.cruise_depth_m == 0 or own.depth_m <= self._vehicle.surfaced_depth_m
        match self.phase:
            case Phase.WAIT:
                self.phase = Phase.LISTEN
            case Phase.CROSS | Phase.RISE if surfaced and idle_s >= self._vehicle.listen_s > 0:
                self.phase, self._listening_since = Phase.LISTEN, None  # who has come meanwhile?
            case Phase.LISTEN:
                self._listen(now, surfaced, reports_heard, is_clear)
            case Phase.CROSS if to_goal_m <= self._goal.radius_m and is_clear():
                self.phase = Phase.SURFACE
            case Phase.CROSS if not surfaced and must_rise():
                self.phase = Phase.RISE
                self._listening_since = None
            case Phase.RISE if surfaced:
                self.phase = Phase.LISTEN
            case Phase.SURFACE if to_goal_m > 2 * self._goal.radius_m:
                self.phase = Phase.CROSS  # driven off by a ship or a current
            case Phase.SURFACE if surfaced:
                self.phase = Phase.ARRIVED
            case _:
                pass
        return self.phase

    def target_depth_m(self) -> float:
        """The depth this phase wants; on the way to where it rises the vehicle stays down."""
        return self._vehicle.cruise_depth_m if self.phase in (Phase.CROSS, Phase.RISE) else 0.0

    def _listen(self, now: Instant, surfaced: bool, reports_heard: int, is_clear: Callable[[], bool]) -> None:
        if not surfaced:
            self._listening_since = None  # the antenna hears nothing under water
            return
        if self._listening_since is None:
            self._listening_since = now
        listened_s = elapsed_s(self._listening_since, now)
        if listened_s >= self._vehicle.listen_s and reports_heard > 0 and is_clear():
            self.phase = Phase.CROSS
            self.crossings += 1
