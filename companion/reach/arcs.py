"""Convex sets bounded by straight edges and circular arcs: exact distance and nearest point.

Sort the outward normals of such a set by angle.  Between two neighbouring breakpoints b_j and
b_j+1 the boundary point with normal n is c_j + R_j n: an arc, or a corner where R_j = 0; at a
breakpoint the boundary may run straight along the tangent.  Minkowski sums keep the form: the
breakpoints are merged, centres and radii are added.

Centres and radii may depend on two numbers per set (distances run so far), x = x0 + r1 x1 + r2 x2;
the normals may not.  So one `Arcs` serves every instant.  Complex numbers are points, north + i east.

Signed distance:  d(p) = max over unit n of  n . p - h(n),  h(n) = n . c_j + R_j.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.messages import FloatArray, IntArray

ComplexArray = NDArray[np.complex128]

NARROW_RAD = 1e-13


@dataclass(frozen=True, slots=True)
class Arcs:
    """n sets with J breakpoints each; every array is (J, n), normals by ascending angle.

    Breakpoint j stands at the start of piece j.  Neighbouring normals are less than pi apart.
    Repeated breakpoints pad sets with fewer; `before` is the flat index of the piece that ends at
    a breakpoint, `end` that of the breakpoint where a piece ends.
    """

    normal: ComplexArray
    centre: tuple[ComplexArray, ComplexArray, ComplexArray]  # of r1^0, r1, r2
    radius: tuple[FloatArray, FloatArray, FloatArray]
    before: IntArray
    end: IntArray
    normal_north: FloatArray  # contiguous copies for the first, widest pass
    normal_east: FloatArray
    support: tuple[FloatArray, FloatArray, FloatArray]  # h at the breakpoints

    def support_at(self, r1: FloatArray, r2: FloatArray) -> FloatArray:
        """(J, n) h at the breakpoints."""
        return self.support[0] + r1 * self.support[1] + r2 * self.support[2]

    def nearest(
        self, r1: FloatArray, r2: FloatArray, support: FloatArray, position: ComplexArray
    ) -> tuple[FloatArray, ComplexArray]:
        """Signed distance (m,) and unit gradient (m,) for one position (m,) per set.

        r1, r2 are (m,) and `support` is `support_at(r1, r2)`; m = n, or n = 1 and any m.
        """
        columns = self.normal.shape[1]
        column = np.arange(columns) if columns > 1 else np.zeros(len(position), dtype=np.int64)
        over = self.normal_north * position.real + self.normal_east * position.imag - support
        best = over.argmax(axis=0)
        edge = over[best, np.arange(len(position))]
        # outside of all tangent lines the nearest point lies on the best edge or beside it
        after = best * columns + column
        before = self.before.take(after)
        normal = self.normal.take(after)
        from_after = position - self._centre(after, r1, r2)
        from_before = position - self._centre(before, r1, r2)
        is_after = (from_after * normal.conj()).imag > 0
        is_before = (from_before * normal.conj()).imag < 0
        piece = np.where(is_before, before, after)
        offset = np.where(is_before, from_before, from_after)
        length = np.abs(offset)
        on_piece = (is_after | is_before) & (length > 0)
        distance = np.where(on_piece, length - self._radius(piece, r1, r2), edge)
        away = np.where(on_piece, offset / np.where(on_piece, length, 1.0), normal)
        within = np.flatnonzero(edge <= 0)
        if within.size:
            distance[within], away[within] = self._nearest_within(
                column[within], r1[within], r2[within], over[:, within], position[within]
            )
        return distance, away

    def _nearest_within(
        self, column: IntArray, r1: FloatArray, r2: FloatArray, over: FloatArray, position: ComplexArray
    ) -> tuple[FloatArray, ComplexArray]:
        """The same inside all tangent lines: the shallowest edge, or an arc met radially."""
        columns = self.normal.shape[1]
        flat = np.arange(len(self.normal))[:, None] * columns + column
        offset = position - self._centre(flat, r1, r2)
        start, end = self.normal.take(flat), self.normal.take(self.end.take(flat))
        length = np.abs(offset)
        met = ((offset * start.conj()).imag >= 0) & ((offset * end.conj()).imag <= 0) & (length > 0)
        met &= (end * start.conj()).imag > 0
        radial = np.where(met, length - self._radius(flat, r1, r2), -np.inf)
        rows = np.arange(len(position))
        edge, arc = over.argmax(axis=0), radial.argmax(axis=0)
        is_arc = radial[arc, rows] > over[edge, rows]
        distance = np.where(is_arc, radial[arc, rows], over[edge, rows])
        away = np.where(
            is_arc, offset[arc, rows] / np.where(is_arc, length[arc, rows], 1.0), self.normal[edge, column]
        )
        return distance, away

    def _centre(self, flat: IntArray, r1: FloatArray, r2: FloatArray) -> ComplexArray:
        c0, c1, c2 = self.centre
        return c0.take(flat) + r1 * c1.take(flat) + r2 * c2.take(flat)

    def _radius(self, flat: IntArray, r1: FloatArray, r2: FloatArray) -> FloatArray:
        q0, q1, q2 = self.radius
        return q0.take(flat) + r1 * q1.take(flat) + r2 * q2.take(flat)


def arcs_from_candidates(
    angle_rad: FloatArray,
    kind: IntArray,
    centre: tuple[ComplexArray, ComplexArray, ComplexArray],
    radius: tuple[FloatArray, FloatArray, FloatArray],
) -> Arcs:
    """Keep of sorted candidate breakpoints (L, n) those where the piece changes.

    `angle_rad` ascends along axis 0; row j of `kind`, `centre`, `radius` describes the piece from
    candidate j to candidate j + 1; equal neighbouring `kind` are one piece.
    """
    n = angle_rad.shape[1]
    row = np.arange(len(angle_rad))[:, None]
    width = np.diff(angle_rad, axis=0, append=angle_rad[:1] + 2 * np.pi)
    # a piece as narrow as rounding is none: the one before it goes on
    filled = np.maximum.accumulate(np.where(width > NARROW_RAD, row, -1), axis=0)
    kind = np.take_along_axis(kind, np.where(filled < 0, filled[-1], filled), axis=0)
    real = kind != np.roll(kind, 1, axis=0)
    count = np.maximum(real.sum(axis=0), 1)
    most = int(count.max(initial=1))
    order = np.argsort(~real, axis=0, kind="stable")[:most]
    slot = np.minimum(np.arange(most)[:, None], count - 1)  # padding repeats the last
    kept = np.take_along_axis(order, slot, axis=0)

    def keep(values: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.take_along_axis(np.broadcast_to(values, angle_rad.shape), kept, axis=0)

    normal = np.exp(1j * np.take_along_axis(angle_rad, kept, axis=0))
    centres = (keep(centre[0]), keep(centre[1]), keep(centre[2]))
    radii = tuple(np.ascontiguousarray(keep(r.astype(np.complex128)).real) for r in radius)
    columns = np.arange(n)
    return Arcs(
        normal=normal,
        centre=centres,
        radius=(radii[0], radii[1], radii[2]),
        before=np.mod(slot - 1, count) * n + columns,
        end=np.mod(slot + 1, count) * n + columns,
        normal_north=np.ascontiguousarray(normal.real),
        normal_east=np.ascontiguousarray(normal.imag),
        support=(
            (centres[0] * normal.conj()).real + radii[0],
            (centres[1] * normal.conj()).real + radii[1],
            (centres[2] * normal.conj()).real + radii[2],
        ),
    )
