"""From a model's TOML file to its ONNX file: `companion train models/NAME.toml`.

Trains, measures, exports, certifies what can be certified, and writes the model card with its
pictures.  The same file gives the same weights; a training that was interrupted goes on.
"""

import platform
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import torch

from companion.planning.field import SINGULAR_GAP_M
from companion.planning.model_file import METADATA_KEY, SCHEMA, Metadata
from models import (
    card,
    certify,
    evaluate,
    gradient,
    gradient_graph,
    shape,
    spec,
    support_graph,
    turning_bounds,
    turning_graph,
    turning_shape,
)
from models.bounds import enclose
from models.checkpoint import Checkpoint
from models.loop import Progress

Build = Callable[[dict[str, str]], onnx.ModelProto]
OUTPUTS = {
    "distance_m": "(n,) m, to the reachable tube, negative inside",
    "away": "(n, 2) unit vector, local north-east, from the tube to the vehicle",
    "repulsion": "(n, 2) m/s, K_r / (d - delta)^3 * away, eq. (8)",
}


def silent(stage: str, done: float, word: str) -> None:
    """Progress nobody watches."""
    del stage, done, word


def run(path: Path, progress: Progress = silent) -> Path:
    """Make the ONNX file, certificate and card beside the TOML file; returns the ONNX file's path."""
    path = Path(path)
    settings = spec.load(path)
    torch.set_num_threads(1)
    checkpoint = Checkpoint(path)
    if isinstance(settings, spec.SupportSpec):
        export = _support(settings, checkpoint, progress)
    elif isinstance(settings, spec.TurningSpec):
        export = _turning(settings, checkpoint, progress)
    else:
        export = _gradient(settings, checkpoint, progress)
    progress("evaluate", 0.0, "")
    error = evaluate.errors(export({}).SerializeToString(), settings)
    target = path.with_suffix(".onnx")
    target.write_bytes(export(error).SerializeToString(deterministic=True))
    if not isinstance(settings, spec.GradientSpec):
        progress("certify", 0.0, f"distance p99 {error['distance_under_m_p99']:.3f} m")
        certify.run(target)
    progress("card", 0.0, "")
    card.write(target, settings)
    checkpoint.clear()
    progress("done", 1.0, f"{target}")
    return target


def _support(settings: spec.SupportSpec, checkpoint: Checkpoint, progress: Progress) -> "_Export":
    learned = shape.train(settings, checkpoint, progress)
    network, widest = settings.network, settings.course_noise_max_rad
    raw = enclose(learned, network.grid, widest, certify.CELL_WIDTH)
    layers = shape.raised(learned, np.maximum(-raw.low, 0.0) + settings.rounding.shape)
    constants = support_graph.Constants(
        delta_m=settings.field.delta_m,
        k_r=settings.field.k_r,
        singular_gap_m=SINGULAR_GAP_M,
        grid=network.grid,
        course_noise_max_rad=widest,
        heading_error_max_rad=settings.domain["heading_error_rad"][1],
        margin_m=settings.rounding.margin_m,
        margin_relative=settings.rounding.margin_relative,
    )
    return _Export(settings, lambda metadata: support_graph.build(layers, constants, metadata))


def _turning(settings: spec.TurningSpec, checkpoint: Checkpoint, progress: Progress) -> "_Export":
    learned = turning_shape.train(settings, checkpoint, progress)
    progress("bound", 0.0, "")
    raw, rounding = turning_bounds.enclose(learned, certify.TURNING_CELL_WIDTH), settings.rounding
    shift = max(-raw.low, 0.0) + rounding.shape
    layers = shape.raised(learned, np.array([shift]))
    moved = layers.biases[-1][0] - learned.biases[-1][0]
    constants = turning_graph.Constants(
        delta_m=settings.field.delta_m,
        k_r=settings.field.k_r,
        singular_gap_m=SINGULAR_GAP_M,
        most_above=float(raw.high + moved + certify.TURNING_SLACK + rounding.shape),
        margin_m=rounding.margin_m,
        margin_relative=rounding.margin_relative,
    )
    return _Export(settings, lambda metadata: turning_graph.build(layers, constants, metadata))


def _gradient(settings: spec.GradientSpec, checkpoint: Checkpoint, progress: Progress) -> "_Export":
    dense = gradient.train(settings, checkpoint, progress)
    field, floor = settings.field, settings.network.floor
    return _Export(
        settings,
        lambda metadata: gradient_graph.build(dense, field.delta_m, field.k_r, floor, metadata),
    )


class _Export:
    """Builds the ONNX model around the metadata, once the errors are known."""

    def __init__(self, settings: spec.Spec, build: Build) -> None:
        self._settings = settings
        self._build = build

    def __call__(self, error: dict[str, float]) -> onnx.ModelProto:
        settings = self._settings
        metadata = Metadata(
            schema=SCHEMA,
            name=settings.name,
            kind=str(settings.__struct_config__.tag),
            inputs=settings.inputs(),
            outputs=OUTPUTS,
            output_sign="repulsion = -grad U_rep, away from the ship",
            delta_m=settings.field.delta_m,
            horizon_s=settings.field.horizon_s,
            k_r=settings.field.k_r,
            singular_gap_m=SINGULAR_GAP_M,
            conservative=not isinstance(settings, spec.GradientSpec),
            training_seed=settings.seed,
            error=error,
            software={
                "torch": str(torch.__version__),
                "onnx": onnx.__version__,
                "numpy": np.__version__,
                "python": platform.python_version(),
            },
        )
        return self._build({METADATA_KEY: metadata.encode()})
