"""The set's corners, and the directions in which the distance is bounded, in the north-east frame.

The set is the Minkowski sum of motion, hull and position error.  Its nearest point is one of these, and
each has its direction in the list, so that the best of the list is exact:

    a flank and a corner of the hull             the flank's normal
    a corner of the motion and an edge of the hull    the edge's normal, between two ends or a tangent
    a corner of the motion, or the far arc, and a corner of the hull    the ray carried to that corner
    the same and an arc, which a corner of the hull sweeps    the ray from the motion's corner or centre
    the stern, between the near corners          the grid's direction astern, learned
"""

from dataclasses import dataclass

import numpy as np

from models.layers import grid_angles
from models.support_terms import (
    NOTHING,
    Linear,
    Sum,
    Vector,
    add,
    column,
    polar,
    right,
    scalar,
    scaled,
)

CORNERS = ((1, "bow_m", 1, "starboard_m"), (-1, "stern_m", 1, "starboard_m"),
           (-1, "stern_m", -1, "port_m"), (1, "bow_m", -1, "port_m"))  # fmt: skip
COURSE, NOISE = column("course_rad"), column("course_noise_rad")
HEADING, ERROR = column("heading_rad"), column("heading_error_rad")
AGE, UNTIL = column("age_s"), column("until_age_s")
SLOW = column("speed_mps") + -column("speed_noise_mps")
FAST = column("speed_mps") + column("speed_noise_mps")
FAR: Sum = scalar(UNTIL, FAST)
NEAR: Sum = scalar(AGE, SLOW)
POSITION: Vector = (scalar(column("north_m")), scalar(column("east_m")))


@dataclass(frozen=True, slots=True)
class Motion:
    """Far port, far starboard, near port, near starboard; and where the far arc's end tangents meet."""

    corners: tuple[Vector, ...]
    meeting: Vector

    @classmethod
    def of(cls, course_noise_max_rad: float) -> "Motion":
        """Of every contact."""
        port, starboard = COURSE + -NOISE, COURSE + NOISE
        far = (polar(port, UNTIL, FAST), polar(starboard, UNTIL, FAST))
        near = (polar(port, AGE, SLOW), polar(starboard, AGE, SLOW))
        return cls((*far, *near), _meeting(polar(COURSE, UNTIL, FAST), *far, course_noise_max_rad))


@dataclass(frozen=True, slots=True)
class Hull:
    """Every corner sweeps an arc around the antenna: its ends, and where their tangents meet."""

    one_way: tuple[Vector, ...]  # turned by minus the heading error
    other_way: tuple[Vector, ...]
    meeting: tuple[Vector, ...]

    @classmethod
    def of(cls, heading_error_max_rad: float) -> "Hull":
        """Of every contact."""
        one_way, other_way, amid = (
            tuple(_corner(HEADING + turn, *corner) for corner in CORNERS)
            for turn in (-ERROR, ERROR, Linear())
        )
        meeting = tuple(
            _meeting(m, a, b, heading_error_max_rad) for m, a, b in zip(amid, one_way, other_way, strict=True)
        )
        return cls(one_way, other_way, meeting)

    @property
    def ends(self) -> tuple[Vector, ...]:
        """Of all four arcs."""
        return (*self.one_way, *self.other_way)

    def normals(self) -> list[Vector]:
        """Outward normals of the four edges, of any length."""
        found = []
        for i in range(4):  # an edge runs from here, turned clockwise, to there, turned back
            run = add(self.one_way[(i + 1) % 4], self.other_way[i], -1.0)
            found.append(scaled(right(run), -1.0))
        return found


def normals(motion: Motion, hull: Hull) -> list[Vector]:
    """Of both flanks and of the hull's edges, of any length."""
    port, starboard, *_ = motion.corners
    flanks = (scaled(right(port), -1.0), right(starboard))
    return [*flanks, *hull.normals()]


def tangents(hull: Hull) -> tuple[list[Vector], list[Vector], list[Vector]]:
    """What makes the normals of edges that run from an arc's end to within the next arc, a smaller one.

    With E the end of the greater radius R, toward the smaller r, and E' a quarter turn on from E, the
    edge's normal is  E + sqrt((R^2 - r^2) / r^2) E'.  In the order of `hull.ends`, both parts alike:
    R^2 - r^2, r^2, and E'.  Where r is the greater they make some direction, which does no harm.
    """
    squares = [scalar(column(x), column(x)) + scalar(column(y), column(y)) for _, x, _, y in CORNERS]
    least = scalar(Linear(constant=1e-6))
    differences, smaller, across = [], [], []
    for ends, step in ((hull.one_way, -1), (hull.other_way, 1)):  # the next arc lies that way
        for i, end in enumerate(ends):
            radius, other = squares[i], squares[(i + step) % 4]
            differences.append((radius - other, radius - other))
            smaller.append((other + least, other + least))
            across.append(scaled(right(end), step))
    return differences, smaller, across


def rays(motion: Motion) -> list[Vector]:
    """To the vehicle from the motion's corners and from the far arc's centre."""
    return [add(POSITION, corner, -1.0) for corner in (*motion.corners, NOTHING)]


def grid_directions(count: int) -> list[Vector]:
    """Unit vectors at fixed angles from the course."""
    along = polar(COURSE)
    return [add(scaled(along, np.cos(b)), right(along), np.sin(b)) for b in grid_angles(count)]


def grid_reaches(count: int) -> list[Sum]:
    """What bounds the motion that way: the far end ahead of the beam and on it, the near end abaft."""
    return [FAR if np.cos(b) > -1e-6 else NEAR for b in grid_angles(count)]


def _corner(heading: Linear, fore: float, length: str, side: float, width: str) -> Vector:
    return add(scaled(polar(heading, column(length)), fore), right(polar(heading, column(width))), side)


def _meeting(amid: Vector, one: Vector, other: Vector, most_rad: float) -> Vector:
    """amid / cos(half angle), or a little farther: one + other = 2 cos(half angle) amid.

    1 / cos a <= 1 + (1 - cos a) / cos(most); capped by the arc's radius no support is larger for it.
    """
    least = np.cos(most_rad)
    return add(scaled(amid, 1 + 1 / least), add(one, other), -0.5 / least)
