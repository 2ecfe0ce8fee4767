"""The worst case: a ship that may do anything up to a speed is within a disc around its report.

radius = disc_speed * age  +  the farthest point of its hull, which may lie any way  +  position error
"""

from dataclasses import dataclass

import numpy as np

from companion.messages import FloatArray, Tracks
from companion.reach.hull import Corners
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel


@dataclass(frozen=True, slots=True)
class DiscShapes:
    """What of the discs does not change with time."""

    speed_mps: FloatArray
    margin_m: FloatArray

    def between(self, age_s: FloatArray, until_s: FloatArray) -> "DiscSets":  # noqa: ARG002 - it only grows
        """The discs at the end, which contain all before."""
        return DiscSets(self.speed_mps * until_s + self.margin_m)


@dataclass(frozen=True, slots=True)
class DiscSets:
    """Discs around the reported positions.  See `interface.Sets`."""

    radius_m: FloatArray

    def distances(self, north_m: FloatArray, east_m: FloatArray, contact: int | None = None) -> Distances:
        """At the very centre every direction leads out; north is as good as any."""
        radius = self.radius_m if contact is None else self.radius_m[contact]
        length = np.sqrt(north_m * north_m + east_m * east_m)
        off_centre = length > 0
        scale = 1.0 / np.where(off_centre, length, 1.0)
        return length - radius, np.where(off_centre, north_m * scale, 1.0), east_m * scale

    def support(self, angle_rad: FloatArray, contact: int | None = None) -> FloatArray:
        """The radius, whatever the direction."""
        radius = self.radius_m if contact is None else self.radius_m[contact : contact + 1]
        return np.repeat(radius[:, None], len(angle_rad), axis=1)


def disc_shapes(tracks: Tracks, kernel: Kernel) -> DiscShapes:  # noqa: ARG001 - every model is asked the same way
    """What a contact's report says about its disc."""
    hull = Corners.of(tracks).length_m.max(axis=0, initial=0.0)
    return DiscShapes(tracks.disc_speed_mps, hull + tracks.position_error_m)
