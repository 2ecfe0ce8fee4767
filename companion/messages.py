"""The nouns of the line from report to setpoint, one frozen dataclass each.

    Frame -wire-> Heard -picture-> Tracks -reach-> ReachableSets -field-> Repulsion -guard-> Setpoint

SI units, radians, seconds.  Local frame: NED around `LocalFrame`'s origin (x north, y east,
z down).  Headings and courses clockwise from true north.  "Not available" is `None` (or NaN in
an array whose docstring says so), never a number.
"""

import math
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from companion.instant import Instant

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


# ---------------------------------------------------------------- bytes


class Link(StrEnum):
    """Where a frame came from or goes to."""

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


# ---------------------------------------------------------------- what was heard


class Source(StrEnum):
    """The wire format a report or position was decoded from."""

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


@dataclass(frozen=True, slots=True)
class ContactReport:
    """One AIS-like report about one ship.  Any field may be missing; nothing is invented.

    `measured_at` is when the position was measured (arrival minus age); the true instant is
    within `age_error_s` of it.  A report without position carries static data only.
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


# ---------------------------------------------------------------- state


@dataclass(frozen=True, slots=True)
class OwnState:
    """The vehicle in the local frame, metres and m/s, NED."""

    stamp: Instant
    north_m: float
    east_m: float
    depth_m: float
    velocity_ned_mps: tuple[float, float, float]
    heading_rad: float | None

    @property
    def position_m(self) -> FloatArray:
        """(2,) north, east."""
        return np.array((self.north_m, self.east_m))

    def distance_to_m(self, point_m: FloatArray) -> float:
        """Horizontal distance to a point (2,)."""
        return math.hypot(point_m[0] - self.north_m, point_m[1] - self.east_m)


class Model(IntEnum):
    """Which obstacle model describes a contact."""

    STRAIGHT = 0  # course and speed known within bounds (the paper's ship)
    DISC = 1  # anywhere at up to `disc_speed_mps`
    TURNING = 2  # as STRAIGHT, but course and hull turn at a bounded rate
    KITE = 3  # around the straight prediction, as far as ships were recorded to stray from it
    BOX = 4  # the same, along and across the track independently


SPREAD_AGES_S = (60.0, 120.0, 300.0, 600.0)  # the ages at which `Tracks.spread_m` is stated


def _nothing() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class Tracks:
    """All contacts as arrays, one row each, rows in MMSI order.  Arrays are read-only.

    The reported point is the antenna.  `heading_rad` is the hull's orientation, which is known
    within `heading_error_rad` (pi = unknown: the hull is then its circumscribed circle).
    Every bound is a bound, not a standard deviation.
    """

    revision: int  # grows with every change; equal revisions are equal tracks
    mmsi: IntArray
    measured_at_ns: IntArray
    north_m: FloatArray
    east_m: FloatArray
    cog_rad: FloatArray
    sog_mps: FloatArray
    heading_rad: FloatArray
    bow_m: FloatArray
    stern_m: FloatArray
    port_m: FloatArray
    starboard_m: FloatArray
    position_error_m: FloatArray
    speed_noise_mps: FloatArray
    course_noise_rad: FloatArray
    heading_error_rad: FloatArray
    disc_speed_mps: FloatArray  # of the disc model
    top_speed_mps: FloatArray  # how fast every set grows on all sides beyond its validity
    validity_s: FloatArray  # age up to which the model's bounds hold
    model: IntArray  # of `Model`
    names: tuple[str, ...] = ()
    turn_rate_radps: FloatArray = field(default_factory=_nothing)  # of TURNING, clockwise; default 0
    turn_rate_error_radps: FloatArray = field(default_factory=_nothing)
    draught_m: FloatArray = field(default_factory=_nothing)  # NaN: not available, the default
    # of KITE and BOX: metres ahead, astern and abeam at each of `SPREAD_AGES_S`, 0 at age 0 and linear
    # between; (n, 4, 3), or (n, 0, 3) while no row needs it
    spread_m: FloatArray = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if len(self.draught_m) != len(self.mmsi):
            object.__setattr__(self, "draught_m", np.full(len(self.mmsi), np.nan))
        for name in ("turn_rate_radps", "turn_rate_error_radps"):
            if len(getattr(self, name)) != len(self.mmsi):
                object.__setattr__(self, name, np.zeros(len(self.mmsi)))
        if self.spread_m.ndim != 3:
            object.__setattr__(self, "spread_m", np.empty((len(self.mmsi), 0, 3)))

    @classmethod
    def empty(cls) -> "Tracks":
        """No contacts."""
        x, ids = np.empty(0), np.empty(0, dtype=np.int64)
        return cls(0, ids, ids, x, x, x, x, x, x, x, x, x, x, x, x, x, x, x, x, ids)

    def __len__(self) -> int:
        return len(self.mmsi)

    def age_s(self, now: Instant) -> FloatArray:
        """(n,) seconds since each contact's position was measured, never negative."""
        age: FloatArray = np.maximum((now - self.measured_at_ns) * 1e-9, 0.0)
        return age


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest point of each of n sets to one position.

    `distance_m` (n,) is negative inside the set (minus the depth of penetration).  `away` (n, 2)
    is the unit gradient of the distance: it points from the set to the position.
    """

    distance_m: FloatArray
    away: FloatArray

    def point_m(self, position_m: FloatArray) -> FloatArray:
        """(n, 2) the nearest boundary points, for a position (2,)."""
        return position_m - self.distance_m[:, None] * self.away


@dataclass(frozen=True, slots=True)
class Repulsion:
    """Each contact's repulsion on the vehicle: -grad U_rep, eq. (8) of the paper.

    `velocity` (n, 2) points away from the ship.  `from_network` (n,) is False where the exact
    field answered because the contact is outside the network's range.
    """

    nearest: Nearest
    velocity: FloatArray
    from_network: BoolArray


# ---------------------------------------------------------------- decisions


class Phase(StrEnum):
    """Where the crossing stands."""

    WAIT = "wait"  # preconditions missing
    LISTEN = "listen"  # surfaced, hearing reports
    CROSS = "cross"  # at (or diving to) the cruise depth, on the way
    RISE = "rise"  # on the way up for new reports
    SURFACE = "surface"  # at the goal, rising
    ARRIVED = "arrived"


class Status(StrEnum):
    """How far the decision can be trusted; ordered from good to bad."""

    OK = "ok"
    DEGRADED = "degraded"
    CLOSED = "closed"  # no setpoint is given


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a decision is not simply what the planner wanted: a code for machines, a text for people."""

    code: str
    text: str


