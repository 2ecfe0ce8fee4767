"""WGS84 to and from a local north-east frame: the only place with axis conventions.

The frame is the tangent plane at an origin; pymap3d does the geodesy.  Horizontal coordinates
only: depths travel beside them.  At 50 km from the origin the tangent plane shortens distances
by about 0.5 m; `MAX_RANGE_M` keeps goals and start well inside that.
"""

import math
from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

MAX_RANGE_M = 100_000.0
FloatArray = NDArray[np.float64]
_WGS84 = pymap3d.Ellipsoid.from_name("wgs84")  # made once: pymap3d would make it at every call


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """The tangent plane at an origin, axes north and east, metres."""

    latitude_deg: float
    longitude_deg: float

    def to_local(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """North and east in metres."""
        east, north, _ = pymap3d.geodetic2enu(
            latitude_deg, longitude_deg, 0.0, self.latitude_deg, self.longitude_deg, 0.0, _WGS84
        )
        return float(north), float(east)

    def to_local_many(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The same for many points (n,)."""
        east, north, _ = pymap3d.geodetic2enu(
            latitude_deg, longitude_deg, 0.0, self.latitude_deg, self.longitude_deg, 0.0, _WGS84
        )
        return np.asarray(north), np.asarray(east)

    def to_geodetic(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude in degrees of a point on the sea's surface."""
        # the tangent plane lies above the ellipsoid: lower the point onto it first
        down = (north_m**2 + east_m**2) / (2 * 6_371_000.0)
        lat, lon, _ = pymap3d.enu2geodetic(
            east_m, north_m, -down, self.latitude_deg, self.longitude_deg, 0.0, _WGS84
        )
        return float(lat), float(lon)


def wrap_pi(angle_rad: float) -> float:
    """The same direction in (-pi, pi]."""
    return math.pi - (math.pi - angle_rad) % (2 * math.pi)
