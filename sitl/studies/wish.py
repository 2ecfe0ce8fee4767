"""What a planner is to the studies."""

from dataclasses import dataclass
from typing import Protocol

from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Wish:
    """What the planner wants of m vehicles: `velocity_mps` (m, 2); `steered` (m,): did a ship matter?"""

    velocity_mps: FloatArray
    steered: BoolArray


class Planner(Protocol):
    """Made for one table of ships, equally many rows a vehicle."""

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:
        """The velocity wanted of every vehicle at `position_m` (m, 2), moving at `velocity_mps` (m, 2)."""
        ...

    def only(self, vehicles: IntArray) -> "Planner":
        """The same for some of the vehicles."""
        ...
