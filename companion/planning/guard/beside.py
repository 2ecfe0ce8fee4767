"""Beside a verified way out: another one that stays near it is verified too, without asking for any set.

Let every set be farther than the margins plus s(t) from a path at each time t.  A distance changes by no
more than the place does, so a path that at each time is nearer than s(t) to the first is clear of the
same sets by the same margins.  Both are straight between their grid points, so the distance between
them is greatest at one of these.
"""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray
from companion.planning.guard.way_out import WayOut

MOST_M = 30.0  # room beyond this is not looked for


@dataclass(frozen=True, slots=True)
class Beside:
    """A way out verified in full, and the room it has beyond the margins.

    `at_m` (T,) is what may be used at each of its grid points, `between_m` (T,) from each to the next, the
    last one for ever.  Nothing follows after `until`: other bounds count then.
    """

    way_out: WayOut
    at_m: FloatArray
    between_m: FloatArray
    until: Instant

    @classmethod
    def of(cls, way_out: WayOut, room_m: FloatArray, until: Instant) -> "Beside":
        """`room_m` (T,) around each grid point; the last one also while it stays."""
        room = np.minimum(room_m, MOST_M)
        between = np.append(np.minimum(room[:-1], room[1:]), room[-1])
        at = np.minimum(between, np.concatenate((between[:1], between[:-1])))
        return cls(way_out, at, between, until)

    def covers(self, other: WayOut) -> bool:
        """Whether `other`, begun later, is verified by this one."""
        mine = self.way_out
        begun_s = elapsed_s(mine.begin, other.begin)
        if other.begin > self.until or begun_s >= mine.t_s[-1]:
            return False
        t = other.t_s + begun_s
        north = np.interp(t, mine.t_s, mine.north_m) - other.north_m
        east = np.interp(t, mine.t_s, mine.east_m) - other.east_m
        off = np.hypot(north, east)
        if (off >= self.between_m[np.searchsorted(mine.t_s, t, side="right") - 1]).any():
            return False
        later = mine.t_s > begun_s
        north = np.interp(mine.t_s[later], t, other.north_m) - mine.north_m[later]
        east = np.interp(mine.t_s[later], t, other.east_m) - mine.east_m[later]
        return not bool((np.hypot(north, east) >= self.at_m[later]).any())
