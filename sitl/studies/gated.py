"""The improved planner that rehearses first: it crosses when the whole way is safe, and holds until then."""

from dataclasses import dataclass, field, replace

import numpy as np

from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, IntArray, Phase
from companion.planning.rehearsal import Rehearsal
from companion.reach.shapes import only
from sitl.studies.planners import FieldPlanner
from sitl.studies.vehicles import shortened
from sitl.studies.wish import Wish

PERIOD_S = 30.0  # between rehearsals


@dataclass(frozen=True, slots=True)
class Gated:
    """Holds at `post_m` (m, 2) where `leaving` (m,) is not set yet."""

    planner: FieldPlanner
    rehearsal: Rehearsal
    post_m: FloatArray
    leaving: BoolArray
    due: list[Instant] = field(default_factory=lambda: [Instant(-(2**62))])

    def only(self, vehicles: IntArray) -> "Gated":
        """For some of the vehicles."""
        return replace(
            self,
            planner=self.planner.only(vehicles),
            post_m=self.post_m[vehicles],
            leaving=self.leaving[vehicles],
        )

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:
        """See `Planner`."""
        if now >= self.due[0] and not self.leaving.all():
            self.due[0] = Instant(now + round(PERIOD_S * 1e9))
            self._rehearse(now, position_m)
        if not self.leaving.any():
            return Wish(self._hold(now, position_m), self.leaving.copy())
        crossing = self.planner.wish(now, position_m, velocity_mps)
        if self.leaving.all():
            return crossing
        held = self._hold(now, position_m)
        return Wish(np.where(self.leaving[:, None], crossing.velocity_mps, held), crossing.steered)

    def _rehearse(self, now: Instant, position_m: FloatArray) -> None:
        planner = self.planner
        waiting = np.flatnonzero(~self.leaving)
        k = len(planner.tracks) // planner.vehicles
        rows = (waiting[:, None] * k + np.arange(k)).ravel()
        said = self.rehearsal(only(planner.tracks, rows), now, position_m[waiting], planner.goal_m)
        self.leaving[waiting[said.safe]] = True

    def _hold(self, now: Instant, position_m: FloatArray) -> FloatArray:
        """Stay at the post, and out of the way of every set."""
        planner = self.planner
        k = len(planner.tracks) // planner.vehicles
        around = np.repeat(position_m, k, axis=0)
        push = planner.steering.push(planner.tracks, now, around, np.repeat(self.post_m, k, axis=0))
        pull = planner.steering.pull(position_m, self.post_m, Phase.SURFACE)
        return shortened(planner.steering.horizontal(planner.tracks, pull, push), planner.max_speed_mps)
