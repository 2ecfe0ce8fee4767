"""Ships that stray from their straight prediction as recorded ships did: KITE and BOX.

In the course frame (x along the reported course, origin at the reported antenna) the antenna is, at the
report's age s, within a quadrilateral around the predicted point (v s, 0):

    KITE   corners  (v s + ahead, 0), (v s, +-abeam), (v s - astern, 0)
    BOX    corners  (v s + ahead, +-abeam), (v s - astern, +-abeam)

with `ahead`, `astern` and `abeam` from `Tracks.spread_m`, linear between its ages.  Every corner then moves
along straight pieces, so the union over an interval lies in the convex hull of the quadrilaterals at its
ends and at the ages between.  That hull is symmetric about the course; its upper boundary is taken as

    (rear, 0) - (x1, y1) - (x2, y2) - (front, 0)

exact at one instant, and over an interval the least such chain that leaves nothing out.  Hull (its
circumscribed circle: a ship that strays has turned) and position error are a disc on top of it.
"""

from dataclasses import dataclass

import numpy as np

from companion.messages import SPREAD_AGES_S, BoolArray, FloatArray, IntArray, Model, Tracks
from companion.reach.hull import Corners
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel

ROUNDING_M = 1e-9  # an edge this short has no direction
AGES_S = np.array((0.0, *SPREAD_AGES_S))


@dataclass(frozen=True, slots=True)
class SpreadSets:
    """See `interface.Sets`.  The chains' corners in the course frame, (4, n), x and y."""

    course_rad: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    margin_m: FloatArray  # (n,) the disc

    def distances(self, north_m: FloatArray, east_m: FloatArray, contact: int | None = None) -> Distances:
        """One point per contact (n,), or many points (m,) for one contact."""
        one = slice(None) if contact is None else slice(contact, contact + 1)
        cos, sin = np.cos(self.course_rad[one]), np.sin(self.course_rad[one])
        x, side = north_m * cos + east_m * sin, east_m * cos - north_m * sin
        distance, away_x, away_y = _to_chain(self.x_m[:, one], self.y_m[:, one], x, np.abs(side))
        away_y = np.where(side < 0, -away_y, away_y)
        return distance - self.margin_m[one], away_x * cos - away_y * sin, away_x * sin + away_y * cos

    def support(self, angle_rad: FloatArray, contact: int | None = None) -> FloatArray:
        """(n, k) support in the directions (k,); (1, k) for one contact."""
        one = slice(None) if contact is None else slice(contact, contact + 1)
        beside = angle_rad - self.course_rad[one, None]
        along, across = np.cos(beside), np.abs(np.sin(beside))
        reach = self.x_m[:, one, None] * along + self.y_m[:, one, None] * across
        return np.asarray(reach.max(axis=0) + self.margin_m[one, None])


