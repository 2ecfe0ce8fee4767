"""Bytes as they crossed an edge, and what a decoder made of them."""

from dataclasses import dataclass
from enum import StrEnum

import msgspec

from companion.instant import Instant


class Link(StrEnum):
    """Where a frame came from or goes to."""

    __hash__ = str.__hash__  # asked for every frame; that of the enum is not compiled

    MAVLINK = "mavlink"
    CAN = "can"
    AIVDM = "aivdm"


@dataclass(frozen=True, slots=True)
class Frame:
    """Raw bytes as they crossed an edge.

    A MAVLink frame is one read of the link (a datagram, or whatever a serial port had); it may
    hold several messages, or part of one, and so may a frame of AIVDM sentences.  A CAN frame is one
    frame: `can_id` is the 29-bit identifier and `data` its 0 to 8 bytes.
    """

    stamp: Instant
    link: Link
    data: bytes
    can_id: int = 0


class Source(StrEnum):
    """The wire format a report or position was decoded from."""

    __hash__ = str.__hash__  # asked for every report

    AIS_VESSEL = "AIS_VESSEL"
    NMEA2000 = "NMEA2000"
    MAVLINK = "MAVLINK"
    AIVDM = "AIVDM"
    ADSB_VEHICLE = "ADSB_VEHICLE"
    TABLE = "table"  # decoded long ago, of a CSV file


class TargetKind(StrEnum):
    """What sent the report."""

    CLASS_A = "class A"
    CLASS_B = "class B"
    AIRCRAFT = "aircraft"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Hull:
    """Extent of a ship from its GNSS antenna, metres, each >= 0."""

    bow_m: float
    stern_m: float
    port_m: float
    starboard_m: float


class ContactReport(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """One AIS-like report about one ship.  Any field may be missing; nothing is invented.

    `measured_at` is when the position was measured (arrival minus age); the true instant is
    within `age_error_s` of it.  A report without position carries static data only.

    Not a dataclass, because thousands come in a second and msgspec makes one four times as fast, and holding
    nothing that could hold it, without work for the garbage collector; a copy with changes is
    `msgspec.structs.replace(report, ...)`.
    """

    mmsi: int
    source: Source
    received_at: Instant
    measured_at: Instant
    age_error_s: float
    kind: TargetKind = TargetKind.UNKNOWN
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    accurate: bool = False  # the sender claims a position error of 10 m or less
    cog_rad: float | None = None
    sog_mps: float | None = None
    heading_rad: float | None = None
    turn_rate_radps: float | None = None
    navigational_status: int | None = None
    hull: Hull | None = None
    ship_type: int | None = None
    name: str | None = None
    draught_m: float | None = None  # as its crew set it, the deepest


@dataclass(frozen=True, slots=True)
class OwnPosition:
    """A position of the platform itself, from the autopilot or from a receiver on the bus.

    `depth_m` is positive down from the surface (home altitude); None where the source has none.
    `velocity_ned_mps` is (north, east, down) over ground.
    """

    stamp: Instant
    source: Source
    latitude_deg: float
    longitude_deg: float
    depth_m: float | None = None
    velocity_ned_mps: tuple[float, float, float] | None = None
    heading_rad: float | None = None
    talker: int = 0  # which receiver of the source, such as its address on the bus


@dataclass(frozen=True, slots=True)
class AutopilotHeartbeat:
    """What the autopilot says of itself: is it armed, and does it take velocity setpoints now."""

    stamp: Instant
    system_id: int
    component_id: int
    firmware: str  # "ardupilot", "px4" or "other"
    vehicle: str  # "submarine", "boat", "rover" or "other"
    armed: bool
    takes_setpoints: bool  # GUIDED (ArduPilot) or OFFBOARD (PX4)
    mode: str  # readable: "GUIDED", "OFFBOARD", "mode 19"


@dataclass(frozen=True, slots=True)
class CommandAck:
    """The autopilot's answer to a command of ours."""

    stamp: Instant
    command: int
    result: int


@dataclass(frozen=True, slots=True)
class UtcTime:
    """A statement of UTC: at `stamp` on the source's clock it was `utc_ns` since 1970."""

    stamp: Instant
    source: Source
    utc_ns: int


Heard = ContactReport | OwnPosition | AutopilotHeartbeat | CommandAck | UtcTime
