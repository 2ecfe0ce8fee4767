"""The turning network as an ONNX graph: the nearest of many support networks, one for each slab in time.

    d = min over slabs of  max over directions n of  (n . p - h(n))

Each slab is convex; its support h is motion, learned (`turning_motion`), plus hull and position error in
closed form.  The directions are the tangents of the polygon `companion.reach.turning` puts around the
motion.  Each of them bounds the distance to the slab from below.  Between two neighbouring tangents the
polygon is a corner, whose support follows from theirs, so the best bracket is searched three times more.

A bound of every slab that is nowhere too long is a bound of their union: nothing but T >= truth is
needed for "never claims more distance than there is".
"""

from dataclasses import dataclass

import numpy as np
import onnx

from companion.planning.rows import TURNING_COLUMNS
from models import turning_motion, turning_slabs
from models.layers import Layers
from models.onnx_graph import GraphBuilder
from models.turning_slabs import DIRECTIONS, Slabs

PARTS = 6  # of a bracket in each search


@dataclass(frozen=True, slots=True)
class Constants:
    """What is fixed in the graph."""

    delta_m: float
    k_r: float
    singular_gap_m: float
    most_above: float  # greatest excess of the learned T, and of its rounding
    margin_m: float
    margin_relative: float


@dataclass(frozen=True, slots=True)
class Bracket:
    """A slab's best tangent and its neighbours, (1, N) each: angles between, supports, sines."""

    angle: str
    height: str
    after: tuple[str, str, str]
    before: tuple[str, str, str]


