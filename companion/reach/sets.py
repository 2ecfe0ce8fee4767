"""Reachable sets of all contacts at once: the one interface to every obstacle model.

    tube(tracks, now, until_age_s)   everything a ship can cover from now until its report is that old
    at(tracks, now, ahead_s)         where it can be at one instant

The model that holds is the one at `now` (for `at`: at now + ahead): a contact older than its validity
is a DISC of radius `disc_speed_mps` times age.  Silence makes a set grow; nothing is dropped.
"""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, after
from companion.messages import BoolArray, FloatArray, IntArray, Nearest, Tracks
from companion.reach.interface import Sets
from companion.reach.outline import polygon_around
from companion.reach.shapes import prepare


@dataclass(frozen=True, slots=True)
class ReachableSets:
    """One set per contact, in the rows of the tracks it was made from."""

    north_m: FloatArray  # (n,) reported positions
    east_m: FloatArray
    parts: tuple[tuple[IntArray | None, Sets], ...]  # rows (None: all) and their sets
    is_disc: BoolArray | None  # (n,) rows where a disc stands instead; None: nowhere
    disc_m: FloatArray  # (n,) its radius

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
        for row, position in enumerate(positions_m):
            nearest = self.nearest(position)
            distance[row], away[row] = nearest.distance_m, nearest.away
        return distance, away

    def support(self, directions: FloatArray) -> FloatArray:
        """(n, k) max over the set of direction . point, for unit directions (k, 2), local frame."""
        angle = np.arctan2(directions[:, 1], directions[:, 0])
        reach = np.repeat(self.disc_m[:, None], len(directions), axis=1)
        for rows, sets in self.parts:
            here = slice(None) if rows is None else rows
            reach[here] = sets.support(angle)
        if self.is_disc is not None:
            reach[self.is_disc] = self.disc_m[self.is_disc, None]
        return reach + np.outer(self.north_m, directions[:, 0]) + np.outer(self.east_m, directions[:, 1])

    def outline(self, i: int) -> FloatArray:
        """(m, 2) closed convex polygon around set i, for drawing; it contains the set."""
        return polygon_around(self.support, i)

    def _distances(self, north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        if len(self.parts) == 1 and self.parts[0][0] is None:
            distance, away_north, away_east = self.parts[0][1].distances(north, east)
        else:
            distance, away_north, away_east = np.empty((3, len(self)))
            for rows, sets in self.parts:
                distance[rows], away_north[rows], away_east[rows] = sets.distances(north[rows], east[rows])
        if self.is_disc is not None:
            length = np.hypot(north, east)
            # at the very centre every direction leads out; north is as good as any
            scale = 1.0 / np.where(length > 0, length, 1.0)
            radial_north = np.where(length > 0, north * scale, 1.0)
            distance = np.where(self.is_disc, length - self.disc_m, distance)
            away_north = np.where(self.is_disc, radial_north, away_north)
            away_east = np.where(self.is_disc, east * scale, away_east)
        return distance, away_north, away_east


def tube(tracks: Tracks, now: Instant, until_age_s: FloatArray | float) -> ReachableSets:
    """Everything each ship can cover while its report's age runs from now's to `until_age_s` ((n,) or one).

    This is O_[t0, t, t0 + T] of eq. (4) with `until_age_s` = T.  Where T has passed it is the set now.
    """
    age = tracks.age_s(now)
    return _sets(tracks, age, np.maximum(age, until_age_s))


def at(tracks: Tracks, now: Instant, ahead_s: float = 0.0) -> ReachableSets:
    """Where each ship can be at `now + ahead_s`."""
    age = tracks.age_s(after(now, ahead_s))
    return _sets(tracks, age, age)


def _sets(tracks: Tracks, age: FloatArray, until: FloatArray) -> ReachableSets:
    shapes = prepare(tracks)
    parts = tuple(
        (rows, shape.between(age, until) if rows is None else shape.between(age[rows], until[rows]))
        for rows, shape in shapes.parts
    )
    is_disc = shapes.is_disc | (age > tracks.validity_s)
    disc = tracks.disc_speed_mps * until + shapes.disc_margin_m
    return ReachableSets(tracks.north_m, tracks.east_m, parts, is_disc if is_disc.any() else None, disc)