@dataclass(frozen=True, slots=True)
class SpreadShapes:
    """What does not change with time."""

    course_rad: FloatArray
    sog_mps: FloatArray
    spread_m: FloatArray  # (n, 5, 3) at AGES_S
    is_box: BoolArray
    margin_m: FloatArray

    def take(self, rows: IntArray) -> "SpreadShapes":
        """Those of rows (m,), repeated or not."""
        return SpreadShapes(
            self.course_rad[rows],
            self.sog_mps[rows],
            self.spread_m[rows],
            self.is_box[rows],
            self.margin_m[rows],
        )

    def between(self, age_s: FloatArray, until_s: FloatArray) -> SpreadSets:
        """The tube from `age_s` to `until_s`."""
        first, last = self._at(age_s), self._at(until_s)
        ages = AGES_S[:, None]  # (5, n) the stated ages that lie between
        inside = (ages > age_s) & (ages < until_s)
        centre, spread = self.sog_mps * ages, self.spread_m.transpose(1, 2, 0)
        near, far = self.sog_mps * age_s, self.sog_mps * until_s
        rear = np.minimum(near - first[1], far - last[1])
        rear = np.minimum(rear, np.where(inside, centre - spread[:, 1], np.inf).min(axis=0))
        front = np.maximum(near + first[0], far + last[0])
        front = np.maximum(front, np.where(inside, centre + spread[:, 0], -np.inf).max(axis=0))
        # beside the far end as wide as ever; beside the near end just wide enough for what lies between
        wide = np.maximum(np.maximum(first[2], last[2]), np.where(inside, spread[:, 2], 0.0).max(axis=0))
        part = np.where(inside, (ages - age_s) / np.maximum(until_s - age_s, 1e-9), 0.0)
        chord = np.where(inside, (spread[:, 2] - wide * part) / np.maximum(1.0 - part, 1e-9), 0.0)
        narrow = np.maximum(first[2], chord.max(axis=0))
        narrow = np.maximum(narrow, wide * (near - rear) / np.maximum(far - rear, 1e-9))  # keeps it convex
        narrow = np.minimum(narrow, wide)
        x = np.stack((rear, np.where(self.is_box, rear, near), np.where(self.is_box, front, far), front))
        y = np.stack((np.zeros_like(wide), np.where(self.is_box, wide, narrow), wide, np.zeros_like(wide)))
        return SpreadSets(self.course_rad, x, y, self.margin_m)

    def _at(self, age_s: FloatArray) -> FloatArray:
        """(3, n) ahead, astern, abeam at an age of at most the last one."""
        k = np.clip(np.searchsorted(AGES_S, age_s, side="right") - 1, 0, len(AGES_S) - 2)
        part = np.clip((age_s - AGES_S[k]) / (AGES_S[k + 1] - AGES_S[k]), 0.0, 1.0)
        rows = np.arange(len(k))
        low, high = self.spread_m[rows, k], self.spread_m[rows, k + 1]
        return np.asarray((low + part[:, None] * (high - low)).T)


def spread_shapes(tracks: Tracks, _kernel: Kernel) -> SpreadShapes:
    """What a contact's report and its spread say about its set."""
    spread = np.concatenate((np.zeros((len(tracks), 1, 3)), tracks.spread_m), axis=1)
    return SpreadShapes(
        tracks.cog_rad,
        tracks.sog_mps,
        spread,
        tracks.model == Model.BOX,
        Corners.of(tracks).length_m.max(axis=0, initial=0.0) + tracks.position_error_m,
    )


def edge_speed_mps(tracks: Tracks) -> FloatArray:
    """(n,) how fast a corner of the quadrilateral moves at most; nan where a row states no spread."""
    spread = np.concatenate((np.zeros((len(tracks), 1, 3)), tracks.spread_m), axis=1)
    if spread.shape[1] != len(AGES_S):
        return np.full(len(tracks), np.nan)
    rate = np.abs(np.diff(spread, axis=1)) / np.diff(AGES_S)[:, None]
    along = tracks.sog_mps[:, None] + np.maximum(rate[..., 0], rate[..., 1])
    return np.asarray(np.hypot(along, rate[..., 2]).max(axis=1))


def _to_chain(x: FloatArray, y: FloatArray, px: FloatArray, py: FloatArray) -> Distances:
    """Signed distance of points (m,), py >= 0, to the convex sets with the chains (4, n), n = m or 1."""
    dx, dy = np.diff(x, axis=0), np.diff(y, axis=0)
    length = np.hypot(dx, dy)
    safe = np.where(length > 0, length, 1.0)
    ux, uy = dx / safe, dy / safe
    rx, ry = px - x[:-1], py - y[:-1]
    along = np.clip(rx * ux + ry * uy, 0.0, length)
    qx, qy = rx - along * ux, ry - along * uy  # from the nearest point of each edge
    gap = np.hypot(qx, qy)
    # outside of an edge; a chain runs from rear to front with the set on its starboard side
    over = np.where(length > ROUNDING_M, ry * ux - rx * uy, -np.inf)
    points = np.arange(len(px))
    edge, shallowest = gap.argmin(axis=0), over.argmax(axis=0)
    nearest, depth = gap[edge, points], over[shallowest, points]
    inside = (depth <= 0) & np.isfinite(depth)  # a set of one point has no inside
    sets = points % x.shape[1]
    scale = np.where(nearest > 0, nearest, 1.0)
    away_x = np.where(inside, -uy[shallowest, sets], np.where(nearest > 0, qx[edge, points] / scale, 1.0))
    away_y = np.where(inside, ux[shallowest, sets], qy[edge, points] / scale)
    return np.where(inside, depth, nearest), away_x, away_y
