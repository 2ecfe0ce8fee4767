"""What a log holds: topics, records, and their JSON schemas.  Pure.

One MCAP file a run.  Every message is JSON with a JSON schema; its `log_time` is the `Instant` it
belongs to.  A step is written as its frames, its tick, its tracks if they changed, its decision,
the bytes sent, and how long it took; what is absent was not available.

    /session      once, first: schema version, software, configuration, the model file's digest
    /mavlink/in   {"data": base64}            bytes of one read of the link; log_time = arrival
    /can/in       {"can_id": n, "data": ...}  one CAN frame; log_time = arrival
    /aivdm/in     {"data": base64}            bytes of one read of an AIS receiver's sentences
    /tick         closes the frames of one turn of the loop
    /tracks       all contacts as columns, whenever their revision changes
    /decision     what was decided, and why; `digest` covers the complete arrays
    /mavlink/out  {"data": base64}            one encoded message to the autopilot
    /timing       the step's duration: the one record a replay does not compare
"""

from enum import StrEnum
from typing import Any

import msgspec
from msgspec import Struct

from companion.messages import OwnState, Reason, Setpoint

SCHEMA_VERSION = 1
NEAREST_CONTACTS = 8
SESSION_METADATA = "companion.session"  # the MCAP metadata record that holds the session too


class Topic(StrEnum):
    """The channels of a log."""

    SESSION = "/session"
    MAVLINK_IN = "/mavlink/in"
    CAN_IN = "/can/in"
    AIVDM_IN = "/aivdm/in"
    TICK = "/tick"
    TRACKS = "/tracks"
    DECISION = "/decision"
    MAVLINK_OUT = "/mavlink/out"
    TIMING = "/timing"


class Record(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A message of the log; a field that is None is left out."""


class Session(Record, frozen=True):
    """The first record: what a replay needs to build the same core again.

    `config` is the complete configuration as tables (see `companion.config.to_mapping`).
    `model_sha256` and `turning_model_sha256` are None where no such network was loaded, `bounds_sha256`
    where no bounds file was.
    `code_sha256` is of the program's own sources: a version's number outlives many changes.
    `versions` names the numerical libraries and the machine, which a difference in the last digit may
    come from.
    """

    schema_version: int
    software: str
    rate_hz: float
    config: dict[str, Any]
    model_sha256: str | None = None
    turning_model_sha256: str | None = None
    bounds_sha256: str | None = None
    code_sha256: str | None = None
    versions: dict[str, str] = {}


class Bytes(Record, frozen=True):
    """Raw bytes that came in over a link."""

    data: bytes


class Sent(Record, frozen=True):
    """Encoded MAVLink; `expired`: the sink dropped it, for it was late."""

    data: bytes
    expired: bool = False


class CanFrame(Record, frozen=True):
    """A CAN frame with its 29-bit identifier."""

    can_id: int
    data: bytes


class TickRecord(Record, frozen=True):
    """One turn of the loop; its `frames` messages stand just before it."""

    number: int
    t_ns: int
    frames: int


class ContactRecord(Record, frozen=True):
    """One contact as it entered the decision: distance to its set, and its push (north, east)."""

    mmsi: int
    age_s: float
    distance_m: float
    away: tuple[float, float]
    repulsion_mps: tuple[float, float]
    from_network: bool


class OutgoingRecord(Record, frozen=True):
    """A message to the autopilot, for reading; its bytes are on /mavlink/out."""

    kind: str
    text: str


class DecisionRecord(Record, frozen=True):
    """A `Decision`, with the nearest contacts only.

    `digest` is BLAKE2b over every byte of the tracks' and the repulsion's arrays, so that two
    equal records come from equal decisions, contact by contact.
    """

    number: int
    t_ns: int
    phase: str
    status: str
    reasons: tuple[Reason, ...]
    tracks_revision: int
    contacts: int
    nearest: list[ContactRecord]
    digest: str
    outgoing: list[OutgoingRecord]
    counts: dict[str, int]
    guard_changed: bool
    system_id: int
    own: OwnState | None = None
    attraction_mps: tuple[float, float] | None = None
    wanted_ned_mps: tuple[float, float, float] | None = None
    setpoint: Setpoint | None = None
    oldest_used_s: float | None = None


class TracksRecord(Record, frozen=True):
    """`Tracks` as columns; units and meaning as there."""

    revision: int
    mmsi: list[int]
    measured_at_ns: list[int]
    north_m: list[float]
    east_m: list[float]
    cog_rad: list[float]
    sog_mps: list[float]
    heading_rad: list[float]
    bow_m: list[float]
    stern_m: list[float]
    port_m: list[float]
    starboard_m: list[float]
    position_error_m: list[float]
    speed_noise_mps: list[float]
    course_noise_rad: list[float]
    heading_error_rad: list[float]
    disc_speed_mps: list[float]
    top_speed_mps: list[float]
    validity_s: list[float | None]  # None: for ever
    model: list[int]
    names: tuple[str, ...] = ()
    turn_rate_radps: list[float] = []
    turn_rate_error_radps: list[float] = []
    draught_m: list[float | None] = []
    spread_m: list[list[list[float]]] = []


class Timing(Record, frozen=True):
    """How long the step took, seconds."""

    step_s: float


RECORDS: dict[Topic, type[Record]] = {
    Topic.SESSION: Session,
    Topic.MAVLINK_IN: Bytes,
    Topic.CAN_IN: CanFrame,
    Topic.AIVDM_IN: Bytes,
    Topic.TICK: TickRecord,
    Topic.TRACKS: TracksRecord,
    Topic.DECISION: DecisionRecord,
    Topic.MAVLINK_OUT: Sent,
    Topic.TIMING: Timing,
}

_encoder = msgspec.json.Encoder(order="deterministic")


def encode(record: Record) -> bytes:
    """JSON with sorted keys and the shortest digits that give every float back."""
    return _encoder.encode(record)


def json_schema(record: type[Record]) -> bytes:
    """The JSON schema of a record, without references and null alternatives.

    Viewers of MCAP files (Foxglove among them) read plain objects, arrays and strings only; what
    may be missing is therefore not `required`, instead of null.
    """
    schema = msgspec.json.schema(record)
    definitions: dict[str, Any] = schema.pop("$defs", {})
    return msgspec.json.encode(_plain(schema, definitions))


def _plain(node: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in node:
        return _plain(definitions[node["$ref"].rpartition("/")[2]], definitions)
    if "anyOf" in node:
        (only,) = [option for option in node["anyOf"] if option.get("type") != "null"]
        return _plain(only, definitions)
    if node.get("type") == "object":
        properties = {k: _plain(v, definitions) for k, v in node.get("properties", {}).items()}
        return {"type": "object", "properties": properties, "required": node.get("required", [])}
    if node.get("type") == "array":
        items = node["prefixItems"][0] if "prefixItems" in node else node["items"]
        return {"type": "array", "items": _plain(items, definitions)}
    return {key: node[key] for key in ("type", "contentEncoding") if key in node}
