"""The hull around its antenna, turned by its heading error, added to any motion of the antenna.

A rectangle turned by up to +-e about the antenna sweeps one arc per corner; the hull of the four arcs
is convex and has at most twelve breakpoints.  Its Minkowski sum with a convex motion merges the
breakpoints of both.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from companion.messages import FloatArray, IntArray, Tracks
from companion.reach.arcs import Affine, Arcs, ComplexArray, Points, arcs
from companion.reach.support import known_turn

NARROW_RAD = 1e-9  # a narrower piece is left out: it moves the boundary by length x width^2, 1e-14 m
PAIRS = np.array(((0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)))


class Motion(Protocol):
    """A convex set per contact: where the antenna can be, relative to its reported position."""

    def breaks(self) -> FloatArray:
        """(K, n) angles of its breakpoints, neighbours less than pi apart."""
        ...

    def part(self, angle_rad: FloatArray) -> IntArray:
        """(L, n) which part of the boundary, a number from 0, has the support in these directions."""
        ...

    def pieces(self, part: IntArray) -> tuple[Points, Affine]:
        """Centres and radii (J, n) of the parts: of 1, of r1 and of r2."""
        ...


@dataclass(frozen=True, slots=True)
class Corners:
    """A rectangle's corners (4, n) clockwise from starboard bow, and how far it may be turned (n,)."""

    length_m: FloatArray  # from the antenna
    azimuth_rad: FloatArray  # from north
    turn_rad: FloatArray

    @classmethod
    def of(cls, tracks: Tracks) -> "Corners":
        """The hulls at the time of the report."""
        ahead = np.stack((tracks.bow_m, -tracks.stern_m, -tracks.stern_m, tracks.bow_m))
        right = np.stack((tracks.starboard_m, tracks.starboard_m, -tracks.port_m, -tracks.port_m))
        azimuth = np.arctan2(right, ahead) + tracks.heading_rad
        return cls(np.hypot(ahead, right), azimuth, known_turn(tracks.heading_error_rad))

    def breaks(self) -> FloatArray:
        """(20, n) every angle where the hull's boundary may change from one piece to another."""
        first, second = PAIRS.T
        swap = self.length_m[first] < self.length_m[second]
        big, small = (
            np.where(swap, PAIRS.T[1, :, None], PAIRS.T[0, :, None]),
            np.where(swap, PAIRS.T[0, :, None], PAIRS.T[1, :, None]),
        )
        columns = np.arange(self.length_m.shape[1])
        edges = tangent(
            self.length_m[big, columns],
            self.azimuth_rad[big, columns],
            self.length_m[small, columns],
            self.azimuth_rad[small, columns],
            self.turn_rad,
            np.array((-1.0, 1.0))[:, None, None],
        )
        ends = (self.azimuth_rad - self.turn_rad, self.azimuth_rad + self.turn_rad)
        return np.concatenate((*ends, edges[0], edges[1]))

    def part(self, angle_rad: FloatArray) -> IntArray:
        """(L, n) three times the corner with the support, plus 0, 1 or 2: arc's start, arc, arc's end."""
        beside = wrap(angle_rad - self.azimuth_rad[:, None])  # (4, L, n)
        reach = self.length_m[:, None] * np.cos(np.maximum(np.abs(beside) - self.turn_rad, 0.0))
        corner = reach.argmax(axis=0)
        off = np.take_along_axis(beside, corner[None], axis=0)[0]
        return np.asarray(3 * corner + 1 + (off > self.turn_rad) - (off < -self.turn_rad), dtype=np.int64)

    def pieces(self, part: IntArray) -> tuple[ComplexArray, FloatArray]:
        """Centres and radii (J, n) of the parts."""
        corner, end = part // 3, part % 3 - 1
        columns = np.arange(part.shape[1])
        length = self.length_m[corner, columns]
        towards = self.azimuth_rad[corner, columns] + end * self.turn_rad
        centre: ComplexArray = np.where(end == 0, 0.0, length * np.exp(1j * towards))
        return centre, np.where(end == 0, length, 0.0)


def with_hull(motion: Motion, corners: Corners, margin_m: FloatArray) -> Arcs:
    """The sets { motion } + { hull } + { disc of radius `margin_m` (n,) }."""
    breaks = wrap(np.concatenate((motion.breaks(), corners.breaks())))
    angle = np.ascontiguousarray(np.sort(np.ascontiguousarray(breaks.T), axis=1).T)
    width = np.diff(angle, axis=0, append=angle[:1] + 2 * np.pi)
    middle = angle + 0.5 * width
    part, hull_part = motion.part(middle), corners.part(middle)

    slot, count = _changes(part * 12 + hull_part, width)
    n, row = len(count), np.arange(len(slot))[:, None]
    angle = np.take_along_axis(angle, slot, axis=0)
    width = np.where(row == count - 1, angle[0] + 2 * np.pi, np.roll(angle, -1, axis=0)) - angle
    before = np.mod(np.minimum(row, count - 1) - 1, count) * n + np.arange(n)
    centre, radius = motion.pieces(np.take_along_axis(part, slot, axis=0))
    hull_centre, hull_radius = corners.pieces(np.take_along_axis(hull_part, slot, axis=0))
    return arcs(
        angle,
        width,
        (centre[0] + hull_centre, centre[1], centre[2]),
        (radius[0] + hull_radius + margin_m, radius[1], radius[2]),
        before,
    )


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
