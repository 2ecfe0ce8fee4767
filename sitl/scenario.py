"""A scenario: one TOML file that describes a sea, a vehicle in it, and how the companion is set up there."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from companion.config import Latitude, Longitude, NonNegative, Positive, Section, overlay
from companion.errors import ConfigError
from sitl.traffic import NoiseKind

FOLDER = Path(__file__).parent / "scenarios"


class Channel(Section, frozen=True):
    """A two-lane channel; its middle on the crossing line lies at the position given.

    `course_deg` is the channel's direction: the lane farther from the start sails it, the nearer
    one the other way (or the same, `same_way`).  `lanes_m` are the lanes' middles from the near edge.
    """

    latitude_deg: Latitude
    longitude_deg: Longitude
    course_deg: Annotated[float, Meta(ge=0, lt=360)] = 0.0
    same_way: bool = False
    width_m: Positive = 230.0
    lanes_m: tuple[float, float] = (57.5, 172.5)


class Ships(Section, frozen=True):
    """The convoys, alike in both lanes.

    `gap_m` is free water between two hulls.  The middle ship of a lane passes the crossing line
    at `meet_s`, shifted along the lane by up to `spread_m` either way (drawn from the seed).
    Noise: see `sitl.traffic.Noise`.
    """

    per_lane: Annotated[int, Meta(ge=0, le=100)] = 5
    speed_mps: Positive = 5.0
    noise: NoiseKind = "constant"
    speed_noise_mps: NonNegative = 0.05
    course_noise_rad: NonNegative = 0.01
    length_m: Positive = 75.0
    beam_m: Positive = 25.0
    antenna_from_bow_m: NonNegative = 55.0
    antenna_from_starboard_m: NonNegative = 15.0
    draught_m: Positive = 8.0
    gap_m: Positive = 375.0
    meet_s: float = 300.0
    spread_m: NonNegative = 225.0


class Vehicle(Section, frozen=True):
    """The vehicle and its autopilot (`sitl.profiles`); `mode` empty means the one that takes setpoints.

    It is surfaced `before_m` before the channel's near edge, bow towards the goal.  The antenna
    hears while the vehicle's depth is less than `antenna_height_m`.  Its AIS receiver has been on for
    `receiver_on_s`: what the ships sent meanwhile, static data too, the autopilot has.  `model`: the
    submarine in six and the boat in three degrees of freedom, or points with a lag (`speed_lag_s`); a rover
    is a differential drive, without current.
    """

    profile: Literal["sub", "boat", "rover", "px4"] = "sub"
    model: Literal["physics", "kinematic"] = "physics"
    armed: bool = True
    mode: str = ""
    before_m: NonNegative = 500.0
    max_speed_mps: Positive = 2.5
    max_vertical_speed_mps: Positive = 0.5
    max_turn_rate_radps: Positive = 0.2
    speed_lag_s: Positive = 2.0
    current_north_mps: Annotated[float, Meta(ge=-1, le=1)] = 0.0
    current_east_mps: Annotated[float, Meta(ge=-1, le=1)] = 0.0
    antenna_height_m: Positive = 1.0
    receiver_on_s: NonNegative = 400.0


class End(Section, frozen=True):
    """The run ends at the surface within `radius_m` of the goal, or at the time limit."""

    beyond_m: NonNegative = 500.0
    radius_m: Positive = 15.0
    surfaced_depth_m: Positive = 1.0
    time_limit_s: Positive = 1500.0


class Scenario(Section, frozen=True):
    """The whole file.  `companion` holds tables of the companion's configuration, `goal` excepted."""

    title: str
    channel: Channel
    ships: Ships = Ships()
    vehicle: Vehicle = Vehicle()
    end: End = End()
    start_unix_s: int = 1_780_293_600  # 2026-06-01 06:00 UTC
    companion: dict[str, dict[str, Any]] = {}  # noqa: RUF012 - msgspec copies it

    def __post_init__(self) -> None:
        ships = self.ships
        if ships.antenna_from_bow_m > ships.length_m or ships.antenna_from_starboard_m > ships.beam_m:
            raise ValueError(
                "ships.antenna_from_bow_m, antenna_from_starboard_m: the antenna is off the ship"
            )

    def companion_tables(
        self, goal_deg: tuple[float, float], overrides: dict[str, dict[str, Any]] | None = None
    ) -> dict[str, object]:
        """The companion's configuration for a run to `goal_deg`, for `companion.config.from_mapping`."""
        goal = {"latitude_deg": goal_deg[0], "longitude_deg": goal_deg[1], "radius_m": self.end.radius_m}
        tables = overlay({}, self.companion)
        return overlay({**tables, "goal": goal}, overrides or {})


def names() -> list[str]:
    """The bundled scenarios."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name_or_file: str) -> Scenario:
    """A bundled scenario by name, or a TOML file; raises `ConfigError` naming key and remedy."""
    path = FOLDER / f"{name_or_file}.toml" if name_or_file in names() else Path(name_or_file)
    try:
        return msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), Scenario)
    except OSError as error:
        raise ConfigError(
            f"scenario {name_or_file}: {error.strerror}; give a TOML file or one of {', '.join(names())}"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"scenario {path}: not TOML: {error}") from None
    except (msgspec.ValidationError, ValueError) as error:
        raise ConfigError(f"scenario {path}: {error}") from None
