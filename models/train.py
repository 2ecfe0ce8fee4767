"""From a model's TOML file to its ONNX file: `companion train models/NAME.toml`."""

import platform
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import torch

from companion.planning.field import SINGULAR_GAP_M
from companion.planning.model_file import METADATA_KEY, SCHEMA, UNKNOWN_HEADING_RAD, Metadata
from models import evaluate, shape
from models.bounds import Enclosure, enclose
from models.spec import Spec, load
from models.support_graph import Constants, Layers, build

CELL_WIDTH = 1e-7  # how tightly the learned support is enclosed, per metre of reach

Progress = Callable[[str, float], None]


def _silent(stage: str, done: float) -> None:
    del stage, done


def run(path: Path, progress: Progress = _silent) -> Path:
    """Train, prove, export and measure the model of one TOML file; returns the ONNX file's path."""
    spec = load(path)
    torch.set_num_threads(1)
    steps = spec.network.adam_steps
    learned = shape.train(
        spec.network, spec.course_noise_max_rad, spec.seed, lambda step, _: progress("train", step / steps)
    )
    progress("certify", 0.0)
    raw = enclose(learned, spec.network.grid, spec.course_noise_max_rad, CELL_WIDTH)
    layers = shape.raised(learned, np.maximum(-raw.low, 0.0) + spec.rounding.shape)
    proven = enclose(layers, spec.network.grid, spec.course_noise_max_rad, CELL_WIDTH)
    progress("evaluate", 0.0)
    error = evaluate.errors(export(spec, layers, proven, {}), spec)
    model = export(spec, layers, proven, error)
    target = path.with_suffix(".onnx")
    target.write_bytes(model.SerializeToString(deterministic=True))
    progress("done", 1.0)
    return target


def export(spec: Spec, layers: Layers, proven: Enclosure, error: dict[str, float]) -> onnx.ModelProto:
    """The ONNX model with its metadata inside."""
    constants = Constants(
        delta_m=spec.field.delta_m,
        k_r=spec.field.k_r,
        singular_gap_m=SINGULAR_GAP_M,
        grid=spec.network.grid,
        course_noise_max_rad=spec.course_noise_max_rad,
        unknown_heading_rad=UNKNOWN_HEADING_RAD,
        margin_m=spec.rounding.margin_m,
        margin_relative=spec.rounding.margin_relative,
    )
    metadata = Metadata(
        schema=SCHEMA,
        name=spec.name,
        kind=spec.kind,
        inputs=spec.inputs(),
        outputs={
            "distance_m": "(n,) m, to the reachable tube, negative inside",
            "away": "(n, 2) unit vector, local north-east, from the tube to the vehicle",
            "repulsion": "(n, 2) m/s, K_r / (d - delta)^3 * away, eq. (8)",
        },
        output_sign="repulsion = -grad U_rep, away from the ship",
        delta_m=spec.field.delta_m,
        horizon_s=spec.field.horizon_s,
        k_r=spec.field.k_r,
        singular_gap_m=SINGULAR_GAP_M,
        conservative=bool(proven.low.min() >= 0),
        training_seed=spec.seed,
        error=error
        | {
            "support_low_per_metre_of_reach": float(proven.low.min()),
            "support_high_per_metre_of_reach": float(proven.high.max()),
        },
        software={
            "torch": str(torch.__version__),
            "onnx": onnx.__version__,
            "numpy": np.__version__,
            "python": platform.python_version(),
        },
    )
    return build(layers, constants, {METADATA_KEY: metadata.encode()})
