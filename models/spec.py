"""A model's TOML file: all that its training depends on."""

import math
import tomllib
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from companion.errors import ConfigError
from companion.planning.model_file import Input
from companion.planning.rows import COLUMNS, TURNING_COLUMNS

Range = tuple[float, float]
Positive = Annotated[float, Meta(gt=0)]
Count = Annotated[int, Meta(gt=0)]


class Field(Struct, frozen=True, forbid_unknown_fields=True):
    """The constants the graph carries."""

    delta_m: Positive
    k_r: Positive
    horizon_s: Positive


class SupportNetwork(Struct, frozen=True, forbid_unknown_fields=True):
    """Size and training of a learned support function."""

    grid: Annotated[int, Meta(ge=8, multiple_of=4)]
    hidden: tuple[Count, ...]
    adam_steps: Count
    adam_rate: Positive
    samples: Count
    ridge: Positive


class TurningNetwork(Struct, frozen=True, forbid_unknown_fields=True):
    """Size and training of a learned mean cosine."""

    hidden: Count
    adam_steps: Count
    adam_rate: Positive
    samples: Count
    nodes: Annotated[int, Meta(ge=4)]
    fit_steps: Count


class GradientNetwork(Struct, frozen=True, forbid_unknown_fields=True):
    """Size and training of a network on the gradient itself, as the paper's."""

    layers: Count
    width: Count
    steps: Count
    batch: Count
    rate: Positive
    near_m: Positive  # training points lie log-uniformly from here ...
    far_m: Positive  # ... to here off the set
    floor: Positive  # forces are learned on the scale log(1 + force / floor)


class Rounding(Struct, frozen=True, forbid_unknown_fields=True):
    """Outward margins for float32."""

    shape: Positive
    margin_m: Positive
    margin_relative: Positive


class _Model(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind"):
    name: str
    seed: int
    about: str
    field: Field
    domain: dict[str, Range]

    def __post_init__(self) -> None:
        columns = TURNING_COLUMNS if isinstance(self, TurningSpec) else COLUMNS
        may_turn = isinstance(self, GradientSpec)
        if tuple(self.domain) != columns and not (may_turn and tuple(self.domain) == TURNING_COLUMNS):
            raise ValueError(f"domain must name exactly these columns, in order: {', '.join(columns)}")

    def inputs(self) -> tuple[Input, ...]:
        """The columns with unit and frame, as the metadata state them."""
        return tuple(Input(name, _unit(name), _frame(name), *limits) for name, limits in self.domain.items())


class SupportSpec(_Model, frozen=True, kw_only=True, tag="support"):
    """A network that learns the support function."""

    network: SupportNetwork
    rounding: Rounding

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.network.grid * self.course_noise_max_rad > 2 * math.pi:
            raise ValueError(
                f"network.grid = {self.network.grid}: a direction would lie between the beam and a flank's "
                f"normal; give at most 2 pi / {self.course_noise_max_rad:g}"
            )

    @property
    def course_noise_max_rad(self) -> float:
        """The widest course noise the network learns."""
        return self.domain["course_noise_rad"][1]


class TurningSpec(_Model, frozen=True, kw_only=True, tag="turning"):
    """A network for ships that turn: support functions, slab by slab."""

    network: TurningNetwork
    rounding: Rounding


class GradientSpec(_Model, frozen=True, kw_only=True, tag="gradient"):
    """A network that learns the gradient."""

    network: GradientNetwork


Spec = SupportSpec | TurningSpec | GradientSpec


def load(path: Path) -> Spec:
    """Read and validate; raises `ConfigError` naming the key."""
    try:
        spec: Spec = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), Spec)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}; give an existing models/NAME.toml") from None
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, ValueError) as error:
        raise ConfigError(f"{path}: {error}") from None
    if spec.name != path.stem:
        raise ConfigError(f"{path}: name = '{spec.name}' must be the file's own, '{path.stem}'")
    return spec


def _unit(name: str) -> str:
    return {"m": "m", "s": "s", "rad": "rad", "mps": "m/s", "radps": "rad/s"}[name.rsplit("_", 1)[1]]


def _frame(name: str) -> str:
    if name in ("north_m", "east_m"):
        return "local north-east, vehicle minus the ship's reported antenna position"
    if name == "turn_rate_radps":
        return "clockwise"
    if name in ("course_rad", "heading_rad"):
        return "clockwise from true north"
    if name in ("bow_m", "stern_m", "port_m", "starboard_m"):
        return "hull, from the antenna"
    return ""
