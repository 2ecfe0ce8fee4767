"""The water that matters: ships whose whole set is certainly outside are left out of the tracks.

A ship farther from the frame's origin than `geodesy.MAX_RANGE_M` is kept in the picture, but gets
no row until the instant at which, at its top speed, it could have come within that range.
"""

import math

import numpy as np

from companion.geodesy import MAX_RANGE_M
from companion.instant import NS_PER_S, Instant
from companion.messages import FloatArray, IntArray

ALWAYS = Instant(-(2**62))
_MEAN_RADIUS_M = 6_371_008.8
_EQUATOR_M, _E2 = 6_378_137.0, 6.694379990141e-3  # WGS84
_FLAT, _RADIANS = 1.0 - _E2, math.pi / 180
_SPHERE_ERROR = 0.006  # the great circle on a sphere is off by up to 0.56 % of the ellipsoid's


def distance_m(
    latitude_deg: float, longitude_deg: float, other_lat_deg: float, other_lon_deg: float
) -> float:
    """Great-circle distance on a sphere, any two points of the globe; 0.6 % off at most."""
    lat, other = math.radians(latitude_deg), math.radians(other_lat_deg)
    half_north = math.sin((other - lat) / 2)
    half_east = math.sin(math.radians(other_lon_deg - longitude_deg) / 2)
    h = half_north**2 + math.cos(lat) * math.cos(other) * half_east**2
    return 2 * _MEAN_RADIUS_M * math.asin(min(1.0, math.sqrt(h)))


def entries_ns(
    origin_deg: tuple[float, float],
    latitude_deg: FloatArray,
    longitude_deg: FloatArray,
    measured_at_ns: IntArray,
    size_m: FloatArray,
    top_speed_mps: FloatArray,
) -> IntArray:
    """(n,) the first instant at which each ship can touch the area around `origin_deg`.

    `ALWAYS` where it may have been there from the start.  The places (n,) are those when
    measured; `size_m` is whatever its set has beside the motion: hull and position error.
    """
    lat, other = math.radians(origin_deg[0]), np.radians(latitude_deg)
    half_east = np.sin(np.radians(longitude_deg - origin_deg[1]) / 2)
    h = np.sin((other - lat) / 2) ** 2 + math.cos(lat) * np.cos(other) * half_east**2
    range_m = 2 * _MEAN_RADIUS_M * np.arcsin(np.minimum(np.sqrt(h), 1.0))
    to_go_m = range_m * (1 - _SPHERE_ERROR) - size_m - MAX_RANGE_M
    way_ns = np.rint(np.maximum(to_go_m, 0.0) / top_speed_mps * NS_PER_S).astype(np.int64)
    return np.where(to_go_m > 0.0, measured_at_ns + way_ns, ALWAYS)


def offset_m(
    latitude_deg: float, longitude_deg: float, to_lat_deg: float, to_lon_deg: float
) -> tuple[float, float]:
    """North and east metres from one place to another, by the ellipsoid's radii at the first.

    0.02 % off within 10 km outside the polar regions; the nearer way around the globe.
    """
    sin = math.sin(latitude_deg * _RADIANS)
    w2 = 1.0 - _E2 * (sin * sin)
    across = _EQUATOR_M / math.sqrt(w2)
    east_deg = (to_lon_deg - longitude_deg + 180.0) % 360.0 - 180.0
    mid = math.cos((latitude_deg + to_lat_deg) / 2 * _RADIANS)
    return (
        (to_lat_deg - latitude_deg) * _RADIANS * across * _FLAT / w2,
        east_deg * _RADIANS * across * mid,
    )
