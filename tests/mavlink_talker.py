"""Someone on a MAVLink link, as pymavlink packs it, and our decoder to hear them."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.instant import instant
from companion.messages import (
    ContactReport,
    Frame,
    Heard,
    Link,
    OwnPosition,
)
from companion.wire.ais_vessel import AisQuirk
from companion.wire.mavlink import MavlinkDecoder

SUB = mav.MAV_TYPE_SUBMARINE
ARDUPILOT = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
PX4 = mav.MAV_AUTOPILOT_PX4
ARMED_CUSTOM = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def near(value: float, tolerance: float | None = None) -> Any:
    return pytest.approx(value, abs=tolerance)


class Talker:
    """Someone on the link, as pymavlink packs it."""

    def __init__(self, system: int = 1, component: int = 1) -> None:
        self._packer = mav.MAVLink(None, srcSystem=system, srcComponent=component)

    def say(self, message: Any, *, v1: bool = False) -> bytes:
        data = bytes(message.pack(self._packer, force_mavlink1=v1))
        self._packer.seq = (self._packer.seq + 1) % 256
        return data


def heartbeat(
    vehicle: int = SUB, autopilot: int = ARDUPILOT, custom_mode: int = 4, base_mode: int = ARMED_CUSTOM
) -> Any:
    return mav.MAVLink_heartbeat_message(vehicle, autopilot, base_mode, custom_mode, mav.MAV_STATE_ACTIVE, 3)


def global_position(**changes: int) -> Any:
    values = {"time_boot_ms": 5000, "lat": 597_200_000, "lon": 247_400_000, "alt": -12_000}
    values |= {"relative_alt": -45_500, "vx": 150, "vy": -20, "vz": 5, "hdg": 9_000}
    return mav.MAVLink_global_position_int_message(**(values | changes))


def vessel(**changes: Any) -> Any:
    values: dict[str, Any] = {"MMSI": 244_123_456, "lat": 597_200_000, "lon": 247_400_000, "COG": 9_000}
    values |= {"heading": 9_200, "velocity": 514, "turn_rate": 20, "navigational_status": 0, "type": 70}
    values |= {"dimension_bow": 100, "dimension_stern": 50, "dimension_port": 10, "dimension_starboard": 15}
    values |= {"callsign": b"PA1234", "name": b"ANNA", "tslc": 7, "flags": 1 | 2 | 4 | 16 | 64 | 2048 | 4096}
    return mav.MAVLink_ais_vessel_message(**(values | changes))


def decoder(quirk: AisQuirk = AisQuirk.STANDARD) -> MavlinkDecoder:
    return MavlinkDecoder(system_id=1, quirk=quirk)


def hear(to: MavlinkDecoder, data: bytes, t_s: float = 0.0) -> list[Heard]:
    return to.decode(Frame(instant(t_s), Link.MAVLINK, data))


def hear_vessel(message: Any, quirk: AisQuirk = AisQuirk.STANDARD, t_s: float = 100.0) -> ContactReport:
    (report,) = hear(decoder(quirk), Talker().say(message), t_s)
    assert isinstance(report, ContactReport)
    return report


def hear_position(to: MavlinkDecoder, message: Any, t_s: float = 0.0) -> OwnPosition | None:
    heard = hear(to, Talker().say(message), t_s)
    assert len(heard) <= 1
    for position in heard:
        assert isinstance(position, OwnPosition)
        return position
    return None


def attitude(yaw: float) -> Any:
    return mav.MAVLink_attitude_message(0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)


def origin(**changes: int) -> Any:
    return mav.MAVLink_gps_global_origin_message(
        **({"latitude": 597_200_000, "longitude": 247_400_000, "altitude": 0, "time_usec": 0} | changes)
    )


def local_position(**changes: float) -> Any:
    values = {"x": 300.0, "y": -400.0, "z": 12.5, "vx": 1.0, "vy": -2.0, "vz": 0.25}
    return mav.MAVLink_local_position_ned_message(0, **(values | changes))
