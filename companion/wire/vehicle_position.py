"""Where the vehicle says it is, out of several MAVLink messages.

GLOBAL_POSITION_INT has it all: latitude, longitude, height over home, velocity and heading.
While it comes, LOCAL_POSITION_NED is not needed and not used.  A vehicle that sends only
LOCAL_POSITION_NED is placed by GPS_GLOBAL_ORIGIN; its `z` is taken as the depth, that is, the
origin is taken to be at the surface, as where a vehicle starts.  ATTITUDE's yaw stands in for a
heading that is not available.
"""

import math
from collections import Counter
from typing import Any

from companion.geodesy import MAX_RANGE_M, LocalFrame
from companion.instant import NS_PER_S, Instant
from companion.messages import OwnPosition, Source
from companion.wire import ais_rules

ATTITUDE = 30
LOCAL_POSITION_NED = 32
GLOBAL_POSITION_INT = 33
GPS_GLOBAL_ORIGIN = 49

_FRESH_NS = NS_PER_S
_FULL_TURN_CDEG = 36_000
_DEEPEST_M = 12_000.0


class VehiclePosition:
    """Remembers what one message lacks and another had."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._global_at: Instant | None = None
        self._yaw: tuple[Instant, float] | None = None
        self._origin: LocalFrame | None = None

    def hear(self, message_id: int, field: dict[str, Any], stamp: Instant) -> OwnPosition | None:
        """Take one of the four messages; the position it gives, if it gives one."""
        if message_id == GLOBAL_POSITION_INT:
            return self._global(field, stamp)
        if message_id == LOCAL_POSITION_NED:
            return self._local(field, stamp)
        if message_id == GPS_GLOBAL_ORIGIN:
            place = self._place(field["latitude"], field["longitude"])
            if place is not None:
                self._origin = LocalFrame(*place)
        elif math.isfinite(field["yaw"]):
            self._yaw = stamp, field["yaw"] % math.tau
        return None

    def _global(self, field: dict[str, Any], stamp: Instant) -> OwnPosition | None:
        place = self._place(field["lat"], field["lon"])
        depth_m = -field["relative_alt"] / 1000
        if place is None or not self._is_possible(depth_m):
            return None
        self._global_at = stamp
        heading = math.radians(field["hdg"] / 100) if field["hdg"] < _FULL_TURN_CDEG else None
        return OwnPosition(
            stamp=stamp,
            source=Source.MAVLINK,
            latitude_deg=place[0],
            longitude_deg=place[1],
            depth_m=depth_m,
            velocity_ned_mps=(field["vx"] / 100, field["vy"] / 100, field["vz"] / 100),
            heading_rad=self._yaw_at(stamp) if heading is None else heading,
        )

    def _local(self, field: dict[str, Any], stamp: Instant) -> OwnPosition | None:
        if self._origin is None or _is_fresh(self._global_at, stamp):
            return None
        north, east, depth = field["x"], field["y"], field["z"]
        velocity = (field["vx"], field["vy"], field["vz"])
        is_near = abs(north) <= MAX_RANGE_M and abs(east) <= MAX_RANGE_M  # False for NaN
        if not (is_near and all(map(math.isfinite, velocity))):
            self._counts["mavlink.position_out_of_range"] += 1
            return None
        if not self._is_possible(depth):
            return None
        latitude, longitude = self._origin.to_geodetic(north, east)
        return OwnPosition(stamp, Source.MAVLINK, latitude, longitude, depth, velocity, self._yaw_at(stamp))

    def _place(self, lat: int, lon: int) -> tuple[float, float] | None:
        if lat == 0 and lon == 0:  # sent while there is no fix
            self._counts["mavlink.no_fix"] += 1
            return None
        place = lat * 1e-7, lon * 1e-7
        if not ais_rules.is_position(*place):
            self._counts["mavlink.position_out_of_range"] += 1
            return None
        return place

    def _is_possible(self, depth_m: float) -> bool:
        if not abs(depth_m) <= _DEEPEST_M:  # also True for NaN
            self._counts["mavlink.position_out_of_range"] += 1
            return False
        return True

    def _yaw_at(self, stamp: Instant) -> float | None:
        return self._yaw[1] if self._yaw and _is_fresh(self._yaw[0], stamp) else None


def _is_fresh(since: Instant | None, now: Instant) -> bool:
    return since is not None and 0 <= now - since <= _FRESH_NS
