"""The exact repulsive field of the paper, from exact reachable sets.

    U_rep = K_r/2 (1 / (d - delta))^2                         eq. (8), d the distance to the tube, eq. (7)
    repulsion = -grad U_rep = K_r / (d - delta)^3 * away      one term of the sum in eq. (10)

`away` is grad d: the repulsion points from the ship to the vehicle (eq. (14) of the paper carries the
opposite sign; this project has one).  Beyond delta the formula is used as it stands.  At d = delta it
is infinite and inside it would *attract*, so from `SINGULAR_GAP_M` outside delta inward, the inside of
the set included, the push is outward with the formula's value at that gap.  That is saturation: the
field is no guarantee there, the guard is.
"""

import numpy as np

from companion.config import Field
from companion.instant import Instant
from companion.messages import FloatArray, Nearest, Repulsion, Tracks
from companion.reach import tube
from companion.reach.kernel import Kernel, nearest

SINGULAR_GAP_M = 1.0


def repulsion_strength(
    distance_m: FloatArray, k_r: float, delta_m: float, singular_gap_m: float = SINGULAR_GAP_M
) -> FloatArray:
    """K_r / (d - delta)^3, saturated at d - delta = `singular_gap_m`."""
    gap = np.maximum(distance_m - delta_m, singular_gap_m)
    return np.asarray(k_r / (gap * gap * gap), dtype=np.float64)


class ExactRepulsion:
    """Repulsion from the exact tubes; a function of its arguments and the field's constants."""

    def __init__(
        self, field: Field, kernel: Kernel = nearest, singular_gap_m: float = SINGULAR_GAP_M
    ) -> None:
        self._field = field
        self._kernel = kernel
        self._singular_gap_m = singular_gap_m

    def __call__(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray | float, position_m: FloatArray
    ) -> Repulsion:
        """Repulsion of every contact's tube [age, `until_age_s`] on a position (2,), or one each (n, 2)."""
        return self.from_nearest(tube(tracks, now, until_age_s, self._kernel).nearest(position_m))

    def from_nearest(self, nearest: Nearest) -> Repulsion:
        """The same from distances already known."""
        field = self._field
        strength = repulsion_strength(nearest.distance_m, field.k_r, field.delta_m, self._singular_gap_m)
        return Repulsion(nearest, strength[:, None] * nearest.away, np.zeros(len(strength), dtype=np.bool_))
