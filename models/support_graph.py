"""The support network of straight ships as an ONNX graph.

    d = max_k (n_k . p - h_k)        distance to a convex set, by its support values h_k

The set is the Minkowski sum of motion, hull and position error, so h_k is the sum of three supports.
In K directions fixed in the course frame the motion's support is learned: A N_k(w), where A is the
reach, until * (v + w_v) ahead, age * (v - w_v) astern, and w the course noise.  Directions that follow
the contact (`support_geometry`) have it in closed form, and so have hull and position error.

Each direction alone bounds the distance from below, so nothing but N >= truth is needed for "never
claims more distance than there is".

All is float32; few large operations, since each costs the runtime half a microsecond.  Points and
directions are (n, count, 2).
"""

from dataclasses import dataclass

import numpy as np
import onnx

from companion.planning.rows import COLUMNS
from models.layers import Layers, mirrored
from models.onnx_graph import GraphBuilder
from models.support_geometry import (
    FAR,
    POSITION,
    Hull,
    Motion,
    grid_directions,
    grid_reaches,
    normals,
    rays,
    tangents,
)
from models.support_terms import ONE, Linear, Plan, Vector, column, scalar, scaled

FOLLOWING = 24  # directions: 6 normals, 5 rays alone and 5 carried to the hull's ends, 8 tangents


@dataclass(frozen=True, slots=True)
class Constants:
    """What is fixed in the graph."""

    delta_m: float
    k_r: float
    singular_gap_m: float  # the force stays what it is at delta + this much when nearer
    grid: int  # K, a multiple of 4, at most 2 pi / course_noise_max_rad
    course_noise_max_rad: float
    heading_error_max_rad: float
    margin_m: float  # outward, for float32: a length, and a share of the far reach
    margin_relative: float


@dataclass(frozen=True, slots=True)
class _Places:
    """Names of the geometry's tensors (n, count, 2)."""

    points: str  # the vehicle; five of the motion; twelve of the hull
    ends: str  # of the hull's four arcs
    arcs: str  # one point of each arc: the motion's, then the hull's
    fixed: str  # directions: the grid's, then normals
    rays: str
    differences: str  # of radii squared, of neighbouring arcs
    smaller: str  # radii squared
    across: str  # a quarter turn on from the ends
    reach: str  # (n, K/2, 2)
    margin: str  # (n, 1, 2): taken off the distance, and off the gap to delta


