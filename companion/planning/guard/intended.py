"""What the planner means to do, told to the guard, which believes none of it."""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray

MOST = 1e7  # metres, seconds: farther is nonsense


@dataclass(frozen=True, slots=True)
class Intended:
    """The planner's own future: places north and east (K,) metres at `t_s` (K,) seconds after `begin`.

    `velocity_mps` (K, 2), north and east, is wanted from each time to the next.
    """

    begin: Instant
    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    velocity_mps: FloatArray

    @property
    def is_sound(self) -> bool:
        """Whether these are numbers that can be reckoned with, of one length, in the order of time."""
        k = len(self.t_s)
        columns = (self.t_s, self.north_m, self.east_m, self.velocity_mps)
        fits = self.north_m.shape == self.east_m.shape == (k,) and self.velocity_mps.shape == (k, 2)
        small = all((np.abs(column) <= MOST).all() for column in columns)  # what is no number is not small
        return k > 1 and fits and small and bool((np.diff(self.t_s) > 0).all())
