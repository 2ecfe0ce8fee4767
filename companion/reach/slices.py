"""Where each ship can be, instant by instant: many ships at many instants in one question.

`sets.at` answers for all ships at one instant.  A manoeuvre asks at a hundred, so here every question
names its own row, age and point.  Beside the distance it gives how fast the set can come on: the
support of its velocities in the direction of the point.

For STRAIGHT and DISC the set at age t is  o0 + t K + H  with convex K and H.  Then

    d(x, t) = max over unit n of  n . (x - o0) - t h_K(n) - h_H(n)

is convex in position and time together, and along a straight run at velocity v it is nowhere below
its tangent, whose slope is  n . v - h_K(n):  exact between instants, without a Lipschitz constant.
For TURNING, KITE and BOX a bound with the greatest speed of the set's edge takes its place.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray, IntArray, Model, Tracks
from companion.reach.disc import DiscSets
from companion.reach.hull import Corners
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel, nearest
from companion.reach.shapes import Prepared, Same, hull_m, only, prepare
from companion.reach.spread import SpreadShapes, edge_speed_mps, spread_shapes
from companion.reach.straight import StraightShapes
from companion.reach.support import support_motion
from companion.reach.turning import SLAB_S, TurningShapes

SHIP_BY_SHIP = 12  # from so many questions a ship on, its set is not copied for each


@dataclass(frozen=True, slots=True)
class Slices:
    """The sets of `tracks` at any age; rows are theirs.

    `drift_mps` (n, 2) and `spread_mps` (n,): the set at age t lies within `spread t + size_m` of
    o0 + t drift, as long as the age is at most `validity_s`; later it grows by `top_speed_mps` on all
    sides.
    """

    tracks: Tracks
    kernel: Kernel
    drift_mps: FloatArray
    spread_mps: FloatArray
    size_m: FloatArray
    turned_m: FloatArray  # added at the end of the validity

    @classmethod
    def of(cls, tracks: Tracks, kernel: Kernel = nearest) -> "Slices":
        """The discs around the sets; the sets' own shapes are prepared when first asked for.

        Raises `ValueError` for a number that is not finite: it would let a ship out of every comparison.
        """
        hull = Corners.of(tracks).length_m.max(axis=0, initial=0.0)
        is_straight = tracks.model == Model.STRAIGHT
        fast = tracks.sog_mps + tracks.speed_noise_mps
        course = np.column_stack((np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)))
        drift = np.where(is_straight[:, None], tracks.sog_mps[:, None] * course, 0.0)
        aside = tracks.speed_noise_mps + 2 * fast * np.sin(0.5 * tracks.course_noise_rad)
        swing = (np.abs(tracks.turn_rate_radps) + tracks.turn_rate_error_radps) * hull
        roaming = np.where(tracks.model == Model.DISC, tracks.disc_speed_mps, fast + swing)
        spread = np.where(is_straight, aside, roaming)
        strays = tracks.model >= Model.KITE
        if strays.any():
            spread = np.where(strays, edge_speed_mps(tracks), spread)
        size, turned = hull + tracks.position_error_m, hull_m(tracks)
        for values in (tracks.north_m, tracks.east_m, tracks.top_speed_mps, drift, spread, size, turned):
            if not np.isfinite(values).all():
                raise ValueError("tracks have a value that is no finite number")
        return cls(tracks, kernel, drift, spread, size, turned)

    def __len__(self) -> int:
        return len(self.tracks)

    def age_s(self, now: Instant) -> FloatArray:
        """(n,) seconds since each report; may be negative for one measured just now."""
        return np.asarray((now - self.tracks.measured_at_ns) * 1e-9)

    def grown_m(self, rows: IntArray, age_s: FloatArray) -> FloatArray:
        """What is added on all sides beyond the validity; 0 before."""
        beyond = np.maximum(age_s - self.tracks.validity_s[rows], 0.0)
        late = self.tracks.top_speed_mps[rows] * beyond + self.turned_m[rows]
        return np.where(beyond > 0, late, 0.0)

    def distances(
        self, rows: IntArray, age_s: FloatArray, until_s: FloatArray, north_m: FloatArray, east_m: FloatArray
    ) -> Distances:
        """Distances and directions (m,) from the tubes [age_s, until_s] of `rows` to points, all (m,)."""
        validity = self.tracks.validity_s[rows]
        age = np.minimum(np.maximum(age_s, 0.0), validity)
        until = np.minimum(np.maximum(until_s, age), validity)
        north, east = north_m - self.tracks.north_m[rows], east_m - self.tracks.east_m[rows]
        found = np.empty((3, len(rows)))
        kind = self.tracks.model[rows]
        for model, answer in (
            (Model.STRAIGHT, self._straight),
            (Model.DISC, self._disc),
            (Model.TURNING, self._turning),
            (Model.KITE, self._spread),
            (Model.BOX, self._spread),
        ):
            some = np.flatnonzero(kind == model)
            if len(some) == len(rows):
                found[:] = answer(rows, age, until, north, east)
                break
            if len(some):
                found[:, some] = answer(rows[some], age[some], until[some], north[some], east[some])
        return found[0] - self.grown_m(rows, np.maximum(until_s, age_s)), found[1], found[2]

    def advance_mps(
        self, rows: IntArray, age_s: FloatArray, away_north: FloatArray, away_east: FloatArray
    ) -> FloatArray:
        """(m,) how fast the set's edge can advance in the direction of the point: h_K(n)."""
        tracks = self.tracks
        angle = np.arctan2(away_east, away_north) - tracks.cog_rad[rows]
        slow = tracks.sog_mps[rows] - tracks.speed_noise_mps[rows]
        fast = tracks.sog_mps[rows] + tracks.speed_noise_mps[rows]
        along = support_motion(slow, fast, tracks.course_noise_rad[rows], angle)
        within = np.where(tracks.model[rows] == Model.STRAIGHT, along, self.spread_mps[rows])
        return np.where(age_s > tracks.validity_s[rows], tracks.top_speed_mps[rows], within)

    def retreat_mps(self, rows: IntArray, age_s: FloatArray, advance_mps: FloatArray) -> FloatArray:
        """(m,) how much nearer per second the edge surely was not, going back in time.

        The tangent holds both ways for STRAIGHT, DISC and what has expired: there it is the advance itself.
        Of the others only the greatest speed is known, and they may have come from either side.
        """
        tracks = self.tracks
        tangent = (tracks.model[rows] <= Model.DISC) | (age_s > tracks.validity_s[rows])
        return np.where(tangent, advance_mps, -advance_mps)

    def _straight(
        self, rows: IntArray, age: FloatArray, until: FloatArray, north: FloatArray, east: FloatArray
    ) -> Distances:
        shapes, places = _straight(Same(self.tracks), self.kernel)
        place = places[rows]
        slow, fast = shapes.slow_mps[place], shapes.fast_mps[place]
        near = np.minimum(age * slow, until * slow)
        far = until * fast
        order = np.argsort(place, kind="stable")
        first = np.flatnonzero(np.diff(place[order], prepend=-1))
        if len(place) < SHIP_BY_SHIP * len(first) and len(first) > 1:
            arcs = shapes.arcs.take(place, packed=shapes.kernel is not nearest)
            return shapes.kernel(arcs, near, far, north, east)
        out = np.empty((3, len(place)))
        for some in np.split(order, first[1:]):
            arcs = shapes.arcs.only(int(place[some[0]]))
            out[:, some] = shapes.kernel(arcs, near[some], far[some], north[some], east[some])
        return out[0], out[1], out[2]

    def _disc(
        self, rows: IntArray, age: FloatArray, until: FloatArray, north: FloatArray, east: FloatArray
    ) -> Distances:
        del age  # a disc only grows
        return DiscSets(self.spread_mps[rows] * until + self.size_m[rows]).distances(north, east)

    def _turning(
        self, rows: IntArray, age: FloatArray, until: FloatArray, north: FloatArray, east: FloatArray
    ) -> Distances:
        """Tubes between round ages, which contain those asked for; each is computed once."""
        turning, places = _turning(Same(self.tracks), self.kernel)
        # `sets.at` rounds to whole seconds: a second more to either side holds that too
        begin = SLAB_S * np.floor(np.maximum(age - 1.0, 0.0) / SLAB_S)
        end = np.maximum(SLAB_S * np.ceil((until + 1.0) / SLAB_S), begin + SLAB_S)
        asked, which = np.unique(np.stack((places[rows], begin, end)), axis=1, return_inverse=True)
        out = np.empty((3, len(rows)))
        for k in range(asked.shape[1]):
            some = np.flatnonzero(which == k)
            one = int(asked[0, k])
            shapes = TurningShapes((turning.turns[one],), turning.kernel)
            out[:, some] = shapes.between(asked[1:2, k], asked[2:3, k]).distances(north[some], east[some], 0)
        return out[0], out[1], out[2]

    def _spread(
        self, rows: IntArray, age: FloatArray, until: FloatArray, north: FloatArray, east: FloatArray
    ) -> Distances:
        shapes, places = _spreading(Same(self.tracks))
        return shapes.take(places[rows]).between(age, until).distances(north, east)