def build(layers: Layers, constants: Constants, metadata: dict[str, str]) -> onnx.ModelProto:
    """`contacts` (n, 17) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    g = GraphBuilder()
    s = turning_slabs.slabs(g, constants.margin_m, constants.margin_relative)
    motion = turning_motion.support(g, s, layers, constants.most_above)
    slack = _slack(g, s, g.op("Add", s.beside, s.middle), motion)
    best = g.op("ArgMax", slack, axis=0, keepdims=1)
    bracket = _bracket(g, s, motion, best)
    place, distance = _search(g, s, bracket, _between(g, 1.0))
    for width in (1 / PARTS, 1 / PARTS**2):
        place, distance = _search(g, s, bracket, g.op("Add", place, _between(g, width)))
    angle, _ = _polygon(g, s, bracket, place)
    _outputs(g, constants, s, distance, angle)
    return g.model(
        {"contacts": ("n", len(TURNING_COLUMNS))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )


def _between(g: GraphBuilder, width: float) -> str:
    """(2 PARTS - 1, 1) shares of the way to the neighbours, 0 among them."""
    return g.constant(width * np.arange(1 - PARTS, PARTS)[:, None] / PARTS, np.float32)


def _bracket(g: GraphBuilder, s: Slabs, motion: str, best: str) -> Bracket:
    count = g.index([[len(DIRECTIONS)]])

    def at(row: str) -> tuple[str, str]:
        return g.op("GatherElements", s.beside, row, axis=0), g.op("GatherElements", motion, row, axis=0)

    def neighbour(step: int, sign: float) -> tuple[str, str, str]:
        row = g.op("Mod", g.op("Add", best, g.index([[step + len(DIRECTIONS)]])), count)
        angle, height = at(row)
        gap = g.op("Mul", g.op("Mul", g.op("Sub", angle, here), s.side), _f32(g, sign))
        rounds = g.op("Floor", g.op("Mul", gap, _f32(g, 0.5 / np.pi)))
        gap = g.op("Sub", gap, g.op("Mul", rounds, _f32(g, 2 * np.pi)))
        return gap, height, g.op("Sin", gap)

    here, height = at(best)
    return Bracket(g.op("Add", here, s.middle), height, neighbour(1, 1.0), neighbour(-1, -1.0))


def _polygon(g: GraphBuilder, s: Slabs, bracket: Bracket, place: str) -> tuple[str, str]:
    """Angles and supports (P, N) of the polygon at `place` (P, N), -1 the tangent before, 1 the one after."""
    ahead = g.op("Relu", place)
    back = g.op("Sub", ahead, place)
    angle, height = bracket.angle, bracket.height
    for share, (gap, other, sine), sign in ((ahead, bracket.after, 1.0), (back, bracket.before, -1.0)):
        part = g.op("Mul", share, gap)
        # sin(gap - part) h + sin(part) h_other, over sin(gap), less h
        own = g.op("Sub", g.op("Sin", g.op("Sub", gap, part)), sine)
        lift = g.op("Add", g.op("Mul", own, bracket.height), g.op("Mul", g.op("Sin", part), other))
        height = g.op("Add", height, g.op("Div", lift, sine))
        angle = g.op("Add", angle, g.op("Mul", g.op("Mul", part, s.side), _f32(g, sign)))
    return angle, height


def _search(g: GraphBuilder, s: Slabs, bracket: Bracket, places: str) -> tuple[str, str]:
    """The best of some places in the bracket, (P, N) or (P, 1), and its slack; (1, N) both."""
    places = g.op("Max", g.op("Min", places, _f32(g, 1.0)), _f32(g, -1.0))
    slack = _slack(g, s, *_polygon(g, s, bracket, places))
    best = g.op("ArgMax", slack, axis=0, keepdims=1)
    places = g.op("Expand", places, g.op("Shape", slack))
    return (g.op("GatherElements", places, best, axis=0), g.op("GatherElements", slack, best, axis=0))


def _slack(g: GraphBuilder, s: Slabs, angle: str, motion: str) -> str:
    """(D, N) how far the vehicle is beyond the tangents of the slab in the directions `angle` (D, N).

    A hull's corner at distance r, turned by up to e, is c = r cos(angle between) toward a direction at the
    least turn.  Its support is r where the angle is at most e, and  c' = r cos(angle between - e)  beyond;
    both are  min(r, c' + max(c - r cos e, 0)),  since the cosine is concave.
    """
    x, y = g.op("Cos", angle), g.op("Sin", angle)
    toward = g.op("Add", g.op("Mul", x, s.x), g.op("Mul", y, s.y))
    reaches = []
    corners, radii = g.split(s.corners, [1] * 8, axis=0), g.split(s.radius, [1] * 4, axis=0)
    for i, radius in enumerate(radii):
        ahead, across = corners[i], corners[i + 4]
        cos = g.op("Add", g.op("Mul", x, ahead), g.op("Mul", y, across))
        sin = g.op("Abs", g.op("Sub", g.op("Mul", y, ahead), g.op("Mul", x, across)))
        turned = g.op("Add", g.op("Mul", cos, s.cos_swing), g.op("Mul", sin, s.sin_swing))
        within = g.op("Relu", g.op("Sub", cos, g.op("Mul", radius, s.cos_swing)))
        reaches.append(g.op("Min", radius, g.op("Add", turned, within)))
    hull = g.op("Add", g.op("Mul", g.op("Max", *reaches), s.known), g.op("Add", s.circle, s.margin))
    return g.op("Sub", g.op("Sub", toward, motion), hull)


def _outputs(g: GraphBuilder, c: Constants, s: Slabs, slack: str, angle: str) -> None:
    """The nearest slab's distance and direction, and eq. (8)'s force, in the north-east frame."""
    slack, angle = g.op("Reshape", slack, s.shape), g.op("Reshape", angle, s.shape)
    nearest = g.op("ArgMin", slack, axis=1, keepdims=1)
    distance = g.cast64(g.op("GatherElements", slack, nearest, axis=1))
    angle = g.op("Reshape", g.cast64(g.op("GatherElements", angle, nearest, axis=1)), g.index([-1]))
    bearing = g.op("Unsqueeze", g.op("Add", s.course, g.op("Mul", s.ship_side, angle)), g.index([1]))
    away = g.op("Concat", g.op("Cos", bearing), g.op("Sin", bearing), axis=1, output="away")
    gap = g.op("Max", g.op("Sub", distance, g.constant(c.delta_m)), g.constant(c.singular_gap_m))
    force = g.op("Div", g.constant(c.k_r), g.op("Mul", gap, g.op("Mul", gap, gap)))
    g.op("Mul", away, force, output="repulsion")
    g.op("Squeeze", distance, g.index([1]), output="distance_m")


def _f32(g: GraphBuilder, value: float) -> str:
    return g.constant(value, np.float32)
