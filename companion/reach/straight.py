"""The paper's ship, exact: bounded speed and course noise, hull, position error.

    position(tau) = o0 + integral of (v + w_v)(cos(th + w_th), sin(th + w_th))      |w_v|, |w_th| bounded

    set = { the antenna's motion } + { the hull, turned by its heading error } + { disc of position error }

The antenna's motion is hull(t conv V, T conv V), V the sector of velocities (Aumann): exact for noise
that varies at every instant.  It is the hull of two arcs around o0: one ahead with radius
r2 = T (v + w_v), and astern the corners at r1 = t (v - w_v), or where v < w_v, since the ship may then
drift astern, an arc of radius -r1, r1 = T (v - w_v).  The hull is the hull of four arcs around the
antenna, one per corner.  Both keep their normals while time passes; only r1 and r2 grow.
"""

from dataclasses import dataclass

import numpy as np

from companion.messages import BoolArray, FloatArray, IntArray, Tracks
from companion.reach.arcs import Arcs, ComplexArray, arcs
from companion.reach.interface import Distances
from companion.reach.kernel import nearest
from companion.reach.support import known_turn, support_hull, support_motion

NARROW_RAD = 1e-13  # a piece as narrow as rounding is none
PAIRS = np.array(((0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)))
# parts of the motion's boundary, clockwise from the stern
ASTERN, PORT_NEAR, PORT_FAR, AHEAD, STARBOARD_FAR, STARBOARD_NEAR = range(6)


@dataclass(frozen=True, slots=True)
class StraightShapes:
    """The sets of straight contacts but for the distances run."""

    tracks: Tracks
    arcs: Arcs
    slow_mps: FloatArray  # least and greatest speed along a ray; negative is astern
    fast_mps: FloatArray

    def between(self, age_s: FloatArray, until_s: FloatArray) -> "StraightSets":
        """The tube from `age_s` to `until_s`."""
        near = np.minimum(age_s * self.slow_mps, until_s * self.slow_mps)
        return StraightSets(self, near, until_s * self.fast_mps)


@dataclass(frozen=True, slots=True)
class StraightSets:
    """Straight contacts' sets; r1 and r2 of the module's docstring in metres."""

    shapes: StraightShapes
    near_m: FloatArray
    far_m: FloatArray

    def distances(self, north_m: FloatArray, east_m: FloatArray) -> Distances:
        """See `interface.Sets`."""
        return nearest(self.shapes.arcs, self.near_m, self.far_m, north_m, east_m)

    def support(self, angle_rad: FloatArray) -> FloatArray:
        """See `interface.Sets`."""
        t = self.shapes.tracks
        course, heading = angle_rad - t.cog_rad[:, None], angle_rad - t.heading_rad[:, None]
        bow, stern, port, starboard, error = (
            x[:, None] for x in (t.bow_m, t.stern_m, t.port_m, t.starboard_m, t.heading_error_rad)
        )
        motion = support_motion(
            self.near_m[:, None], self.far_m[:, None], t.course_noise_rad[:, None], course
        )
        return (
            motion + support_hull(bow, stern, port, starboard, error, heading) + t.position_error_m[:, None]
        )


def straight_shapes(tracks: Tracks) -> StraightShapes:
    """What a straight contact's report says about its set."""
    slow, fast = tracks.sog_mps - tracks.speed_noise_mps, tracks.sog_mps + tracks.speed_noise_mps
    return StraightShapes(tracks, straight_arcs(tracks), slow, fast)


