"""Reachable sets of all contacts at once: the one interface to every obstacle model.

    tube(tracks, now, until_age_s)   everything a ship can cover from now until its report is that old
    at(tracks, now, ahead_s)         where it can be at one instant

A model's bounds hold until the contact's `validity_s`.  From then on its set grows on all sides at
`top_speed_mps`, and by the hull, which may have turned: S(age) = S(validity) + disc.  Silence makes
a set grow; nothing is dropped.
"""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, after
from companion.messages import FloatArray, IntArray, Nearest, Tracks
from companion.reach.interface import Distances, Sets
from companion.reach.kernel import Kernel, nearest
from companion.reach.outline import polygon_around
from companion.reach.shapes import prepare


@dataclass(frozen=True, slots=True)
class ReachableSets:
    """One set per contact, in the rows of the tracks it was made from."""

    north_m: FloatArray  # (n,) reported positions
    east_m: FloatArray
    parts: tuple[tuple[IntArray | None, Sets], ...]  # rows (None: all) and their sets
    grown_m: FloatArray | None  # (n,) added on all sides beyond the validity; None: nowhere

    def __len__(self) -> int:
        return len(self.north_m)

    def nearest(self, position_m: FloatArray) -> Nearest:
        """Distance and direction from every set to `position_m`, (2,) or one row (n, 2) per set."""
        north = position_m[..., 0] - self.north_m
        east = position_m[..., 1] - self.east_m
        distance, away_north, away_east = self._distances(north, east)
        away = np.empty((len(self), 2))
        away[:, 0], away[:, 1] = away_north, away_east
        return Nearest(distance, away)

    def nearest_many(self, positions_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (m, n) and directions (m, n, 2) of every set for many positions (m, 2)."""
        distance = np.empty((len(positions_m), len(self)))
        away = np.empty((len(positions_m), len(self), 2))
        if len(positions_m) <= len(self):
            for row, position in enumerate(positions_m):
                nearest = self.nearest(position)
                distance[row], away[row] = nearest.distance_m, nearest.away
            return distance, away
        for rows, sets in self.parts:
            for k, i in enumerate(range(len(self)) if rows is None else rows):
                north = positions_m[:, 0] - self.north_m[i]
                east = positions_m[:, 1] - self.east_m[i]
                distance[:, i], away[:, i, 0], away[:, i, 1] = sets.distances(north, east, k)
        if self.grown_m is not None:
            distance -= self.grown_m
        return distance, away

    def support(self, directions: FloatArray) -> FloatArray:
        """(n, k) max over the set of direction . point, for unit directions (k, 2), local frame."""
        angle = np.arctan2(directions[:, 1], directions[:, 0])
        reach = np.outer(self.north_m, directions[:, 0]) + np.outer(self.east_m, directions[:, 1])
        for rows, sets in self.parts:
            reach[slice(None) if rows is None else rows] += sets.support(angle)
        return reach if self.grown_m is None else reach + self.grown_m[:, None]

    def outline(self, i: int) -> FloatArray:
        """(m, 2) closed convex polygon around set i, corners on its boundary, for drawing."""

        def hull(angle: FloatArray) -> FloatArray:
            return np.asarray(self._supports(i, angle).max(axis=0))

        return polygon_around(hull, *self._origin(i))

    def outlines(self, i: int) -> list[FloatArray]:
        """The convex polygons whose union is set i: one, but for a turning ship's tube."""

        def drawn(k: int) -> FloatArray:
            def part(angle: FloatArray) -> FloatArray:
                return np.asarray(self._supports(i, angle)[k])

            return polygon_around(part, *self._origin(i))

        return [drawn(k) for k in range(len(self._supports(i, np.zeros(1))))]

    def _origin(self, i: int) -> tuple[float, float]:
        return float(self.north_m[i]), float(self.east_m[i])

    def _supports(self, i: int, angle: FloatArray) -> FloatArray:
        """(p, k) supports of the convex parts of set i around its reported position."""
        rows, sets = next(part for part in self.parts if part[0] is None or i in part[0])
        own = sets.support(angle, i if rows is None else int(np.searchsorted(rows, i)))
        return own if self.grown_m is None else own + self.grown_m[i]

    def _distances(self, north: FloatArray, east: FloatArray) -> Distances:
        if len(self.parts) == 1 and self.parts[0][0] is None:
            distance, away_north, away_east = self.parts[0][1].distances(north, east)
        else:
            distance, away_north, away_east = np.empty((3, len(self)))
            for rows, sets in self.parts:
                distance[rows], away_north[rows], away_east[rows] = sets.distances(north[rows], east[rows])
        if self.grown_m is not None:
            distance = distance - self.grown_m
        return distance, away_north, away_east


def tube(
    tracks: Tracks, now: Instant, until_age_s: FloatArray | float, kernel: Kernel = nearest
) -> ReachableSets:
    """Everything each ship can cover while its report's age runs from now's to `until_age_s` ((n,) or one).

    This is O_[t0, t, t0 + T] of eq. (4) with `until_age_s` = T.  Where T has passed it is the set now.
    """
    age = tracks.age_s(now)
    return _sets(tracks, age, np.maximum(age, until_age_s), kernel)


def at(tracks: Tracks, now: Instant, ahead_s: float = 0.0, kernel: Kernel = nearest) -> ReachableSets:
    """Where each ship can be at `now + ahead_s`."""
    age = tracks.age_s(after(now, ahead_s))
    return _sets(tracks, age, age, kernel)


def _sets(tracks: Tracks, age: FloatArray, until: FloatArray, kernel: Kernel) -> ReachableSets:
    shapes = prepare(tracks, kernel)
    beyond_s = until - tracks.validity_s
    grown = None
    if (beyond_s > 0).any():
        age, until = np.minimum(age, tracks.validity_s), np.minimum(until, tracks.validity_s)
        grown = np.where(beyond_s > 0, tracks.top_speed_mps * beyond_s + shapes.turned_m, 0.0)
    parts = tuple(
        (rows, shape.between(age, until) if rows is None else shape.between(age[rows], until[rows]))
        for rows, shape in shapes.parts
    )
    return ReachableSets(tracks.north_m, tracks.east_m, parts, grown)
