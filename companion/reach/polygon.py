"""Convex polygons as a motion of the antenna."""

from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray, IntArray
from companion.reach.arcs import Affine, ComplexArray, Points


@dataclass(frozen=True, slots=True)
class PolygonMotion:
    """Convex polygons by their tangents: `angle` (K, n) ascending within one turn, `corner` (K, n)."""

    angle: FloatArray
    corner: ComplexArray

    @classmethod
    def of_tangents(cls, angle_rad: FloatArray, support: FloatArray) -> "PolygonMotion":
        """From the tangents' angles and supports, neighbours more than 0 and less than pi apart."""
        width = np.diff(angle_rad, axis=0, append=angle_rad[:1] + 2 * np.pi)
        along = (np.roll(support, -1, axis=0) - support * np.cos(width)) / np.sin(width)
        return cls(angle_rad, np.exp(1j * angle_rad) * (support + 1j * along))

    def breaks(self) -> FloatArray:
        """See `hull.Motion`."""
        return self.angle

    def part(self, angle_rad: FloatArray) -> IntArray:
        """See `hull.Motion`: the corner after the tangent before the angle."""
        past = np.remainder(angle_rad - self.angle[0], 2 * np.pi)
        return np.asarray((past[None] >= (self.angle - self.angle[0])[:, None]).sum(axis=0) - 1)

    def pieces(self, part: IntArray) -> tuple[Points, Affine]:
        """See `hull.Motion`."""
        centre = np.take_along_axis(self.corner, part, axis=0)
        still, flat = np.zeros(part.shape, dtype=np.complex128), np.zeros(part.shape)
        return (centre, still, still), (flat, flat, flat)