ShapesKind = TypeVar("ShapesKind", StraightShapes, TurningShapes)


@lru_cache(maxsize=4)
def _straight(same: Same, kernel: Kernel) -> tuple[StraightShapes, IntArray]:
    return _place(prepare(same.tracks, kernel), StraightShapes, len(same.tracks))


@lru_cache(maxsize=4)
def _turning(same: Same, kernel: Kernel) -> tuple[TurningShapes, IntArray]:
    return _place(prepare(same.tracks, kernel), TurningShapes, len(same.tracks))


@lru_cache(maxsize=4)
def _spreading(same: Same) -> tuple[SpreadShapes, IntArray]:
    rows = np.flatnonzero(np.isin(same.tracks.model, (Model.KITE, Model.BOX)))
    place = np.full(len(same.tracks), -1, dtype=np.int64)
    place[rows] = np.arange(len(rows))
    return spread_shapes(only(same.tracks, rows), nearest), place


def _place(prepared: Prepared, kind: type[ShapesKind], n: int) -> tuple[ShapesKind, IntArray]:
    """One model's shapes, and each row's place among them or -1."""
    place = np.full(n, -1, dtype=np.int64)
    for rows, shapes in prepared.parts:
        if isinstance(shapes, kind):
            mine = np.arange(n) if rows is None else rows
            place[mine] = np.arange(len(mine))
            return shapes, place
    raise ValueError(f"no {kind.__name__} among the tracks")
