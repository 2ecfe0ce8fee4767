"""Where the sets are from here, and how they push."""

from dataclasses import dataclass

from companion.messages.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest point of each of n sets to one position.

    `distance_m` (n,) is negative inside the set (minus the depth of penetration).  `away` (n, 2)
    is the unit gradient of the distance: it points from the set to the position.
    """

    distance_m: FloatArray
    away: FloatArray

    def point_m(self, position_m: FloatArray) -> FloatArray:
        """(n, 2) the nearest boundary points, for a position (2,)."""
        return position_m - self.distance_m[:, None] * self.away


@dataclass(frozen=True, slots=True)
class Repulsion:
    """Each contact's repulsion on the vehicle: -grad U_rep, eq. (8) of the paper.

    `velocity` (n, 2) points away from the ship.  `from_network` (n,) is False where the exact
    field answered because the contact is outside the network's range.
    """

    nearest: Nearest
    velocity: FloatArray
    from_network: BoolArray
