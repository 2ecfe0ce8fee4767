"""What the autopilot says of itself, message by message, and at which rates."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geodesy import LocalFrame
from companion.instant import Instant, after
from sitl.vehicle import VehicleState

_US = 1_000  # ns


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that a telemetry message can be made of.

    `local_m` is the position from the EKF origin (where the vehicle started), `boot_ns` the time
    since boot.
    """

    state: VehicleState
    frame: LocalFrame
    local_m: tuple[float, float]
    boot_ns: int
    utc_ns: int
    heartbeat: mav.MAVLink_heartbeat_message
    has_gnss: bool

    @property
    def boot_ms(self) -> int:
        """Milliseconds since boot, as the messages carry them."""
        return (self.boot_ns // 1_000_000) & 0xFFFFFFFF


Builder = Callable[[Snapshot], mav.MAVLink_message]


def _heartbeat(now: Snapshot) -> mav.MAVLink_message:
    return now.heartbeat


def _system_time(now: Snapshot) -> mav.MAVLink_message:
    return mav.MAVLink_system_time_message(now.utc_ns // _US, now.boot_ms)


def _global_position(now: Snapshot) -> mav.MAVLink_message:
    state = now.state
    latitude, longitude = now.frame.to_geodetic(state.north_m, state.east_m)
    vx, vy, vz = (round(v * 100) for v in state.velocity_ned_mps)
    return mav.MAVLink_global_position_int_message(
        time_boot_ms=now.boot_ms,
        lat=round(latitude * 1e7),
        lon=round(longitude * 1e7),
        alt=round(-state.depth_m * 1000),
        relative_alt=round(-state.depth_m * 1000),
        vx=vx,
        vy=vy,
        vz=vz,
        hdg=round(math.degrees(state.heading_rad) * 100) % 36000,
    )


def _local_position(now: Snapshot) -> mav.MAVLink_message:
    return mav.MAVLink_local_position_ned_message(
        now.boot_ms, *now.local_m, now.state.depth_m, *now.state.velocity_ned_mps
    )


def _attitude(now: Snapshot) -> mav.MAVLink_message:
    state = now.state
    return mav.MAVLink_attitude_message(
        now.boot_ms, state.roll_rad, state.pitch_rad, state.heading_rad, 0.0, 0.0, state.turn_rate_radps
    )


def _gps_raw(now: Snapshot) -> mav.MAVLink_message:
    state = now.state
    latitude, longitude = now.frame.to_geodetic(state.north_m, state.east_m)
    north, east, _ = state.velocity_ned_mps
    return mav.MAVLink_gps_raw_int_message(
        time_usec=now.boot_ns // _US,
        fix_type=mav.GPS_FIX_TYPE_3D_FIX if now.has_gnss else mav.GPS_FIX_TYPE_NO_FIX,
        lat=round(latitude * 1e7) if now.has_gnss else 0,
        lon=round(longitude * 1e7) if now.has_gnss else 0,
        alt=0,
        eph=80 if now.has_gnss else 0xFFFF,
        epv=120 if now.has_gnss else 0xFFFF,
        vel=round(math.hypot(north, east) * 100) if now.has_gnss else 0xFFFF,
        cog=round(math.degrees(math.atan2(east, north)) * 100) % 36000 if now.has_gnss else 0xFFFF,
        satellites_visible=11 if now.has_gnss else 0,
    )


def _origin(now: Snapshot) -> mav.MAVLink_message:
    state, (north, east) = now.state, now.local_m
    latitude, longitude = now.frame.to_geodetic(state.north_m - north, state.east_m - east)
    return mav.MAVLink_gps_global_origin_message(
        round(latitude * 1e7), round(longitude * 1e7), 0, now.boot_ns // _US
    )


def _version(_: Snapshot) -> mav.MAVLink_message:
    capabilities = (
        mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    )
    return mav.MAVLink_autopilot_version_message(
        capabilities, 0, 0, 0, 0, bytes(8), bytes(8), bytes(8), 0, 0, 0
    )


BUILDERS: dict[int, Builder] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: _heartbeat,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: _system_time,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _local_position,
    mav.MAVLINK_MSG_ID_ATTITUDE: _attitude,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: _gps_raw,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: _origin,
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: _version,
}

DEFAULT_RATES_HZ = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10.0,
    mav.MAVLINK_MSG_ID_ATTITUDE: 10.0,
}


class Streams:
    """When each message is due."""

    def __init__(self) -> None:
        self._every_s = {message: 1.0 / rate for message, rate in DEFAULT_RATES_HZ.items()}
        self._due: dict[int, Instant] = {}

    def set(self, message: int, interval_us: float) -> None:
        """SET_MESSAGE_INTERVAL: negative switches off, 0 restores the default."""
        self._due.pop(message, None)
        self._every_s.pop(message, None)
        if interval_us > 0:
            self._every_s[message] = interval_us * 1e-6
        elif interval_us == 0 and message in DEFAULT_RATES_HZ:
            self._every_s[message] = 1.0 / DEFAULT_RATES_HZ[message]

    def interval_us(self, message: int) -> int:
        """As MESSAGE_INTERVAL reports it: -1 when switched off."""
        every = self._every_s.get(message)
        return -1 if every is None else round(every * 1e6)

    def due(self, t: Instant) -> list[int]:
        """The messages to send now; a late caller gets each once, not the arrears."""
        ready = [message for message in self._every_s if self._due.get(message, t) <= t]
        for message in ready:
            next_due = after(self._due.get(message, t), self._every_s[message])
            self._due[message] = next_due if next_due > t else after(t, self._every_s[message])
        return ready