@dataclass(frozen=True, slots=True)
class Motion:
    """Where the antenna's motion changes its boundary: half angles from the course, (n,) each.

    Ahead of `spread` its boundary is the far arc, up to `flank` the far corner, up to `rear` the near
    corner, and beyond, where the ship may drift astern, the near arc.
    """

    course: FloatArray
    spread: FloatArray
    flank: FloatArray
    rear: FloatArray
    drifts: BoolArray

    @classmethod
    def of(cls, tracks: Tracks) -> "Motion":
        """The motion's shape; its size is r1 and r2."""
        slow = tracks.sog_mps - tracks.speed_noise_mps
        fast = tracks.sog_mps + tracks.speed_noise_mps
        spread, drifts = tracks.course_noise_rad, slow < 0
        edge = tangent(
            fast, np.zeros_like(fast), np.maximum(-slow, 0.0), np.full_like(fast, np.pi), spread, 1.0
        )
        flank = np.where(drifts, edge, spread + np.pi / 2)
        rear = np.where(drifts, np.maximum(np.pi - spread, flank), np.pi)
        return cls(tracks.cog_rad, spread, flank, rear, drifts)

    def breaks(self) -> FloatArray:
        """(6, n) angles of its breakpoints."""
        beside = np.stack((-self.rear, -self.flank, -self.spread, self.spread, self.flank, self.rear))
        return self.course + beside

    def part(self, angle_rad: FloatArray) -> IntArray:
        """Which part of the boundary has the support in the directions (L, n)."""
        beside = wrap(angle_rad - self.course)
        off = np.abs(beside)
        from_ahead = (off > self.spread).astype(np.int64) + (off > self.flank) + (off > self.rear)
        return np.where(beside < 0, AHEAD - from_ahead, AHEAD + from_ahead) % 6

    def pieces(self, part: IntArray) -> tuple[ComplexArray, ComplexArray, FloatArray, FloatArray]:
        """Centres per metre of r1 and r2, and radii per metre of r1 and r2, of the parts (J, n)."""
        port = np.exp(1j * (self.course - self.spread))
        starboard = np.exp(1j * (self.course + self.spread))
        # a negative r1 turns a corner to the other side
        port_near, starboard_near = (
            np.where(self.drifts, starboard, port),
            np.where(self.drifts, port, starboard),
        )
        zero = np.zeros_like(port)
        rows = np.arange(len(port))
        near = np.stack((zero, port_near, zero, zero, zero, starboard_near))[part, rows]
        far = np.stack((zero, zero, port, zero, starboard, zero))[part, rows]
        return near, far, np.where(part == ASTERN, -1.0, 0.0), np.where(part == AHEAD, 1.0, 0.0)


def straight_arcs(tracks: Tracks) -> Arcs:
    """The sets of all contacts, to be scaled by r1 and r2 of `support.motion_radii`."""
    motion = Motion.of(tracks)
    length, azimuth = hull_corners(tracks)
    turn = known_turn(tracks.heading_error_rad)
    azimuth = azimuth + tracks.heading_rad
    breaks = np.concatenate((motion.breaks(), _hull_breaks(length, azimuth, turn)))
    angle = np.sort(np.ascontiguousarray(wrap(breaks).T), axis=1).T
    width = np.diff(angle, axis=0, append=angle[:1] + 2 * np.pi)
    middle = angle + 0.5 * width
    part = motion.part(middle)
    beside = wrap(middle - azimuth[:, None])  # (4, L, n)
    corner = (length[:, None] * np.cos(np.maximum(np.abs(beside) - turn, 0.0))).argmax(axis=0)
    off = np.take_along_axis(beside, corner[None], axis=0)[0]
    end = (off > turn).astype(np.int64) - (off < -turn)  # which end of the corner's arc; 0: the arc itself

    slot, count = _changes(part * 12 + corner * 3 + end, width)
    part, corner, end = (np.take_along_axis(x, slot, axis=0) for x in (part, corner, end))
    columns = np.arange(len(tracks))
    near, far, radius_near, radius_far = motion.pieces(part)
    reach, towards = length[corner, columns], azimuth[corner, columns] + end * turn
    centre = np.where(end == 0, 0.0, reach * np.exp(1j * towards))
    radius = np.where(end == 0, reach, 0.0) + tracks.position_error_m
    kept = np.take_along_axis(angle, slot, axis=0)
    last, following = np.arange(len(slot))[:, None] == count - 1, np.roll(kept, -1, axis=0)
    width = np.where(last, kept[0] + 2 * np.pi, following) - kept
    before = np.mod(np.minimum(np.arange(len(slot))[:, None], count - 1) - 1, count) * len(tracks) + columns
    return arcs(kept, width, (centre, near, far), (radius, radius_near, radius_far), before)


