"""What was decided and what is sent."""

from dataclasses import dataclass, field
from enum import StrEnum

from companion.instant import Instant
from companion.messages.repulsion import Repulsion
from companion.messages.tracks import OwnState, Tracks


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
