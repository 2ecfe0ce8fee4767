"""The sets of contacts that `Arcs` describe: one convex set each."""

from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray
from companion.reach.arcs import Arcs
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel

CHUNK = 8000  # points at once, so that the kernel's arrays stay in cache
ROUNDING = 1e-14  # a direction on a breakpoint belongs to both its pieces


@dataclass(frozen=True, slots=True)
class ArcSets:
    """See `interface.Sets`; r1 and r2 are the lengths of `arcs`' docstring."""

    arcs: Arcs
    r1_m: FloatArray  # (n,)
    r2_m: FloatArray
    kernel: Kernel

    def distances(self, north_m: FloatArray, east_m: FloatArray, contact: int | None = None) -> Distances:
        """One point per contact (n,), or many points (m,) for one contact."""
        if contact is None:
            return self.kernel(self.arcs, self.r1_m, self.r2_m, north_m, east_m)
        one, found = self.arcs.only(contact), np.empty((3, len(north_m)))
        for start in range(0, len(north_m), CHUNK):
            some = slice(start, start + CHUNK)
            r1, r2 = np.full((2, len(north_m[some])), ((self.r1_m[contact],), (self.r2_m[contact],)))
            found[:, some] = self.kernel(one, r1, r2, north_m[some], east_m[some])
        return found[0], found[1], found[2]

    def support(self, angle_rad: FloatArray, contact: int | None = None) -> FloatArray:
        """(n, k) support in the directions (k,); (1, k) for one contact."""
        if contact is not None:
            one = slice(contact, contact + 1)
            alone = ArcSets(self.arcs.only(contact), self.r1_m[one], self.r2_m[one], self.kernel)
            return alone.support(angle_rad)
        n_north, n_east = self.arcs.north[:, :, None], self.arcs.east[:, :, None]
        cos, sin = np.cos(angle_rad), np.sin(angle_rad)
        along = n_north * cos + n_east * sin  # cosine and sine of the angle past each breakpoint
        past = n_north * sin - n_east * cos
        cos_width, sin_width = self.arcs.cos_width[:, :, None], self.arcs.sin_width[:, :, None]
        to_next = sin_width * along - cos_width * past
        on_piece = (past >= -ROUNDING) & (to_next >= -ROUNDING) & (along >= cos_width - 1e-6)
        table = self.arcs.table.reshape(14, *self.arcs.north.shape)
        centre = table[3] + self.r1_m * table[7] + self.r2_m * table[11]
        radius = table[5] + self.r1_m * table[9] + self.r2_m * table[13]
        out = self.arcs.support_at(self.r1_m, self.r2_m) - radius
        reach = out[:, :, None] * along + centre[:, :, None] * past + radius[:, :, None]
        return np.asarray(np.where(on_piece, reach, -np.inf).max(axis=0))
