"""Going up: for new reports on the way, and at the goal; never into a ship's set."""

import numpy as np

from companion import reach
from companion.config import Config
from companion.instant import Instant
from companion.messages import FloatArray, OwnState, Phase, Reason, Tracks
from companion.planning.surfacing import Surfacing
from companion.reach.kernel import Kernel, nearest

RISE_WITHIN_M = 20.0  # of the place found free
RISEN_M = 2.0  # a vehicle this much above its cruise depth is on its way up


class Ascent:
    """Keeps where to surface next."""

    def __init__(self, config: Config, kernel: Kernel = nearest) -> None:
        self._config = config
        self._kernel = kernel
        self._surfacing = Surfacing(config, kernel)
        self._rise_at: FloatArray | None = None
        self._crossing = 0

    def must_rise(
        self,
        now: Instant,
        own: OwnState,
        tracks: Tracks,
        goal_m: FloatArray,
        crossing: int,
        stuck: bool,
        reasons: list[Reason],
    ) -> bool:
        """Whether new reports are needed and there is a place to get them.

        `crossing` counts the dives; `stuck`: what is known shows no way.
        """
        if self._config.vehicle.cruise_depth_m == 0:
            return False
        if self._crossing != crossing:
            self._crossing = crossing
            self._surfacing.begin(now)
        self._rise_at = self._surfacing.look(now, own, tracks, goal_m, reasons, stuck=stuck)
        return self._rise_at is not None

    def aim(
        self, now: Instant, own: OwnState, tracks: Tracks, below_m: float
    ) -> tuple[FloatArray, float] | None:
        """The place (2,) to surface at, and the depth: `below_m` until the vehicle may rise there.

        What has begun to rise goes on.  None before `must_rise` has found a place.
        """
        if self._rise_at is None:
            return None
        near = own.distance_to_m(self._rise_at) <= RISE_WITHIN_M
        rising = own.depth_m < below_m - RISEN_M
        up = rising or (near and self._surfacing.is_free(now, own, tracks))
        return self._rise_at, 0.0 if up else below_m

    def is_clear(
        self, now: Instant, own: OwnState, tracks: Tracks, phase: Phase, reasons: list[Reason]
    ) -> bool:
        """Whether the next phase may begin: no ship within delta here, nor overhead until we have risen."""
        if not len(tracks):
            return True
        vehicle = self._config.vehicle
        dives = vehicle.cruise_depth_m > 0
        rise_s = max(own.depth_m, 0.0) / vehicle.max_vertical_speed_mps if dives else 0.0
        sets = reach.tube(tracks, now, tracks.age_s(now) + rise_s, self._kernel)
        distance_m = sets.nearest(own.position_m).distance_m
        clear = float(distance_m.min()) > self._config.field.delta_m + self._config.guard.own_position_error_m
        if not clear:
            mmsi = tracks.mmsi[int(np.argmin(distance_m))]
            if phase is Phase.LISTEN:
                reasons.append(Reason("plan.start_occupied", f"MMSI {mmsi} can be here already: not leaving"))
            else:
                where = "overhead before we have surfaced" if dives else "at the goal"
                reasons.append(Reason("plan.surface_occupied", f"MMSI {mmsi} can be {where}"))
        return clear