@dataclass(frozen=True, slots=True)
class Setpoint:
    """A velocity for the autopilot, NED m/s, void after `valid_until`."""

    stamp: Instant
    valid_until: Instant
    velocity_ned_mps: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Command:
    """A MAV_CMD for the autopilot, sent as COMMAND_LONG."""

    command: int
    params: tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Our own heartbeat, due now."""

    status: Status


@dataclass(frozen=True, slots=True)
class StatusText:
    """A line for the ground station; severity as in MAV_SEVERITY.  The wire cuts it into chunks."""

    severity: int
    text: str


Outgoing = Setpoint | Command | Heartbeat | StatusText


@dataclass(frozen=True, slots=True)
class Decision:
    """Everything one step found out, so that a log explains itself."""

    t: Instant
    phase: Phase
    status: Status
    reasons: tuple[Reason, ...]
    own: OwnState | None
    tracks: Tracks
    repulsion: Repulsion | None
    attraction_mps: tuple[float, float] | None
    wanted_ned_mps: tuple[float, float, float] | None
    setpoint: Setpoint | None
    guard_changed: bool  # the guard let through something else than the planner wanted
    outgoing: tuple[Outgoing, ...]
    system_id: int = 0  # the vehicle's, once known; the encoder speaks under it
    oldest_used_s: float | None = None  # age of the oldest report that steered the vehicle
    counts: dict[str, int] = field(default_factory=dict)  # frames and messages dropped, by reason
