"""Reachable sets of all contacts at once: the one interface to every obstacle model.

    tube(tracks, now, until_age_s)   everything a ship can cover from now until its report is that old
    at(tracks, now, ahead_s)         where it can be at one instant

The model that holds is the one at `now` (for `at`: at now + ahead): a STRAIGHT contact older than its
validity is a DISC of radius `disc_speed_mps` times age.  Silence makes a set grow; nothing is dropped.
"""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, after
from companion.messages import BoolArray, FloatArray, Model, Nearest, Tracks
from companion.reach.arcs import Arcs
from companion.reach.straight import hull_corners, straight_arcs
from companion.reach.support import motion_radii, support_hull, support_motion

CHUNK = 200_000  # elements of the widest temporary in `nearest_many`
OUTLINE_POINTS = 180


@dataclass(frozen=True, slots=True)
class ReachableSets:
    """One convex set per contact, in the rows of `tracks`."""

    tracks: Tracks
    arcs: Arcs
    near_m: FloatArray  # (n,) r1 and r2 of the straight model
    far_m: FloatArray
    is_disc: BoolArray  # (n,)
    disc_m: FloatArray  # (n,) radius where it is a disc

    def __len__(self) -> int:
        return len(self.tracks)

    def nearest(self, position_m: FloatArray) -> Nearest:
        """Distance and direction from every set to `position_m`, (2,) or one row (n, 2) per set."""
        position = np.asarray(position_m, dtype=np.float64)
        if not len(self):
            return Nearest(np.empty(0), np.empty((0, 2)))
        offset = (position[..., 0] - self.tracks.north_m) + 1j * (position[..., 1] - self.tracks.east_m)
        support = self.arcs.support_at(self.near_m, self.far_m)
        distance, away = self.arcs.nearest(self.near_m, self.far_m, support, offset)
        if self.is_disc.any():
            length = np.abs(offset)
            # at the very centre every direction leads out; north is as good as any
            radial = np.where(length > 0, offset, 1.0) / np.where(length > 0, length, 1.0)
            distance = np.where(self.is_disc, length - self.disc_m, distance)
            away = np.where(self.is_disc, radial, away)
        return Nearest(distance, np.column_stack((away.real, away.imag)))

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
        t = self.tracks
        angle = np.arctan2(directions[:, 1], directions[:, 0])
        motion = support_motion(
            self.near_m[:, None],
            self.far_m[:, None],
            t.course_noise_rad[:, None],
            angle - t.cog_rad[:, None],
        )
        hull = support_hull(
            t.bow_m[:, None],
            t.stern_m[:, None],
            t.port_m[:, None],
            t.starboard_m[:, None],
            t.heading_error_rad[:, None],
            angle - t.heading_rad[:, None],
        )
        straight = motion + hull + t.position_error_m[:, None]
        origin = t.north_m[:, None] * directions[:, 0] + t.east_m[:, None] * directions[:, 1]
        return origin + np.where(self.is_disc[:, None], self.disc_m[:, None], straight)

    def outline(self, i: int) -> FloatArray:
        """(m, 2) closed polygon around set i, for drawing: its tangents' corners, so it contains the set."""
        angle = np.linspace(0, 2 * np.pi, OUTLINE_POINTS, endpoint=False)
        if not self.is_disc[i]:
            angle = np.concatenate((angle, np.angle(self.arcs.normal[:, i])))
        angle = np.unique(np.round(np.mod(angle, 2 * np.pi), 9))
        normal = np.column_stack((np.cos(angle), np.sin(angle)))
        h = self.support(normal)[i]
        following, h_next = np.roll(normal, -1, axis=0), np.roll(h, -1)
        det = normal[:, 0] * following[:, 1] - normal[:, 1] * following[:, 0]
        north = (h * following[:, 1] - h_next * normal[:, 1]) / det
        east = (h_next * normal[:, 0] - h * following[:, 0]) / det
        corners = np.column_stack((north, east))
        return np.vstack((corners, corners[:1]))


def tube(tracks: Tracks, now: Instant, until_age_s: FloatArray | float) -> ReachableSets:
    """Everything each ship can cover while its report's age runs from now's to `until_age_s` ((n,) or one).

    This is O_[t0, t, t0 + T] of eq. (4) with `until_age_s` = T.  Where T has passed it is the set now.
    """
    return _sets(tracks, now, until_age_s)


def at(tracks: Tracks, now: Instant, ahead_s: float = 0.0) -> ReachableSets:
    """Where each ship can be at `now + ahead_s`."""
    return _sets(tracks, after(now, ahead_s), 0.0)


def _sets(tracks: Tracks, now: Instant, until_age_s: FloatArray | float) -> ReachableSets:
    age = tracks.age_s(now)
    until = np.maximum(age, until_age_s)
    near, far = motion_radii(tracks.sog_mps, age, until, tracks.speed_noise_mps)
    length, _ = hull_corners(tracks)
    is_disc = (tracks.model == Model.DISC) | (age > tracks.validity_s)
    disc = tracks.disc_speed_mps * until + length.max(axis=0, initial=0.0) + tracks.position_error_m
    return ReachableSets(tracks, straight_arcs(tracks), near, far, is_disc, disc)