def build(layers: Layers, constants: Constants, metadata: dict[str, str]) -> onnx.ModelProto:
    """`contacts` (n, 15) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    g = GraphBuilder()
    places, noise = _places(g, constants)
    units = _directions(g, places)
    far, radius = g.split(g.op("ReduceL2", places.arcs, g.index([2]), keepdims=1), [1, 4])
    vehicle, motion, ends, meeting = g.split(_dot(g, places.points, units), [1, 5, 8, 4])
    closed = g.op("Min", _most(g, motion), far)
    _, closed = g.split(closed, [constants.grid, FOLLOWING], axis=2)
    learned = g.op("Mul", places.reach, _learned(g, noise, layers, constants.grid))
    learned = g.op("Reshape", learned, g.index([0, 1, constants.grid]))
    slack = g.op("Sub", vehicle, g.op("Concat", learned, closed, axis=2))
    hull = g.op("Max", _most(g, ends), _most(g, g.op("Min", meeting, radius)))
    _outputs(g, constants, g.op("Sub", slack, hull), units, places.margin)
    return g.model(
        {"contacts": ("n", len(COLUMNS))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )


def _places(g: GraphBuilder, c: Constants) -> tuple[_Places, str]:
    """The geometry, and the course noise (n, 1) scaled to [-1, 1]."""
    motion, hull = Motion.of(c.course_noise_max_rad), Hull.of(c.heading_error_max_rad)
    # a share less of the position is outward when outside; inside the far reach's share is more
    vehicle = scaled(POSITION, 1 - c.margin_relative / 4)
    margin = scalar(column("position_error_m") + Linear(constant=c.margin_m)) + FAR * c.margin_relative
    reaches = grid_reaches(c.grid)
    groups: tuple[list[Vector], ...] = (
        [vehicle, *motion.corners, motion.meeting, *hull.ends, *hull.meeting],
        list(hull.ends),
        [motion.corners[0], *hull.ends[:4]],
        [*grid_directions(c.grid), *normals(motion, hull)],
        rays(motion),
        *tangents(hull),
        list(zip(reaches[::2], reaches[1::2], strict=True)),
        [(margin, margin + scalar(Linear(constant=c.delta_m)))],
    )
    plan = Plan([vector for group in groups for vector in group])
    scaled_noise = column("course_noise_rad") * (2 / c.course_noise_max_rad) + ONE * -1.0
    matrix, offset = (g.constant(part, np.float32) for part in plan.linear([scaled_noise]))
    m, counts = len(plan.products), [len(group) for group in groups]
    angle, a, b, noise = g.split(g.op("Gemm", g.cast32("contacts"), matrix, offset), [m, m, m, 1])
    products = g.op("Mul", g.op("Cos", angle), g.op("Mul", a, b))
    sums = g.op("MatMul", products, g.constant(plan.sums(), np.float32))
    vectors = g.op("Reshape", sums, g.index([0, sum(counts), 2]))
    return _Places(*g.split(vectors, counts)), noise


def _directions(g: GraphBuilder, places: _Places) -> str:
    """Unit vectors (n, K + FOLLOWING, 2), the grid's first."""
    # the end of the hull that lies farthest along a ray is the nearest to the vehicle
    farthest = g.op("ArgMax", _dot(g, places.rays, places.ends), axis=2)
    carried = g.op("Sub", places.rays, g.op("GatherND", places.ends, farthest, batch_dims=1))
    slope = g.op("Sqrt", g.op("Abs", g.op("Div", places.differences, places.smaller)))
    touching = g.op("Add", places.ends, g.op("Mul", slope, places.across))
    every = g.op("Concat", places.fixed, places.rays, carried, touching, axis=1)
    # a vector of no length would claim that the set ends at the vehicle, wherever that is
    every = g.op("Add", every, g.constant(1e-12, np.float32))
    return g.op("LpNormalization", every, axis=2, p=2)


def _learned(g: GraphBuilder, noise: str, layers: Layers, count: int) -> str:
    """(n, K/2, 2) the motion's support per metre of reach; a column serves both sides of the course."""
    tensor = noise
    last = len(layers.weights) - 1
    columns = mirrored(count)
    for i, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
        served = columns if i == last else np.arange(len(bias))
        w = g.constant(weight[:, served], np.float32, name=f"weight{i}")
        b = g.constant(bias[served], np.float32, name=f"bias{i}")
        tensor = g.op("Gemm", tensor, w, b)
        tensor = tensor if i == last else g.op("Tanh", tensor)
    return g.op("Reshape", tensor, g.index([0, count // 2, 2]))


def _dot(g: GraphBuilder, points: str, units: str) -> str:
    """(n, P, D) scalar products; onnxruntime takes the transpose into the product."""
    return g.op("MatMul", points, g.op("Transpose", units, perm=[0, 2, 1]))


def _most(g: GraphBuilder, values: str) -> str:
    """(n, 1, D) the greatest of (n, P, D)."""
    return g.op("ReduceMax", values, g.index([1]), keepdims=1)


def _outputs(g: GraphBuilder, c: Constants, slack: str, units: str, margins: str) -> None:
    """Distance, direction and eq. (8)'s force of the best direction."""
    best = g.op("ArgMax", slack, axis=2)
    away = g.op("GatherND", units, best, batch_dims=1)
    limits = g.op("Sub", g.op("ReduceMax", slack, g.index([2]), keepdims=1), margins)
    chosen = g.cast64(g.op("Squeeze", g.op("Concat", away, limits, axis=2), g.index([1])))
    away, distance, gap = g.split(chosen, [2, 1, 1], outputs=["away", "distance", "gap"])
    gap = g.op("Max", gap, g.constant(c.singular_gap_m))
    force = g.op("Pow", g.op("Div", g.constant(c.k_r ** (1 / 3)), gap), g.constant(3.0))
    g.op("Mul", away, force, output="repulsion")
    g.op("Squeeze", distance, g.index([1]), output="distance_m")
