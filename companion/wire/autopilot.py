"""A heartbeat's words: which autopilot, which vehicle, which mode, and does it take setpoints."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.instant import Instant
from companion.messages import AutopilotHeartbeat

AUTOPILOT_COMPONENT = 1

_FIRMWARES = {dialect.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot", dialect.MAV_AUTOPILOT_PX4: "px4"}
_VEHICLES = {
    dialect.MAV_TYPE_SUBMARINE: "submarine",
    dialect.MAV_TYPE_SURFACE_BOAT: "boat",
    dialect.MAV_TYPE_GROUND_ROVER: "rover",
}
_COPTERS = (
    dialect.MAV_TYPE_QUADROTOR,
    dialect.MAV_TYPE_COAXIAL,
    dialect.MAV_TYPE_HELICOPTER,
    dialect.MAV_TYPE_HEXAROTOR,
    dialect.MAV_TYPE_OCTOROTOR,
    dialect.MAV_TYPE_TRICOPTER,
    dialect.MAV_TYPE_DODECAROTOR,
    dialect.MAV_TYPE_DECAROTOR,
)
# the dialect's own table of mode names, for each vehicle type
_ARDUPILOT_MODES = {
    dialect.MAV_TYPE_SUBMARINE: "SUB_MODE",
    dialect.MAV_TYPE_SURFACE_BOAT: "ROVER_MODE",
    dialect.MAV_TYPE_GROUND_ROVER: "ROVER_MODE",
    **dict.fromkeys(_COPTERS, "COPTER_MODE"),
}
# https://docs.px4.io: main mode in the third byte of custom_mode, AUTO's sub-mode in the fourth
_PX4_MODES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED"}
_PX4_AUTO_MAIN = 4
_PX4_AUTO = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW"}


def is_autopilot(component_id: int, field: dict[str, Any]) -> bool:
    """Is this HEARTBEAT a vehicle's, rather than a ground station's, a gimbal's or ours?"""
    return (
        component_id == AUTOPILOT_COMPONENT
        and field["type"] != dialect.MAV_TYPE_GCS
        and field["autopilot"] != dialect.MAV_AUTOPILOT_INVALID
    )


def heartbeat(field: dict[str, Any], stamp: Instant, system_id: int, component_id: int) -> AutopilotHeartbeat:
    """What the fields of an autopilot's HEARTBEAT say."""
    firmware = _FIRMWARES.get(field["autopilot"], "other")
    mode = "unknown"
    if field["base_mode"] & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        mode = _mode(firmware, field["type"], field["custom_mode"])
    return AutopilotHeartbeat(
        stamp=stamp,
        system_id=system_id,
        component_id=component_id,
        firmware=firmware,
        vehicle=_VEHICLES.get(field["type"], "other"),
        armed=bool(field["base_mode"] & dialect.MAV_MODE_FLAG_SAFETY_ARMED),
        takes_setpoints=mode == {"ardupilot": "GUIDED", "px4": "OFFBOARD"}.get(firmware),
        mode=mode,
    )


def _mode(firmware: str, vehicle_type: int, custom_mode: int) -> str:
    if firmware == "px4":
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        name = _PX4_MODES.get(main, f"mode {main}")
        return f"{name}.{_PX4_AUTO[sub]}" if main == _PX4_AUTO_MAIN and sub in _PX4_AUTO else name
    table = _ARDUPILOT_MODES.get(vehicle_type)
    if firmware == "ardupilot" and table is not None:
        entry = dialect.enums[table].get(custom_mode)
        if entry is not None and not entry.name.endswith("ENUM_END"):
            return str(entry.name.removeprefix(f"{table}_"))
    return f"mode {custom_mode}"
