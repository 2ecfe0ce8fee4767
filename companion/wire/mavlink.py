"""MAVLink to messages, and our messages to MAVLink 2."""

import math
from collections import Counter
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.messages import (
    Command,
    CommandAck,
    Frame,
    Heard,
    Heartbeat,
    Outgoing,
    Setpoint,
    Source,
    Status,
    StatusText,
    UtcTime,
)
from companion.wire import adsb_vehicle, ais_vessel, autopilot, vehicle_position
from companion.wire.ais_vessel import AisQuirk
from companion.wire.mavlink_frames import MavlinkFrames, Packet, fields
from companion.wire.vehicle_position import VehiclePosition

OUR_COMPONENT = 196  # MAV_COMP_ID_OBSTACLE_AVOIDANCE
HEARTBEAT, SYSTEM_TIME, COMMAND_ACK, STATUSTEXT = 0, 2, 77, 253
_POSITION_IDS = frozenset(
    (
        vehicle_position.ATTITUDE,
        vehicle_position.LOCAL_POSITION_NED,
        vehicle_position.GLOBAL_POSITION_INT,
        vehicle_position.GPS_GLOBAL_ORIGIN,
    )
)
_CONTACTS = {ais_vessel.AIS_VESSEL, adsb_vehicle.ADSB_VEHICLE}
_WANTED = _CONTACTS | _POSITION_IDS | {HEARTBEAT, SYSTEM_TIME, COMMAND_ACK, STATUSTEXT}
_UTC_US = range(946_684_800_000_000, 4_102_444_800_000_000)  # 2000 to 2100: others were never set

LOCAL_NED = 1
VELOCITY_ONLY = 0x0DC7  # ignore position, acceleration, force, yaw and yaw rate
_STATES = {
    Status.OK: dialect.MAV_STATE_ACTIVE,
    Status.DEGRADED: dialect.MAV_STATE_CRITICAL,
    Status.CLOSED: dialect.MAV_STATE_STANDBY,
}
_CHUNK = 50
_LONGEST_TEXT = 4 * _CHUNK  # characters
_FASTEST_MPS = 100.0


