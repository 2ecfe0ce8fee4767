"""Convex sets bounded by straight edges and circular arcs: exact distance and nearest point.

Sort the outward normals of such a set by angle.  From one breakpoint normal n_j to the next the
boundary point is c_j + R_j n: an arc, or a corner where R_j = 0; at a breakpoint the boundary may run
straight along the tangent.  Minkowski sums keep the form: breakpoints are merged, centres and radii
added.  With the support h(n) = n . c_j + R_j the signed distance of a point p is

    d(p) = max over unit n of  n . p - h(n)                     negative inside

Outside, that function of n has one maximum, so the best breakpoint is next to it.  Centres and radii
may depend on two lengths per set, x = x0 + r1 x1 + r2 x2; the normals may not.  So one `Arcs` serves
every instant.  Points are relative to each set's own origin.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.messages import FloatArray, IntArray

ComplexArray = NDArray[np.complex128]
Affine = tuple[FloatArray, FloatArray, FloatArray]  # of 1, r1, r2
Points = tuple[ComplexArray, ComplexArray, ComplexArray]  # north + i east; of 1, r1, r2


@dataclass(frozen=True, slots=True)
class Arcs:
    """n sets with J breakpoints each, flattened (J, n); neighbouring normals less than pi apart.

    `table` (14, J n) has for every breakpoint what the last step needs: the normal (2), and then for
    1, r1 and r2 in turn the tangential coordinates of the centres of the pieces before and after it
    and the radii of both.
    """

    north: FloatArray  # (J, n) normals
    east: FloatArray
    support: Affine  # (J, n) each: h at the breakpoints
    table: FloatArray
    cos_width: FloatArray  # (J, n) of the angle to the next breakpoint
    sin_width: FloatArray
    column: IntArray  # (n,) 0, 1, ...
    packed: tuple[FloatArray, FloatArray]  # the same set by set, for the compiled kernel

    def support_at(self, r1: FloatArray, r2: FloatArray) -> FloatArray:
        """(J, m) h at the breakpoints for r1, r2 (m,); m = n, or n = 1 and any m."""
        h0, h1, h2 = self.support
        return h0 + r1 * h1 + r2 * h2

    def take(self, rows: IntArray, packed: bool) -> "Arcs":
        """The sets of rows (m,), in that order, repeated or not; `packed`: for the compiled kernel too."""
        h0, h1, h2 = self.support
        table = self.table.reshape(len(self.table), *self.north.shape)[:, :, rows]
        return Arcs(
            north=self.north[:, rows],
            east=self.east[:, rows],
            support=(h0[:, rows], h1[:, rows], h2[:, rows]),
            table=table.reshape(len(self.table), -1),
            cos_width=self.cos_width[:, rows],
            sin_width=self.sin_width[:, rows],
            column=np.arange(len(rows)),
            packed=(self.packed[0][rows], self.packed[1][rows]) if packed else self.packed,
        )

    def only(self, i: int) -> "Arcs":
        """The single set i."""
        h0, h1, h2 = self.support
        one = slice(i, i + 1)
        return Arcs(
            north=self.north[:, one],
            east=self.east[:, one],
            support=(h0[:, one], h1[:, one], h2[:, one]),
            table=np.ascontiguousarray(self.table.reshape(len(self.table), *self.north.shape)[:, :, i]),
            cos_width=self.cos_width[:, one],
            sin_width=self.sin_width[:, one],
            column=np.zeros(1, dtype=np.int64),
            packed=(self.packed[0][one], self.packed[1][one]),
        )


def arcs(
    angle_rad: FloatArray, width_rad: FloatArray, centre: Points, radius: Affine, before: IntArray
) -> Arcs:
    """Sets from the angles (J, n) of their breakpoints and the pieces that start there.

    `width_rad` is the angle to the next breakpoint, `before` (J, n) the flat index of the piece that
    ends at a breakpoint.  Sets with fewer breakpoints repeat one of theirs.
    """
    normal = np.exp(1j * angle_rad)
    tangent = normal.conj()
    turned = [tangent * c for c in centre]  # real: along the normal, imaginary: along the tangent
    ended = [(tangent * c.take(before)).imag for c in centre]
    rows = [normal.real, normal.imag]
    for k in range(3):
        rows += [ended[k], turned[k].imag, radius[k].take(before), radius[k]]
    table = np.stack(rows)
    support = (turned[0].real + radius[0], turned[1].real + radius[1], turned[2].real + radius[2])
    widths = np.cos(width_rad), np.sin(width_rad)
    north, east = np.ascontiguousarray(normal.real), np.ascontiguousarray(normal.imag)
    return Arcs(
        north=north,
        east=east,
        support=support,
        table=table.reshape(len(rows), -1),
        cos_width=widths[0],
        sin_width=widths[1],
        column=np.arange(angle_rad.shape[1]),
        packed=(
            np.ascontiguousarray(np.stack((north, east, *support)).transpose(2, 1, 0)),
            np.ascontiguousarray(np.concatenate((table, np.stack(widths))).transpose(2, 1, 0)),
        ),
    )
