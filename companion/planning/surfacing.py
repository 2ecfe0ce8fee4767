"""Surfacing as a decision: when new reports are needed, and where and when the surface is free.

Needed when the information's validity runs out before the goal, when there has been no way forward for
long (a crossing does not fit), or when a ship's set nearby has become too large.  Free is a place whose
surface no set touches for as long as ascent, listening and descent take.
"""

import numpy as np

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, OwnState, Reason, Tracks
from companion.reach import Slices
from companion.reach.kernel import Kernel, nearest

LOOK_EVERY_S = 5.0
OFFSETS_M = np.array((0.0, -50.0, 50.0, -100.0, 100.0, -200.0, 200.0, -400.0, 400.0))  # along the way
WAITS_S = np.arange(0.0, 601.0, 20.0)
NEARBY_M = 1000.0
HEARD_WITHIN_S = 120.0  # before listening began: class A at anchor reports every three minutes
PROGRESS_M = 10.0
PLANNED_SHARE = 0.8  # of full speed, made good on the way to the goal


class Surfacing:
    """Keeps how the way went since the last listening; `look` says where to surface, if now is due."""

    def __init__(self, config: Config, kernel: Kernel = nearest) -> None:
        self._config = config
        self._kernel = kernel
        self._slices: Slices | None = None
        self._best_m = np.inf
        self._progress_at: Instant | None = None
        self._dived_at: Instant | None = None
        self._looked_at: Instant | None = None
        self._found: tuple[FloatArray, float] | None = None
        self._due: Reason | None = None

    def begin(self, now: Instant) -> None:
        """A crossing begins, or goes on after listening."""
        self._best_m, self._progress_at, self._dived_at = np.inf, now, now
        self._looked_at = self._found = self._due = None

    def look(
        self,
        now: Instant,
        own: OwnState,
        tracks: Tracks,
        goal_m: FloatArray,
        reasons: list[Reason],
        *,
        stuck: bool = False,
    ) -> FloatArray | None:
        """Where (2,) to surface now; None while that is not needed or not possible.

        `stuck`: what is known shows no way; then new reports are needed at once.
        """
        if self._progress_at is None or self._dived_at is None:
            self.begin(now)
        if self._looked_at is None or elapsed_s(self._looked_at, now) >= LOOK_EVERY_S:
            self._looked_at = now
            self._due = self._why(now, own, tracks, goal_m, stuck)
            self._found = None if self._due is None else self._where(now, own, tracks, goal_m)
        if self._due is None:
            return None
        reasons.append(self._due)
        if self._found is None:
            text = f"no place to surface within {WAITS_S[-1]:.0f} s: staying down"
            reasons.append(Reason("plan.cannot_surface", text))
            return None
        place, wait_s = self._found
        if wait_s > 0:
            reasons.append(Reason("plan.surface_later", f"surface free in {wait_s:.0f} s: staying down"))
            return None
        return place

    def is_free(self, now: Instant, own: OwnState, tracks: Tracks) -> bool:
        """Whether the vehicle can go up, listen and dive again where it is."""
        return not len(tracks) or bool(
            self._room(now, own, tracks, own.position_m[None], np.zeros(1)).min() > 0
        )

    def _why(
        self, now: Instant, own: OwnState, tracks: Tracks, goal_m: FloatArray, stuck: bool
    ) -> Reason | None:
        rule, vehicle = self._config.surfacing, self._config.vehicle
        assert self._progress_at is not None
        assert self._dived_at is not None
        to_goal_m = own.distance_to_m(goal_m)
        if to_goal_m < self._best_m - PROGRESS_M:
            self._best_m, self._progress_at = to_goal_m, now
        if rule.every_s > 0:
            due = elapsed_s(self._dived_at, now) >= rule.every_s
            return Reason("plan.surfacing_interval", f"surfacing every {rule.every_s:.0f} s") if due else None
        if not len(tracks):
            return None
        goal_s = to_goal_m / (PLANNED_SHARE * vehicle.max_speed_mps)
        slices = self._of(tracks)
        age = slices.age_s(now)
        # whom the last listening did not hear again, another would not either: going up is no help
        age_at_dive = age - elapsed_s(self._dived_at, now)
        heard = age_at_dive <= vehicle.listen_s + HEARD_WITHIN_S
        left_s = float((tracks.validity_s - age).min(where=heard, initial=np.inf))
        if left_s < min(rule.reserve_s + self._stay_s(own), goal_s):
            text = f"reports are valid for {max(left_s, 0):.0f} s more, the goal is {goal_s:.0f} s away"
            return Reason("plan.information_ends", text)
        stuck_s = elapsed_s(self._progress_at, now)
        if stuck or stuck_s > rule.patience_s:
            how = "no safe way" if stuck else f"no way forward for {stuck_s:.0f} s"
            return Reason("plan.does_not_fit", f"{how}: new reports are needed")
        centre = np.column_stack((tracks.north_m, tracks.east_m)) + slices.drift_mps * age[:, None]
        near = heard & (np.hypot(*(centre - own.position_m).T) < NEARBY_M)
        size_m = float((slices.spread_mps * age)[near].max(initial=0.0))
        if size_m > rule.largest_set_m:
            return Reason("plan.set_too_large", f"a ship nearby can be anywhere within {size_m:.0f} m")
        return None

    def _where(
        self, now: Instant, own: OwnState, tracks: Tracks, goal_m: FloatArray
    ) -> tuple[FloatArray, float] | None:
        """The place that is free soonest, and how long to wait before leaving for it."""
        ahead = goal_m - own.position_m
        ahead = ahead / max(float(np.hypot(*ahead)), 1.0)
        places = own.position_m + OFFSETS_M[:, None] * ahead
        travel_s = np.abs(OFFSETS_M) / (PLANNED_SHARE * self._config.vehicle.max_speed_mps)
        if not len(tracks):
            return places[0], 0.0
        k, w = (part.ravel() for part in np.meshgrid(np.arange(len(places)), np.arange(len(WAITS_S))))
        room = self._room(now, own, tracks, places[k], WAITS_S[w] + travel_s[k])
        free = np.flatnonzero(room > 0)
        if not len(free):
            return None
        best = free[int(np.argmin((WAITS_S[w] + travel_s[k])[free]))]
        return places[k[best]], float(WAITS_S[w[best]])

    def _room(
        self, now: Instant, own: OwnState, tracks: Tracks, places: FloatArray, wait_s: FloatArray
    ) -> FloatArray:
        """(m,) room at places (m, 2) from `wait_s` (m,) on for a stay at the surface."""
        slices, n = self._of(tracks), len(tracks)
        age = slices.age_s(now)
        guard = self._config.guard
        margin = self._config.field.delta_m + 2 * guard.own_position_error_m + guard.tracking_error_m
        place, ship = (
            part.ravel() for part in np.meshgrid(np.arange(len(places)), np.arange(n), indexing="ij")
        )
        start = age[ship] + wait_s[place]
        distance, _, _ = slices.distances(
            ship, start, start + self._stay_s(own), places[place, 0], places[place, 1]
        )
        return np.asarray(distance.reshape(len(places), n).min(axis=1) - margin)

    def _stay_s(self, own: OwnState) -> float:
        """Ascent, listening and descent."""
        vehicle = self._config.vehicle
        deep = max(own.depth_m, vehicle.cruise_depth_m)
        return 2 * deep / vehicle.max_vertical_speed_mps + vehicle.listen_s

    def _of(self, tracks: Tracks) -> Slices:
        if self._slices is None or self._slices.tracks is not tracks:
            self._slices = Slices.of(tracks, self._kernel)
        return self._slices
