"""Make the certificate of a support model: `companion certify MODEL`.

The learned weights are read back from the ONNX file itself and enclosed by interval arithmetic with
branch and bound (`models.bounds`, `models.turning_bounds`); `companion.planning.certificate` proves it
again another way.
"""

import hashlib
from pathlib import Path

import msgspec
import numpy as np

from companion.errors import ModelError
from companion.planning import certificate
from companion.planning.certificate import Certificate
from companion.planning.model_file import METADATA_KEY, TURNING, Metadata, decode_metadata, read_bytes
from companion.planning.onnx_weights import float_constants, metadata_text
from companion.planning.turning_proof import learned_mean_cosine
from models import turning_bounds
from models.bounds import enclose
from models.layers import Layers, mirrored

CELL_WIDTH = 1e-7
SLACK = 1e-7  # the checker's method is a little looser than ours
TURNING_CELL_WIDTH = 1e-7
TURNING_SLACK = 1e-7
ROUNDING = (
    "weights are float32; supports are raised and distances lowered by the margins of the model's "
    "TOML file, which exceed the float32 errors measured through onnxruntime"
)


def run(path: Path) -> Certificate:
    """Enclose, write NAME.certificate.json beside the model, and check it; raises `ModelError`."""
    origin, content = read_bytes(path)
    metadata = decode_metadata(metadata_text(content, METADATA_KEY), origin)
    if metadata.kind == "support":
        made = _support(content, metadata, origin)
    elif metadata.kind == TURNING:
        made = _turning(content, metadata, origin)
    else:
        raise ModelError(f"'{origin}' is a {metadata.kind} network: only a support network can be certified")
    target = Path(path).with_suffix(certificate.SUFFIX)
    target.write_bytes(msgspec.json.format(msgspec.json.encode(made.sealed()), indent=2) + b"\n")
    return certificate.check(path)


def _support(content: bytes, metadata: Metadata, origin: str) -> Certificate:
    layers, grid = learned_layers(content)
    widest = metadata.range_of("course_noise_rad").high
    proven = enclose(layers, grid, widest, CELL_WIDTH)
    _refuse_below(proven.low.min(), "support", origin)
    eps = float(proven.high.max()) + SLACK
    return Certificate(
        schema=certificate.SCHEMA,
        model=metadata.name,
        model_sha256=hashlib.sha256(content).hexdigest(),
        property=(
            "0 <= learned - true support <= eps * reach in every grid direction, hence predicted distance "
            "<= true distance at any position"
        ),
        domain={i.name: (i.low, i.high) for i in metadata.inputs},
        conditions=(
            "speed_mps >= speed_noise_mps",
            "until_age_s >= age_s",
            "a hull of unknown heading comes as its circle: no corners, its radius in position_error_m",
        ),
        grid=grid,
        course_noise_max_rad=widest,
        eps_per_metre_of_reach=eps,
        eps_m=stated_eps(eps, metadata),
        rounding=ROUNDING,
        method="interval arithmetic of slopes, mean-value form, branch and bound over the course noise",
        cells=proven.cells,
    )


def _turning(content: bytes, metadata: Metadata, origin: str) -> Certificate:
    inner, offset, outer, constant, most_above = learned_mean_cosine(content)
    layers = Layers((inner, outer[:, None]), (offset, np.array([constant])))
    proven = turning_bounds.enclose(layers, TURNING_CELL_WIDTH)
    _refuse_below(proven.low, "mean cosine", origin)
    per_metre = 2 * (proven.high + TURNING_SLACK) + most_above
    return Certificate(
        schema=certificate.SCHEMA,
        model=metadata.name,
        model_sha256=hashlib.sha256(content).hexdigest(),
        property=(
            "0 <= learned - true support <= eps * reach of every slab in time in every direction, hence "
            "predicted distance <= true distance at any position"
        ),
        domain={i.name: (i.low, i.high) for i in metadata.inputs},
        conditions=(
            "speed_mps >= speed_noise_mps",
            "all courses possible until the end lie within half a turn",
        ),
        eps_per_metre_of_reach=per_metre,
        eps_m=stated_eps(per_metre, metadata),
        rounding=ROUNDING,
        method="interval arithmetic of second derivatives, branch and bound over both angles of a sweep",
        cells=proven.cells,
    )


def _refuse_below(low: float, what: str, origin: str) -> None:
    if low < 0:
        raise ModelError(
            f"'{origin}' cannot be certified: its learned {what} falls {-low:.3g} below the true one; "
            "train it again"
        )


def learned_layers(content: bytes) -> tuple[Layers, int]:
    """The learned network of an ONNX file, its last layer cut to the directions in [0, pi]; and K."""
    constants = float_constants(content)
    count = sum(1 for name in constants if name.startswith("weight"))
    weights = [constants[f"weight{i}"] for i in range(count)]
    biases = [constants[f"bias{i}"].ravel() for i in range(count)]
    grid = weights[-1].shape[1]
    half = grid // 2 + 1
    served = mirrored(grid)
    if not ((weights[-1] == weights[-1][:, served]).all() and (biases[-1] == biases[-1][served]).all()):
        raise ModelError("the last layer is not the same for both sides of the course: not our network")
    return Layers((*weights[:-1], weights[-1][:, :half]), (*biases[:-1], biases[-1][:half])), grid


def stated_eps(eps: float, metadata: Metadata) -> dict[str, float]:
    """eps in metres at the farthest reach of parts of the domain worth a name."""
    fastest = metadata.range_of("speed_mps").high + metadata.range_of("speed_noise_mps").high
    longest = max(metadata.range_of("age_s").high, metadata.range_of("until_age_s").high)
    return {
        "the paper's ship, 5 m/s, T = 600 s": eps * 600 * 5.05,
        "speed 0.5-12 m/s with 0.05 m/s noise, T = 600 s": eps * 600 * 12.05,
        "the whole domain": eps * fastest * longest,
    }
