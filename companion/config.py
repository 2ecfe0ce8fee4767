"""The configuration: one TOML file, validated once, frozen after.

Every key carries its unit in its name and its meaning in its section's docstring.  An unknown
key, a wrong type, a value out of range, or keys that contradict each other end the start with a
`ConfigError` that names the key and the remedy.
"""

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from companion.errors import ConfigError

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Fraction = Annotated[float, Meta(gt=0, le=1)]
Latitude = Annotated[float, Meta(ge=-90, le=90)]
Longitude = Annotated[float, Meta(ge=-180, le=180)]


class Section(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of the TOML file."""


class Autopilot(Section, frozen=True):
    """Whom we talk to, and what we may do there.

    `system_id` is the vehicle's (0 = whichever autopilot is heard first); ours is the same, with
    `component_id` (196 = MAV_COMP_ID_OBSTACLE_AVOIDANCE).  PX4 admits OFFBOARD only while setpoints
    already stream: `prestream_offboard` sends it zero velocities before, which it ignores.
    `ais_sender` names the reading of AIS_VESSEL: ArduPilot of 2025 says turn rates in cdeg/s, earlier
    ones also speeds in 0.1 knots.
    """

    system_id: Annotated[int, Meta(ge=0, le=254)] = 0
    component_id: Annotated[int, Meta(ge=1, le=255)] = 196
    may_set_mode: bool = False
    may_arm: bool = False
    prestream_offboard: bool = False
    request_messages: bool = True
    ais_sender: Literal["standard", "ardupilot-2025", "ardupilot-early"] = "standard"
    heartbeat_timeout_s: Positive = 3.0
    position_timeout_s: Positive = 1.0


class Links(Section, frozen=True):
    """Where the bytes come from: MAVLink in pymavlink's or MAVSDK's spelling, CAN as `interface:channel`.

    `aivdm`: NMEA 0183 sentences of an AIS receiver over UDP, TCP or serial, spelt as `mavlink` is; or none.
    """

    mavlink: str = "udpin:0.0.0.0:14550"
    can: tuple[str, ...] = ()
    aivdm: str = ""


class Goal(Section, frozen=True):
    """Where to go; reached within `radius_m`."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    radius_m: Positive = 15.0


class Vehicle(Section, frozen=True):
    """What the vehicle can do.  `cruise_depth_m = 0` is a surface vehicle."""

    max_speed_mps: Positive = 2.5
    max_vertical_speed_mps: Positive = 0.5
    max_turn_rate_radps: Positive = 0.2
    speed_lag_s: Positive = 2.0
    cruise_depth_m: NonNegative = 45.0
    max_depth_m: NonNegative = 60.0
    surfaced_depth_m: Positive = 1.0
    listen_s: NonNegative = 60.0


class Contacts(Section, frozen=True):
    """What is assumed of ships: bounds, not standard deviations.

    `speed_noise_mps` and `course_noise_rad` are the paper's w_v and w_theta; the defaults are for
    ships under way in open water, the paper's case sets its own.  `position_error_m` applies to
    reports flagged accurate, `coarse_position_error_m` to the others.  The noise bounds are believed for
    `validity_s` after a report; from then on the ship may do anything up to `top_speed_mps`.  Below
    `slow_below_mps` a course means nothing: such a ship may go any way at that speed, but no farther than
    `anchored_m` or `moored_m` while it says that it is at anchor, or moored or aground.

    A ship whose sensor of turn reports at least `turning_above_radps` (0: none) is taken to turn at that
    rate, within `turn_rate_error_radps`, or to end its turn at any moment.

    `bounds_file`, written by `companion calibrate` (a file, or a name in models/), replaces the noise bounds
    of ships under way by how far recorded ships strayed, such that a share `bounds_level` of them stayed
    inside; empty: the constants above hold.
    """

    speed_noise_mps: NonNegative = 0.25
    course_noise_rad: Annotated[float, Meta(ge=0, lt=math.pi / 2)] = 0.05
    position_error_m: NonNegative = 10.0
    coarse_position_error_m: NonNegative = 30.0
    heading_error_rad: Annotated[float, Meta(ge=0, le=math.pi)] = 0.05
    default_length_m: Positive = 200.0
    default_beam_m: Positive = 32.0
    default_class_b_length_m: Positive = 25.0
    default_class_b_beam_m: Positive = 8.0
    top_speed_mps: Positive = 16.0
    slow_below_mps: NonNegative = 0.5
    anchored_m: NonNegative = 300.0
    moored_m: NonNegative = 30.0
    turning_above_radps: NonNegative = 0.003
    turn_rate_error_radps: NonNegative = 0.001
    validity_s: Positive = 600.0
    own_mmsi: Annotated[int, Meta(ge=0, le=999_999_999)] = 0
    bounds_file: str = ""
    bounds_level: Annotated[float, Meta(ge=0.5, lt=1)] = 0.99


class Field(Section, frozen=True):
    """The paper's potential field: K_p, K_r, delta and T.

    `attraction = "unit"` pulls with K_p whatever the distance; `"proportional"` is eq. (6) to the
    letter, K_p times the distance.
    """

    delta_m: Positive = 5.0
    horizon_s: Positive = 600.0
    k_p: Positive = 5.0
    k_r: Positive = 15000.0
    attraction: Literal["unit", "proportional"] = "unit"


class Planner(Section, frozen=True):
    """How far ahead each ship's set reaches.

    `"clearing"`: from now until the vehicle has cleared that ship's corridor at full speed, times
    `clearing_margin`, with a pull toward the ship's stern of `astern_gain` times the repulsion.
    `"paper"`: the tube from now to the report's time plus T, for every ship: a wall in dense traffic.
    `rehearse`: before it leaves, and until it has begun to cross, the clearing planner plays the crossing
    forward on what is known, and holds where there is no safe way.
    """

    horizon: Literal["paper", "clearing"] = "clearing"
    clearing_margin: Annotated[float, Meta(ge=1)] = 1.3
    astern_gain: NonNegative = 0.5
    rehearse: bool = True


class RepulsionChoice(Section, frozen=True):
    """Who computes the repulsion: the network or the exact sets.

    `model`: a file, or a name in models/; `turning_model` the same for ships that turn, or "" for the exact
    sets there.
    """

    kind: Literal["network", "exact"] = "network"
    model: str = "straight"
    turning_model: str = "turning"


class Guard(Section, frozen=True):
    """The last word: what its verified way out assumes, each bound watched at run time.

    A way out runs for at most `way_out_s` and then stays.  Beyond its validity a ship's set still counts
    for `lookahead_s`.  A setpoint acts at most `setpoint_delay_s` late.  The vehicle makes good its full
    speed less `current_mps`, and stays within `tracking_error_m` of a planned path (the default holds for
    the bundled boat; the bundled submarine keeps within 3).  Its position is known within
    `own_position_error_m`, plus `own_position_drift_mps` for every second under water.

    `vertical = "ignore"`: depth counts for nothing (the paper).  `"clear_below"`: a ship reaches down to its
    draught (`draught_per_length` of its length where static data is silent) plus `draught_margin_m`, and
    the vehicle's depth is known within `depth_error_m`.
    """

    way_out_s: Annotated[float, Meta(ge=30, le=900)] = 300.0
    lookahead_s: NonNegative = 20.0
    setpoint_delay_s: Annotated[float, Meta(ge=0, le=5)] = 0.5
    current_mps: NonNegative = 0.2
    tracking_error_m: Positive = 8.0
    own_position_error_m: NonNegative = 2.0
    own_position_drift_mps: NonNegative = 0.003
    vertical: Literal["ignore", "clear_below"] = "ignore"
    draught_per_length: Positive = 0.09
    draught_margin_m: NonNegative = 5.0
    depth_error_m: NonNegative = 1.0


class Reach(Section, frozen=True):
    """What computes the distances to sets: `"numpy"`, or `"numba"`, compiled at start (an extra)."""

    kernel: Literal["numpy", "numba"] = "numpy"


class Surfacing(Section, frozen=True):
    """When a vehicle under way goes up for new reports.

    With less than `reserve_s` (and the time for going up, listening and diving) of validity left and the
    goal farther than that; without progress for `patience_s`; when a set within a kilometre reaches
    `largest_set_m` beyond its ship's size.  `every_s` > 0: at that interval instead, whatever the sets say.
    """

    reserve_s: NonNegative = 120.0
    patience_s: Positive = 300.0
    largest_set_m: Positive = 150.0
    every_s: NonNegative = 0.0


class Timing(Section, frozen=True):
    """The loop's rate and how long a setpoint stays true."""

    rate_hz: Annotated[float, Meta(gt=0, le=100)] = 10.0
    setpoint_validity_s: Positive = 0.5


class Recording(Section, frozen=True):
    """Where run folders go; an empty string records nothing."""

    folder: str = "runs"


class Config(Section, frozen=True):
    """The whole file."""

    goal: Goal
    autopilot: Autopilot = Autopilot()
    links: Links = Links()
    vehicle: Vehicle = Vehicle()
    contacts: Contacts = Contacts()
    field: Field = Field()
    planner: Planner = Planner()
    repulsion: RepulsionChoice = RepulsionChoice()
    guard: Guard = Guard()
    reach: Reach = Reach()
    surfacing: Surfacing = Surfacing()
    timing: Timing = Timing()
    recording: Recording = Recording()

    def __post_init__(self) -> None:
        for key, value in _floats("", msgspec.to_builtins(self)):
            if not math.isfinite(value):
                raise ValueError(f"{key} = {value}: must be a finite number")
        if self.vehicle.cruise_depth_m > self.vehicle.max_depth_m:
            raise ValueError(
                f"vehicle.cruise_depth_m = {self.vehicle.cruise_depth_m:g} is below "
                f"vehicle.max_depth_m = {self.vehicle.max_depth_m:g}: raise the one or lower the other"
            )
        if self.guard.current_mps >= self.vehicle.max_speed_mps:
            raise ValueError(
                f"guard.current_mps = {self.guard.current_mps:g} is not below vehicle.max_speed_mps = "
                f"{self.vehicle.max_speed_mps:g}: no way out can be planned that is slower than the water"
            )
        every_s, vehicle = self.surfacing.every_s, self.vehicle
        up_s = vehicle.listen_s + 2 * vehicle.cruise_depth_m / vehicle.max_vertical_speed_mps
        longest_s = self.contacts.validity_s - self.surfacing.reserve_s - up_s
        if every_s > max(longest_s, 0.0):
            raise ValueError(
                f"surfacing.every_s = {every_s:g}: at most {max(longest_s, 0):.0f} s, as surfacing.reserve_s "
                f"and the {up_s:.0f} s of a surfacing have to fit into contacts.validity_s with it, or the "
                "information ends under water; lower it, or set 0 to let it decide"
            )
        period_s = 1.0 / self.timing.rate_hz
        if self.timing.setpoint_validity_s <= period_s:
            raise ValueError(
                f"timing.setpoint_validity_s = {self.timing.setpoint_validity_s:g} is not longer than "
                f"one period of timing.rate_hz ({period_s:g} s): setpoints would expire before the next"
            )


def _floats(prefix: str, node: object) -> list[tuple[str, float]]:
    if isinstance(node, dict):
        return [hit for k, v in node.items() for hit in _floats(f"{prefix}.{k}".lstrip("."), v)]
    return [(prefix, node)] if isinstance(node, float) else []


def from_mapping(tables: dict[str, object], origin: str = "configuration") -> Config:
    """A validated `Config`; raises `ConfigError` naming the key."""
    try:
        return msgspec.convert(tables, Config)
    except (msgspec.ValidationError, ValueError) as error:
        raise ConfigError(f"{origin}: {_readable(str(error))}") from None


def load(path: Path, overrides: dict[str, dict[str, Any]] | None = None) -> Config:
    """Read a TOML file and lay `overrides` (section -> key -> value) over it."""
    return from_mapping(overlay(tables_of(path), overrides or {}), str(path))


def tables_of(path: Path) -> dict[str, Any]:
    """The tables of a TOML file, not validated yet; raises `ConfigError` if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}; give --config an existing TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None


def overlay(tables: dict[str, Any], over: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """`tables` with the values of `over` put on top, section by section."""
    merged = dict(tables)
    for section, values in over.items():
        below = merged.get(section, {})
        merged[section] = {**below, **values} if isinstance(below, dict) else values
    return merged


def to_mapping(config: Config) -> dict[str, object]:
    """The configuration as plain tables, for the log's first record."""
    tables: dict[str, object] = msgspec.to_builtins(config)
    return tables


def _readable(text: str) -> str:
    """msgspec's `Expected ... - at `$.a.b`` turned to begin with the key."""
    message, at, path = text.partition(" - at `$")
    return f"{path.strip('`').lstrip('.')}: {message}" if at else text
