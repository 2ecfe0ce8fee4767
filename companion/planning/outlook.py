"""Whether there is a safe way: before leaving, and on the way for as long as turning back is possible.

The crossing is rehearsed on what is known (`rehearsal.py`), a few steps of it at every step of the core, so
that no step is late.  Without a safe way the vehicle does not leave; under way and still on the near side of
every ship's course, it holds where it is, keeping clear of every set.  Once it has begun to cross a course it
goes on: to stop between two lanes would be worse.

Ships whose sets are expensive (turning) or not bounded by their course any more (silent beyond their
validity) are not rehearsed: field and guard answer for them at every step.
"""

import numpy as np

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, IntArray, OwnState, Phase, Reason, Tracks
from companion.planning.far import Boxes, far_m, playable
from companion.planning.field import ExactRepulsion
from companion.planning.rehearsal import CAST, MARGIN_M, SLOWEST, Play, Rehearsal, Rehearsed
from companion.planning.steering import Steering
from companion.reach.kernel import Kernel, nearest
from companion.reach.shapes import only

EVERY_S, AGAIN_S = 60.0, 30.0  # from one rehearsal to the next after a safe way was seen, and after none
ROWS_A_STEP, ROWS_BESIDES = 4000, 160  # of sets, and what a moment costs beside them: 5 ms a step
ALONG_M = 50.0  # between places on the straight way where a ship is looked for
SLOW_MPS = 0.5  # a slower ship has no course worth crossing
ASIDE_M = 200.0  # as far as that from the straight way the vehicle may be driven


class Outlook:
    """Keeps the last rehearsal; advanced once a step."""

    def __init__(self, config: Config, kernel: Kernel = nearest) -> None:
        self._config = config
        self._rehearsal = Rehearsal(config, Steering(config, ExactRepulsion(config.field, kernel)), kernel)
        self._wanted = config.planner.rehearse and config.planner.horizon == "clearing"
        self._boxes = Boxes()
        self._play: Play | None = None
        self._over_at: Instant | None = None
        self._why: Reason | None = None  # there is no safe way
        self._was_safe = False
        self._post_m: FloatArray | None = None
        self._left_m: FloatArray | None = None
        self._mmsi: IntArray = np.zeros(0, dtype=np.int64)  # of the ships rehearsed
        # those among the tracks: of whom, and places and directions of their courses
        self._courses: tuple[Tracks, IntArray, tuple[FloatArray, ...]] | None = None
        self._oldest_s, self._known = 0.0, 0

    def look(self, now: Instant, phase: Phase, own: OwnState, tracks: Tracks, goal_m: FloatArray) -> None:
        """Play on, or begin again when it is time."""
        if not self._wanted or phase not in (Phase.LISTEN, Phase.CROSS):
            self._play = self._over_at = self._why = self._post_m = self._left_m = None
            self._was_safe = False
            return
        if phase is Phase.LISTEN or self._left_m is None:
            self._left_m = own.position_m
        if self._play is None and not self._is_due(now, phase, own, tracks):
            return
        play = self._play or self._begin(now, phase, own, tracks, goal_m)
        if play.advance(max(ROWS_A_STEP // (len(CAST) * len(self._mmsi) + ROWS_BESIDES), 1)):
            self._conclude(now, play.rehearsed())

    @property
    def is_playing(self) -> bool:
        """Whether a rehearsal is under way."""
        return self._play is not None

    @property
    def holds(self) -> bool:
        """Whether the vehicle is kept from going on."""
        return self._post_m is not None

    def may_leave(self, reasons: list[Reason]) -> bool:
        """Whether a safe way was seen; why not."""
        if self._why is not None:
            reasons.append(self._why)
        return not self._wanted or (self._over_at is not None and self._why is None)

    def post(self, own: OwnState, tracks: Tracks, reasons: list[Reason]) -> FloatArray | None:
        """Where (2,) to hold under way, and why; None to go on."""
        if self._why is None or self._has_begun_to_cross(own, tracks):
            self._post_m = None
            return None
        reasons.append(self._why)
        if self._post_m is None:
            self._post_m = own.position_m
        return self._post_m

    def _is_due(self, now: Instant, phase: Phase, own: OwnState, tracks: Tracks) -> bool:
        listening = phase is Phase.LISTEN
        if self._over_at is None or (listening and len(tracks) > self._known):
            return True
        wait_s = AGAIN_S if listening or not self._was_safe else EVERY_S
        return elapsed_s(self._over_at, now) >= wait_s and (
            listening or not self._has_begun_to_cross(own, tracks)
        )

    def _begin(self, now: Instant, phase: Phase, own: OwnState, tracks: Tracks, goal_m: FloatArray) -> Play:
        rows, self._known = self._who_matters(now, own, tracks, goal_m), len(tracks)
        known = only(tracks, rows)
        self._mmsi, self._oldest_s = known.mmsi, float(known.age_s(now).max(initial=0.0))
        self._play = self._rehearsal.begin(
            known,
            now,
            own.position_m[None],
            goal_m,
            # under way, what was found safe is given up only when it is not safe at all
            margin_m=0.0 if self._was_safe and phase is Phase.CROSS else MARGIN_M,
            within_s=float((known.validity_s - known.age_s(now)).min(initial=np.inf)),
        )
        return self._play

    def _conclude(self, now: Instant, found: Rehearsed) -> None:
        self._play, self._over_at, self._was_safe = None, now, bool(found.safe[0])
        self._why = None
        if not self._was_safe:
            least_m = float(found.closest_m[0])
            near = least_m < self._config.field.delta_m + MARGIN_M
            how = f"comes within {max(least_m, 0.0):.0f} m of a set" if near else "does not arrive"
            text = f"no safe way on reports up to {self._oldest_s:.0f} s old: {how}"
            self._why = Reason("plan.no_safe_way", text)

    def _who_matters(self, now: Instant, own: OwnState, tracks: Tracks, goal_m: FloatArray) -> IntArray:
        """Rows that are rehearsed: of ships on a course, those whose tube comes near to the straight way."""
        way_m, age = goal_m - own.position_m, tracks.age_s(now)
        length_m = float(np.hypot(*way_m))
        longest_s = SLOWEST * length_m / self._config.vehicle.max_speed_mps
        until = np.minimum(tracks.validity_s, age + longest_s)
        least_m = np.full(len(tracks), np.inf)
        for share in np.linspace(0.0, 1.0, int(length_m / ALONG_M) + 2):
            place = own.position_m + share * way_m
            least_m = np.minimum(least_m, self._boxes.nearest(tracks, now, until, place).distance_m)
        near = least_m < far_m(self._config.field) + ASIDE_M
        return playable(tracks, age, near)

    def _has_begun_to_cross(self, own: OwnState, tracks: Tracks) -> bool:
        """Whether the course of a rehearsed ship runs between here and where the vehicle left."""
        if self._left_m is None:
            return False
        if self._courses is None or self._courses[0] is not tracks or self._courses[1] is not self._mmsi:
            rows = np.isin(tracks.mmsi, self._mmsi) & (tracks.sog_mps > SLOW_MPS)
            north, east, cog = tracks.north_m[rows], tracks.east_m[rows], tracks.cog_rad[rows]
            self._courses = tracks, self._mmsi, (north, east, np.cos(cog), np.sin(cog))
        north, east, cos, sin = self._courses[2]
        aside = [
            (place[1] - east) * cos - (place[0] - north) * sin for place in (own.position_m, self._left_m)
        ]
        return bool((aside[0] * aside[1] < 0).any())