def hull_corners(tracks: Tracks) -> tuple[FloatArray, FloatArray]:
    """(4, n) distance from the antenna and azimuth from the heading of the four corners, clockwise."""
    ahead = np.stack((tracks.bow_m, -tracks.stern_m, -tracks.stern_m, tracks.bow_m))
    right = np.stack((tracks.starboard_m, tracks.starboard_m, -tracks.port_m, -tracks.port_m))
    return np.hypot(ahead, right), np.arctan2(right, ahead)


def tangent(
    big: FloatArray,
    at_big: FloatArray,
    small: FloatArray,
    at_small: FloatArray,
    half: FloatArray,
    side: FloatArray | float,
) -> FloatArray:
    """Normal of the edge from an arc's end to a smaller concentric arc; both +-`half` wide.

    From the end of the big arc the edge runs on toward `side` (+1 clockwise).  It touches the small
    circle where that is acos(small / big) further on, or meets the end of the small arc.
    """
    start = at_big + side * half
    ratio = np.divide(small, big, out=np.ones_like(big), where=big > 0)
    touch = np.arccos(np.minimum(ratio, 1.0))
    # angles run from `start` toward `side`, all in [0, 2 pi)
    middle = side * (at_small - start)
    near, far = np.remainder(middle - half, 2 * np.pi), np.remainder(middle + half, 2 * np.pi)
    is_touched = np.remainder(touch - near, 2 * np.pi) <= 2 * half
    run = np.where(far < touch, far, np.where(is_touched, touch, near))
    # the edge in a frame where the big arc ends on the first axis
    out, along = small * np.cos(run) - big, small * np.sin(run)
    return np.asarray(start + side * np.arctan2(-out, along), dtype=np.float64)


def wrap(angle_rad: FloatArray) -> FloatArray:
    """The same directions in [-pi, pi]."""
    return angle_rad - 2 * np.pi * np.rint(angle_rad / (2 * np.pi))


def _hull_breaks(length: FloatArray, azimuth: FloatArray, turn: FloatArray) -> FloatArray:
    """(20, n) every angle where the hull's boundary may change from one piece to another."""
    first, second = PAIRS.T
    swap = length[first] < length[second]
    big, small = (
        np.where(swap, second[:, None], first[:, None]),
        np.where(swap, first[:, None], second[:, None]),
    )
    columns = np.arange(length.shape[1])
    edges = tangent(
        length[big, columns],
        azimuth[big, columns],
        length[small, columns],
        azimuth[small, columns],
        turn,
        np.array((-1.0, 1.0))[:, None, None],
    )
    return np.concatenate((azimuth - turn, azimuth + turn, edges[0], edges[1]))


def _changes(kind: IntArray, width: FloatArray) -> tuple[IntArray, IntArray]:
    """Rows (J, n) of the candidates (L, n) where a new kind of piece begins, and how many (n,) there are.

    Sets with fewer than J repeat their last.
    """
    row = np.arange(len(kind))[:, None]
    wide = np.maximum.accumulate(np.where(width > NARROW_RAD, row, -1), axis=0)
    kind = np.take_along_axis(kind, np.where(wide < 0, wide[-1:], wide), axis=0)
    starts = kind != np.roll(kind, 1, axis=0)
    count = np.maximum(starts.sum(axis=0), 1)
    order = np.argsort(~starts, axis=0, kind="stable")
    most = int(count.max(initial=1))
    slot = np.take_along_axis(order, np.minimum(np.arange(most)[:, None], count - 1), axis=0)
    return slot, count
