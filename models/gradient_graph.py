"""The gradient network as an ONNX graph with the same inputs and outputs as the support network.

The distance is what the learned force says: eq. (8) solved for d; where the force is saturated it says
no more than "nearer than the gap", taken as delta.
"""

import numpy as np
import onnx

from companion.planning.field import SINGULAR_GAP_M
from companion.planning.rows import COLUMNS, TURNING_COLUMNS
from models.gradient import FEATURES, Dense
from models.onnx_graph import GraphBuilder

LEAST_FORCE = 1e-9


def build(
    dense: Dense, delta_m: float, k_r: float, floor: float, metadata: dict[str, str]
) -> onnx.ModelProto:
    """`contacts` (n, 15 or 17) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    g = GraphBuilder()
    turns = len(dense.weights[0]) > FEATURES
    columns = TURNING_COLUMNS if turns else COLUMNS
    column = dict(zip(columns, g.split("contacts", [1] * len(columns)), strict=True))
    cos, sin = g.op("Cos", column["course_rad"]), g.op("Sin", column["course_rad"])
    north, east = column["north_m"], column["east_m"]
    x = g.op("Add", g.op("Mul", north, cos), g.op("Mul", east, sin))
    y = g.op("Sub", g.op("Mul", east, cos), g.op("Mul", north, sin))
    rate = [column["turn_rate_radps"]] if turns else []
    features = g.op("Concat", x, y, column["age_s"], *rate, axis=1)
    scale = np.array([[1 / dense.length_m, 1 / dense.length_m, 1 / dense.time_s] + [dense.time_s] * turns])
    tensor = g.cast32(g.op("Mul", features, g.constant(scale)))
    last = len(dense.weights) - 1
    for i, (weight, bias) in enumerate(zip(dense.weights, dense.biases, strict=True)):
        w = g.constant(weight, np.float32, name=f"weight{i}")
        b = g.constant(bias, np.float32, name=f"bias{i}")
        tensor = g.op("Gemm", tensor, w, b)
        tensor = tensor if i == last else g.op("Relu", tensor)
    vector = g.cast64(tensor)
    length = g.op("ReduceL2", vector, g.index([1]), keepdims=1)
    unit = g.op("Div", vector, g.op("Max", length, g.constant(1e-12)))
    unit_x, unit_y = g.split(unit, [1, 1])
    turned_north = g.op("Sub", g.op("Mul", unit_x, cos), g.op("Mul", unit_y, sin))
    turned_east = g.op("Add", g.op("Mul", unit_x, sin), g.op("Mul", unit_y, cos))
    away = g.op("Concat", turned_north, turned_east, axis=1, output="away")
    grown = g.op("Sub", g.op("Exp", g.op("Mul", length, g.constant(dense.top))), g.constant(1.0))
    force = g.op("Max", g.op("Mul", grown, g.constant(floor)), g.constant(LEAST_FORCE))
    g.op("Mul", away, force, output="repulsion")
    gap = g.op("Pow", g.op("Div", g.constant(k_r), force), g.constant(1 / 3))
    is_saturated = g.op("LessOrEqual", gap, g.constant(1.02 * SINGULAR_GAP_M))
    gap = g.op("Where", is_saturated, g.constant(0.0), gap)
    g.op("Squeeze", g.op("Add", gap, g.constant(delta_m)), g.index([1]), output="distance_m")
    return g.model(
        {"contacts": ("n", len(columns))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )
