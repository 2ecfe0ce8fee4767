"""The support network of straight ships as an ONNX graph.

    d = max_k (n_k . p - h_k)        distance to a convex set, by its support values h_k

The set is the Minkowski sum of motion, hull and position error, so h_k is the sum of three
supports.  Motion: the sector of velocities has one shape for all ships but for the course noise w,
so h_k = A (cos b_k + N_k(w)) where A is the reach, until * (v + w_v) ahead, age * (v - w_v) astern, and
b_k the direction from the course; N is the learned network, one correction per grid direction.  Hull
and position error have closed forms, and so have the directions of `support_directions.following`.

Each direction alone bounds the distance from below, so nothing but N >= truth is needed for "never
claims more distance than there is".  Between the best direction and any other the bound is sharpened by
h(a n1 + b n2) <= a h(n1) + b h(n2), a, b >= 0: the corner where two half planes meet.

What is measured from far away is computed in float64, the rest in float32; few large operations, since
each costs the runtime half a microsecond.
"""

from dataclasses import dataclass

import numpy as np
import onnx

from companion.planning.rows import COLUMNS
from models import support_directions, support_frame, support_hull
from models.layers import Layers
from models.onnx_graph import GraphBuilder
from models.support_frame import Frame

LEAST_SINE = 2e-3  # directions nearer than this lean less: float32 cannot tell where their lines meet


@dataclass(frozen=True, slots=True)
class Constants:
    """What is fixed in the graph."""

    delta_m: float
    k_r: float
    singular_gap_m: float  # the force stays what it is at delta + this much when nearer
    grid: int  # K, a multiple of 4, at most 2 pi / course_noise_max_rad
    course_noise_max_rad: float
    unknown_heading_rad: float  # above it the hull counts as its circumscribed circle
    margin_m: float  # outward, for float32: a length, and a share of reach and distance
    margin_relative: float


def build(layers: Layers, constants: Constants, metadata: dict[str, str]) -> onnx.ModelProto:
    """`contacts` (n, 15) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    g = GraphBuilder()
    frame = support_frame.frame(g, constants.course_noise_max_rad)
    hull = support_hull.hull(g, frame, constants.unknown_heading_rad)
    learned, ray = support_directions.grid(g, frame, hull, layers, constants.grid)
    closed, units = support_directions.following(g, frame, hull)
    units = g.op("Concat", units, ray, axis=1)
    x, y = g.split(units, [1, 1], axis=0)
    motion = g.op("Concat", closed, g.op("Unsqueeze", learned, g.index([0])), axis=1)
    rounding = g.op("Add", g.op("Mul", frame.far, _f32(g, constants.margin_relative)),
                    _f32(g, constants.margin_m))  # fmt: skip
    slack = g.op("Sub", g.op("Sub", motion, hull.support(g, x, y)), rounding)
    distance, *direction = _sharpened(g, slack, units, x, y)
    _outputs(g, constants, frame, g.op("Sub", distance, hull.circle), direction)
    return g.model(
        {"contacts": ("n", len(COLUMNS))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )


def _sharpened(g: GraphBuilder, slack: str, units: str, x: str, y: str) -> tuple[str, str, str]:
    """Distance and direction (1, 1, n): the best half plane, or its corner with another.

    `slack`, `x`, `y` (1, D, n), `units` (2, D, n).  With c and s the cosine and sine between the best
    direction and another, the corner lies  (slack - c best) / s  beside the best one.
    """
    best = g.op("ArgMax", slack, axis=1, keepdims=1)
    three = g.op("Concat", best, best, best, axis=0)
    chosen = g.op("GatherElements", g.op("Concat", units, slack, axis=0), three, axis=1)
    best_x, best_y, upright = g.split(chosen, [1, 1, 1], axis=0)  # (1, 1, n)
    cos = g.op("Add", g.op("Mul", x, best_x), g.op("Mul", y, best_y))
    sin = g.op("Sub", g.op("Mul", y, best_x), g.op("Mul", x, best_y))
    rise = g.op("Relu", g.op("Sub", slack, g.op("Mul", cos, upright)))
    square = g.op("Max", g.op("Mul", sin, sin), _f32(g, LEAST_SINE**2))
    beside = g.op("Div", g.op("Mul", rise, sin), square)
    most = g.op("ReduceMax", beside, g.index([1]), keepdims=1)
    least = g.op("ReduceMin", beside, g.index([1]), keepdims=1)
    is_starboard = g.op("Greater", g.op("Add", most, least), _f32(g, 0.0))
    lean = g.op("Where", is_starboard, most, least)
    sign = g.op("Sign", upright)
    lean = g.op("Mul", lean, g.op("Relu", sign))  # inside all half planes there is no corner
    length = g.op("Sqrt", g.op("Add", g.op("Mul", upright, upright), g.op("Mul", lean, lean)))
    upright, side = g.op("Div", upright, length), g.op("Div", lean, length)
    upright = g.op("Abs", upright)
    turned_x = g.op("Sub", g.op("Mul", upright, best_x), g.op("Mul", side, best_y))
    turned_y = g.op("Add", g.op("Mul", upright, best_y), g.op("Mul", side, best_x))
    return g.op("Mul", length, sign), turned_x, turned_y


def _outputs(g: GraphBuilder, c: Constants, frame: Frame, slack: str, direction: list[str]) -> None:
    """Distance, direction and eq. (8)'s force, back in the north-east frame."""
    rounding = g.op("Mul", g.op("Abs", slack), _f32(g, c.margin_relative))
    distance = g.op("Sub", g.cast64(g.op("Sub", slack, rounding)), frame.disc)
    x, y = (g.op("Squeeze", g.cast64(v), g.index([0])) for v in direction)
    away = g.op("Add", g.op("Mul", frame.along, x), g.op("Mul", frame.across, y))
    gap = g.op("Max", g.op("Sub", distance, g.constant(c.delta_m)), g.constant(c.singular_gap_m))
    force = g.op("Div", g.constant(c.k_r), g.op("Mul", gap, g.op("Mul", gap, gap)))
    g.op("Transpose", away, perm=[1, 0], output="away")
    g.op(
        "Transpose", g.op("Mul", away, g.op("Squeeze", force, g.index([0]))), perm=[1, 0], output="repulsion"
    )
    g.op("Squeeze", distance, g.index([0, 1]), output="distance_m")


def _f32(g: GraphBuilder, value: float) -> str:
    return g.constant(value, np.float32)
