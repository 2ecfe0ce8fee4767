"""A model's TOML file: all that its training depends on."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from companion.errors import ConfigError
from companion.planning.model_file import Input
from companion.planning.rows import COLUMNS

Range = tuple[float, float]
Positive = Annotated[float, Meta(gt=0)]


class Field(Struct, frozen=True, forbid_unknown_fields=True):
    """The constants the graph carries."""

    delta_m: Positive
    k_r: Positive
    horizon_s: Positive


class Network(Struct, frozen=True, forbid_unknown_fields=True):
    """Size and training of the learned part."""

    grid: Annotated[int, Meta(ge=8, multiple_of=4)]
    hidden: tuple[int, ...]
    adam_steps: int
    adam_rate: Positive
    samples: int
    ridge: Positive


class Rounding(Struct, frozen=True, forbid_unknown_fields=True):
    """Outward margins for float32."""

    shape: Positive
    margin_m: Positive
    margin_relative: Positive


class Spec(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The whole file."""

    name: str
    kind: Literal["support"]
    seed: int
    field: Field
    network: Network
    rounding: Rounding
    domain: dict[str, Range]

    def __post_init__(self) -> None:
        if tuple(self.domain) != COLUMNS:
            raise ValueError(f"domain must name exactly these columns, in order: {', '.join(COLUMNS)}")

    @property
    def course_noise_max_rad(self) -> float:
        """The widest course noise the network learns."""
        return self.domain["course_noise_rad"][1]

    def inputs(self) -> tuple[Input, ...]:
        """The columns with unit and frame, as the metadata state them."""
        return tuple(Input(name, _unit(name), _frame(name), *self.domain[name]) for name in COLUMNS)


def load(path: Path) -> Spec:
    """Read and validate; raises `ConfigError` naming the key."""
    try:
        return msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), Spec)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}; give an existing models/NAME.toml") from None
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, ValueError) as error:
        raise ConfigError(f"{path}: {error}") from None


def _unit(name: str) -> str:
    return {"m": "m", "s": "s", "rad": "rad", "mps": "m/s"}[name.rsplit("_", 1)[1]]


def _frame(name: str) -> str:
    if name in ("north_m", "east_m"):
        return "local north-east, vehicle minus the ship's reported antenna position"
    if name in ("course_rad", "heading_rad"):
        return "clockwise from true north"
    if name in ("bow_m", "stern_m", "port_m", "starboard_m"):
        return "hull, from the antenna"
    return ""
