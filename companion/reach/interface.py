"""What an obstacle model is: two small steps, so that what only a new report changes is done once.

    model.shapes(tracks)                  once per report      ->  Shapes
    shapes.between(age_s, until_s)        once per instant     ->  Sets
    sets.distances / sets.support         once per question

`docs/obstacle_models.md` shows how to add one.
"""

from typing import Protocol

from companion.messages import FloatArray

Distances = tuple[FloatArray, FloatArray, FloatArray]  # distance, and the unit gradient's north and east


class Sets(Protocol):
    """The sets of n contacts at one instant or over one interval, each around its reported position."""

    def distances(self, north_m: FloatArray, east_m: FloatArray, contact: int | None = None) -> Distances:
        """Signed distances and directions to points relative to the reported position.

        One point for every contact, all (n,); or with `contact` many points (m,) for that one.
        """
        ...

    def support(self, angle_rad: FloatArray, contact: int | None = None) -> FloatArray:
        """(n, k) support in the directions (k,), angles from north.

        For one contact (p, k), the supports of the convex parts whose union is its set; p is 1 for
        a convex set.
        """
        ...


class Shapes(Protocol):
    """What of the sets does not change with time."""

    def between(self, age_s: FloatArray, until_s: FloatArray) -> Sets:
        """Everything reachable while the report's age is between `age_s` (n,) and `until_s` (n,)."""
        ...