class MavlinkDecoder:
    """Decodes what one vehicle sends; what others send on the link is counted and left.

    With `system_id` 0 it follows the first autopilot whose heartbeat it hears, and keeps to it.
    """

    def __init__(
        self, *, system_id: int, component_id: int = OUR_COMPONENT, quirk: AisQuirk = AisQuirk.STANDARD
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.system_id = system_id
        self._component_id = component_id
        self._quirk = quirk
        self._frames = MavlinkFrames(self.counts)
        self._position = VehiclePosition(self.counts)

    def decode(self, frame: Frame) -> list[Heard]:
        """What the messages completed by this frame say, in order."""
        heard = []
        for packet in self._frames.push(frame.stamp, frame.data):
            if packet.message_id in _WANTED:
                message = self._read(packet, frame)
                if message is not None:
                    heard.append(message)
        return heard

    def _read(self, packet: Packet, frame: Frame) -> Heard | None:
        message_id = packet.message_id
        if not self.system_id and message_id == HEARTBEAT:
            self._follow(packet)
        if not self._is_wanted(packet):
            return None
        if message_id == ais_vessel.AIS_VESSEL:
            return ais_vessel.read(packet.payload, frame.stamp, self._quirk, self.counts)
        field = fields(message_id, packet.payload)
        if message_id == adsb_vehicle.ADSB_VEHICLE:
            return adsb_vehicle.read(field, frame.stamp, self.counts)
        if message_id in _POSITION_IDS:
            return self._position.hear(message_id, field, frame.stamp)
        return self._said(packet, field, frame)

    def _is_wanted(self, packet: Packet) -> bool:
        """Contacts of any component of the vehicle but ours, all else of its autopilot only."""
        if packet.system_id != self.system_id or not self.system_id:
            self.counts["mavlink.other_system"] += 1
            return False
        if packet.component_id == self._component_id:
            self.counts["mavlink.own_component"] += 1
            return False
        return packet.message_id in _CONTACTS or packet.component_id == autopilot.AUTOPILOT_COMPONENT

    def _follow(self, packet: Packet) -> None:
        if autopilot.is_autopilot(packet.component_id, fields(HEARTBEAT, packet.payload)):
            self.system_id = packet.system_id

    def _said(self, packet: Packet, field: dict[str, Any], frame: Frame) -> Heard | None:
        match packet.message_id:
            case 0 if autopilot.is_autopilot(packet.component_id, field):
                return autopilot.heartbeat(field, frame.stamp, packet.system_id, packet.component_id)
            case 2 if field["time_unix_usec"] in _UTC_US:
                return UtcTime(frame.stamp, Source.MAVLINK, field["time_unix_usec"] * 1000)
            case 2:
                self.counts["mavlink.no_utc"] += 1
            case 77 if self._is_for_us(field):
                return CommandAck(frame.stamp, field["command"], field["result"])
            case 253:
                self.counts["mavlink.statustext"] += 1
        return None

    def _is_for_us(self, ack: dict[str, Any]) -> bool:
        """Zeros are what a sender says that does not name whom it answers."""
        ours = ack["target_system"] in (0, self.system_id)
        return ours and ack["target_component"] in (0, self._component_id)


class MavlinkEncoder:
    """Our messages as MAVLink 2, from `component_id` on the vehicle's own system id.

    `system_id` may be set later, when the vehicle's is known.
    """

    def __init__(self, *, system_id: int, component_id: int = OUR_COMPONENT) -> None:
        self._packer = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._text_id = 0

    @property
    def system_id(self) -> int:
        """The vehicle's, and so ours."""
        return int(self._packer.srcSystem)

    @system_id.setter
    def system_id(self, system_id: int) -> None:
        self._packer.srcSystem = system_id

    def encode(self, message: Outgoing) -> bytes:
        """One packet, several for a long text.

        Raises `ValueError` for numbers that must never reach an autopilot.
        """
        match message:
            case Setpoint():
                return self._pack(self._setpoint(message))
            case Command():
                return self._pack(self._command(message))
            case Heartbeat():
                beat = dialect.MAVLink_heartbeat_message(
                    type=dialect.MAV_TYPE_ONBOARD_CONTROLLER,
                    autopilot=dialect.MAV_AUTOPILOT_INVALID,
                    base_mode=0,
                    custom_mode=0,
                    system_status=_STATES[message.status],
                    mavlink_version=3,
                )
                return self._pack(beat)
            case StatusText():
                return b"".join(map(self._pack, self._chunks(message)))

    def _pack(self, packed: dialect.MAVLink_message) -> bytes:
        data: bytes = packed.pack(self._packer)
        self._packer.seq = (self._packer.seq + 1) % 256
        return data

    def _chunks(self, message: StatusText) -> list[dialect.MAVLink_message]:
        """A text that fits is complete in itself (id 0); the last chunk of a longer one is a short one."""
        text = message.text.encode("ascii", "replace")[:_LONGEST_TEXT]
        if len(text) <= _CHUNK:
            return [dialect.MAVLink_statustext_message(message.severity, text)]
        self._text_id = self._text_id % 0xFFFF + 1
        pieces = [text[at : at + _CHUNK] for at in range(0, len(text) + 1, _CHUNK)]
        return [
            dialect.MAVLink_statustext_message(message.severity, piece, self._text_id, number)
            for number, piece in enumerate(pieces)
        ]

    def _setpoint(self, setpoint: Setpoint) -> dialect.MAVLink_message:
        if not all(abs(v) <= _FASTEST_MPS for v in setpoint.velocity_ned_mps):  # False for NaN
            raise ValueError(f"setpoint velocity {setpoint.velocity_ned_mps} is no vehicle's")
        vx, vy, vz = setpoint.velocity_ned_mps
        return dialect.MAVLink_set_position_target_local_ned_message(
            time_boot_ms=setpoint.stamp // 1_000_000 & 0xFFFFFFFF,
            target_system=self.system_id,
            target_component=autopilot.AUTOPILOT_COMPONENT,
            coordinate_frame=LOCAL_NED,
            type_mask=VELOCITY_ONLY,
            **dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0),
            vx=vx,
            vy=vy,
            vz=vz,
        )

    def _command(self, command: Command) -> dialect.MAVLink_message:
        if not all(map(math.isfinite, command.params)):
            raise ValueError(f"parameters {command.params} of command {command.command} are not finite")
        return dialect.MAVLink_command_long_message(
            self.system_id, autopilot.AUTOPILOT_COMPONENT, command.command, 0, *command.params
        )
