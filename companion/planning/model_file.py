"""What a model file says of itself, and the start-up check that it fits the configuration.

The metadata travel inside the ONNX file, one JSON text under the key `METADATA_KEY`.
"""

import math
from importlib import resources
from pathlib import Path

import msgspec

from companion.config import Config
from companion.errors import ModelError
from companion.planning.field import SINGULAR_GAP_M
from companion.planning.rows import COLUMNS, TURNING_COLUMNS

METADATA_KEY = "companion"
KEY = "repulsion.model"  # in the configuration
SCHEMA = 1
TURNING = "turning"
REMEDY = "train one with `companion train models/NAME.toml`, or set repulsion.kind = 'exact'"


class Input(msgspec.Struct, frozen=True):
    """One column of the network's input and the range it was made for."""

    name: str
    unit: str
    frame: str
    low: float
    high: float


class Metadata(msgspec.Struct, frozen=True, kw_only=True):
    """Everything a start-up needs to trust or refuse a model."""

    schema: int
    name: str
    kind: str  # "support", "turning" or "gradient"
    inputs: tuple[Input, ...]
    outputs: dict[str, str]  # name -> shape, unit and meaning
    output_sign: str
    delta_m: float
    horizon_s: float  # T: the longest the sets may reach from the report
    k_r: float
    singular_gap_m: float
    conservative: bool  # never claims more distance than there is
    training_seed: int
    error: dict[str, float]  # against the exact field
    software: dict[str, str]

    def encode(self) -> str:
        """JSON, keys sorted."""
        return msgspec.json.encode(self, order="sorted").decode()

    def range_of(self, column: str) -> Input:
        """The input of that name."""
        return next(i for i in self.inputs if i.name == column)

    def turns(self) -> bool:
        """Whether it is for ships that turn."""
        return len(self.inputs) == len(TURNING_COLUMNS)


def read_bytes(path_or_name: str | Path, suffix: str = ".onnx", key: str = KEY) -> tuple[str, bytes]:
    """(origin, content) of a model file, or of a packaged model given by its name.

    Another `suffix` reads the file of that ending beside the model; `key` is what an error names.
    """
    path = Path(path_or_name)
    packaged = resources.files("models") / f"{path_or_name}{suffix}"
    is_name = path.suffix != ".onnx" and path.name == str(path_or_name)
    try:
        content = packaged.read_bytes() if is_name else path.with_suffix(suffix).read_bytes()
        return str(path_or_name), content
    except OSError:
        folder = resources.files("models").iterdir()
        known = sorted(entry.name[:-5] for entry in folder if entry.name.endswith(".onnx"))
        raise ModelError(
            f"{key} = '{path_or_name}': no such file or packaged model; "
            f"give a path to an .onnx file or one of {', '.join(known) or '(none packaged)'}"
        ) from None


def decode_metadata(text: str | None, origin: str, key: str = KEY) -> Metadata:
    """The metadata of a loaded file; raises `ModelError` when the file is not one of ours."""
    if text is None:
        raise ModelError(f"{key} = '{origin}': an ONNX file without our metadata; {REMEDY}")
    try:
        metadata = msgspec.json.decode(text.encode(), type=Metadata)
    except msgspec.MsgspecError as error:
        raise ModelError(f"{key} = '{origin}': unreadable metadata: {error}; {REMEDY}") from None
    if metadata.schema != SCHEMA:
        raise ModelError(
            f"{key} = '{origin}': metadata schema {metadata.schema}, this release reads {SCHEMA}; {REMEDY}"
        )
    names = TURNING_COLUMNS if metadata.turns() else COLUMNS
    if tuple(i.name for i in metadata.inputs) != names or metadata.turns() < (metadata.kind == TURNING):
        raise ModelError(f"{key} = '{origin}': its input columns are not this release's; {REMEDY}")
    return metadata


def check_agreement(metadata: Metadata, config: Config, origin: str, key: str = KEY) -> None:
    """Raise `ModelError` naming the first key in which model and configuration differ."""
    field, contacts = config.field, config.contacts
    equal = (
        ("field.delta_m", field.delta_m, metadata.delta_m),
        ("field.k_r", field.k_r, metadata.k_r),
        ("the field's singular gap in metres", SINGULAR_GAP_M, metadata.singular_gap_m),
    )
    for name, ours, theirs in equal:
        if not math.isclose(ours, theirs, rel_tol=1e-9, abs_tol=1e-12):
            raise ModelError(
                f"{name} = {ours:g}, but {key} = '{origin}' was trained for {theirs:g}; "
                f"set it to {theirs:g}, or {REMEDY}"
            )
    if not field.horizon_s <= metadata.horizon_s:
        raise ModelError(
            f"field.horizon_s = {field.horizon_s:g}, but {key} = '{origin}' reaches "
            f"{metadata.horizon_s:g} s at most; lower it, or {REMEDY}"
        )
    for column, value in (
        ("speed_noise_mps", contacts.speed_noise_mps),
        ("course_noise_rad", contacts.course_noise_rad),
    ):
        allowed = metadata.range_of(column)
        if not allowed.low <= value <= allowed.high:
            raise ModelError(
                f"contacts.{column} = {value:g}, but {key} = '{origin}' was trained for "
                f"{allowed.low:g} to {allowed.high:g}; set it inside, or {REMEDY}"
            )
