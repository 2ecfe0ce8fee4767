"""The support network of straight ships as an ONNX graph.

    d = max_k (n_k . p - h_k)        distance to a convex set, by its support values h_k

The set is the Minkowski sum of motion, hull and position error, so h_k is the sum of three
supports.  Motion: the sector of velocities has one shape for all ships but for the course noise w,
so h_k = A (cos b_k + N_k(w)) where A is the far reach, until * (v + w_v), and b_k the direction
from the course; N is the learned network, one correction per grid direction.  Hull and position
error have closed forms.  Eleven more directions follow the contact: both flanks (90 degrees + w from
the course, where h = 0), the ray that meets the front arc, the edges and corners of the turned hull.

Each direction alone bounds the distance from below, so nothing but N >= truth is needed for "never
claims more distance than there is".  Between two grid directions the bound is sharpened by
h(a n1 + b n2) <= a h(n1) + b h(n2), a, b >= 0: the corner where two half planes meet.

Course frame: x along the course, y to starboard, origin at the reported antenna position.  What is
measured from far away is computed in float64, the rest in float32.
"""

from dataclasses import dataclass

import numpy as np
import onnx

from companion.planning.rows import COLUMNS
from models.layers import Layers, grid_angles, mirrored
from models.onnx_graph import GraphBuilder

TINY = 1e-6
LEAST_SINE = 2e-3  # directions nearer than this are one: float32 cannot tell where their lines meet
DYNAMIC = 11  # directions that follow the contact
CORNERS = (("bow_m", "starboard_m"), ("stern_m", "starboard_m"), ("stern_m", "port_m"), ("bow_m", "port_m"))

# Everything linear in a row is one product: angles first, then lengths, speeds and times.
LINEAR: tuple[tuple[str, dict[str, float]], ...] = (
    ("course", {"course_rad": 1}),
    ("noise", {"course_noise_rad": 1}),
    ("hull-", {"heading_rad": 1, "course_rad": -1, "heading_error_rad": -1}),
    ("hull0", {"heading_rad": 1, "course_rad": -1}),
    ("hull+", {"heading_rad": 1, "course_rad": -1, "heading_error_rad": 1}),
    ("bend", {"heading_error_rad": 1}),
    ("north", {"north_m": 1}),
    ("east", {"east_m": 1}),
    ("slow", {"speed_mps": 1, "speed_noise_mps": -1}),
    ("fast", {"speed_mps": 1, "speed_noise_mps": 1}),
    ("age", {"age_s": 1}),
    ("until", {"until_age_s": 1}),
    ("scaled", {"course_noise_rad": 1}),  # to [-1, 1]
    ("disc", {"position_error_m": 1}),  # plus the margin for rounding
    ("one", {}),
    ("error", {"heading_error_rad": 1}),
)
ANGLES = 6


@dataclass(frozen=True, slots=True)
class Constants:
    """What is fixed in the graph."""

    delta_m: float
    k_r: float
    singular_gap_m: float  # the force stays what it is at delta + this much when nearer
    grid: int  # K, a multiple of 4
    course_noise_max_rad: float
    unknown_heading_rad: float  # above it the hull counts as its circumscribed circle
    margin_m: float  # outward, for float32: a length, and a share of reach and distance
    margin_relative: float


def build(layers: Layers, constants: Constants, metadata: dict[str, str]) -> onnx.ModelProto:
    """`contacts` (n, 15) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    graph = _SupportGraph(constants)
    grid = graph.grid_direction(layers)
    dynamic = graph.dynamic_direction()
    graph.outputs(grid, dynamic)
    return graph.g.model(
        {"contacts": ("n", len(COLUMNS))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )


class _SupportGraph:
    """The graph under construction: attributes are names of tensors, (n, 1) unless said."""

    def __init__(self, constants: Constants) -> None:
        self.constants = constants
        self.g = GraphBuilder()
        self.zero, self.one = (self.g.constant([[v]], np.float32) for v in (0.0, 1.0))
        self._linear()
        self._frame()
        self._hull()

    def _linear(self) -> None:
        """`linear[name]` for each of `LINEAR`, sines and cosines of the angles, `corners` (n, 4, 2)."""
        g, c = self.g, self.constants
        names = [name for name, _ in LINEAR]
        matrix = np.zeros((len(COLUMNS), len(LINEAR) + 8))
        offset = np.zeros((1, len(LINEAR) + 8))
        for i, (_, terms) in enumerate(LINEAR):
            for column, factor in terms.items():
                matrix[COLUMNS.index(column), i] = factor
        for i, (along, across) in enumerate(CORNERS):
            matrix[COLUMNS.index(along), len(LINEAR) + 2 * i] = 1 if along == "bow_m" else -1
            matrix[COLUMNS.index(across), len(LINEAR) + 2 * i + 1] = 1 if across == "starboard_m" else -1
        matrix[:, names.index("scaled")] *= 2 / c.course_noise_max_rad
        offset[0, names.index("scaled")] = -1.0
        offset[0, names.index("disc")] = c.margin_m
        offset[0, names.index("one")] = 1.0
        linear = g.op("Add", g.op("MatMul", "contacts", g.constant(matrix)), g.constant(offset))
        angles, *rest = g.split(linear, [ANGLES] + [1] * (len(LINEAR) - ANGLES) + [8])
        self.linear = dict(zip(names[ANGLES:], rest, strict=False))
        self.corners = g.op("Reshape", g.cast32(rest[-1]), g.index([-1, 4, 2]))
        cos, sin = g.op("Cos", angles), g.op("Sin", angles)
        self.cos, cos32 = g.split(cos, [1, ANGLES - 1])
        self.sin, sin32 = g.split(sin, [1, ANGLES - 1])
        self.cos_noise, self.cos_hull, self.cos_bend = g.split(g.cast32(cos32), [1, 3, 1])
        self.sin_noise, self.sin_hull, _ = g.split(g.cast32(sin32), [1, 3, 1])

    def _frame(self) -> None:
        """The vehicle in the course frame and the reach along a ray, float32.

        `points` (n, 2, 2): the vehicle seen from the far and the near end; `reach` (n, 2, 1).
        """
        g, v = self.g, self.linear
        x = g.op("Add", g.op("Mul", v["north"], self.cos), g.op("Mul", v["east"], self.sin))
        y = g.op("Sub", g.op("Mul", v["east"], self.cos), g.op("Mul", v["north"], self.sin))
        far = g.op("Mul", g.op("Max", v["age"], v["until"]), v["fast"])
        near = g.op("Mul", v["age"], v["slow"])
        mixed = g.op("MatMul", g.op("Concat", x, y, far, near, axis=1), g.constant(np.array([
            [1, 0, 1, 0, 0, 0, 1, 0],
            [0, 1, 0, 1, 0, 0, 0, 1],
            [-1, 0, 0, 0, 1, 0, 0, 0],
            [0, 0, -1, 0, 0, 1, 0, 0],
        ])))  # fmt: skip
        points, self.far, self.near, self.vehicle = g.split(g.cast32(mixed), [4, 1, 1, 2])
        self.points = g.op("Reshape", points, g.index([-1, 2, 2]))
        self.reach = g.op("Reshape", g.op("Concat", self.far, self.near, axis=1), g.index([-1, 2, 1]))

    def _hull(self) -> None:
        """`hull` (n, 12, 2): each corner turned by heading - course and by -error, 0, +error.

        The middle one is moved out to where the tangents at the ends of the corner's arc meet;
        capped by `radius` (n, 4, 1) the three points have exactly the support of the arc.
        """
        g = self.g
        limit = g.constant([[self.constants.unknown_heading_rad]])
        is_circle = g.op("Greater", self.linear["error"], limit)
        shown = g.op("Where", is_circle, self.zero, self.one)
        radius = g.op("ReduceL2", self.corners, g.index([2]), keepdims=1)
        greatest = g.op("ReduceMax", radius, g.index([1, 2]), keepdims=0)
        self.circle = g.op("Where", is_circle, g.op("Unsqueeze", greatest, g.index([1])), self.zero)
        self.radius = g.op("Mul", radius, g.op("Unsqueeze", shown, g.index([2])))
        scale = g.op("Concat", shown, g.op("Div", shown, self.cos_bend), shown, axis=1)
        scaled = g.op("Concat", g.op("Mul", self.cos_hull, scale), g.op("Mul", self.sin_hull, scale), axis=1)
        turn = np.zeros((6, 2, 3, 2))
        for i in range(3):
            turn[i, 0, i, 0] = turn[i, 1, i, 1] = turn[3 + i, 0, i, 1] = 1.0
            turn[3 + i, 1, i, 0] = -1.0
        turned = g.op("MatMul", scaled, g.constant(turn.reshape(6, 12), np.float32))
        turned = g.op("Reshape", turned, g.index([-1, 2, 6]))
        self.hull = g.op("Reshape", g.op("MatMul", self.corners, turned), g.index([-1, 12, 2]))

    def _hull_support(self, rays: str, directions: int) -> str:
        """(n, directions) for rays (2, directions) or (n, 2, directions)."""
        g = self.g
        arcs = g.op("Reshape", g.op("MatMul", self.hull, rays), g.index([-1, 4, 3, directions]))
        corner = g.op("Min", g.op("ReduceMax", arcs, g.index([2]), keepdims=0), self.radius)
        return g.op("ReduceMax", corner, g.index([1]), keepdims=0)

    def grid_direction(self, layers: Layers) -> tuple[str, str]:
        """Slack and direction (n, 2) of the best of the K fixed ones, sharpened by its neighbour."""
        g, k = self.g, self.constants.grid
        angles = grid_angles(k)
        rays = g.constant(np.stack([np.cos(angles), np.sin(angles)]), np.float32)
        learned = g.op("Unsqueeze", self._corrections(layers), g.index([1]))
        slacks = g.op("Sub", g.op("MatMul", self.points, rays), g.op("Mul", self.reach, learned))
        motion = g.op("ReduceMin", slacks, g.index([1]), keepdims=0)
        slack = g.op("Sub", motion, self._hull_support(rays, k))  # (n, K)

        best = g.op("ArgMax", slack, axis=1, keepdims=0)
        ring = np.arange(k)
        three = g.op("Gather", g.index(np.stack([(ring - 1) % k, ring, (ring + 1) % k], axis=1)), best)
        before, here, after = g.split(g.op("GatherElements", slack, three, axis=1), [1, 1, 1])
        frame = np.stack([np.cos(angles), np.sin(angles), -np.sin(angles), np.cos(angles)], axis=1)
        ray, tangent = g.split(g.op("Gather", g.constant(frame, np.float32), best), [2, 2])
        step = 2 * np.pi / k
        # where two half planes meet: `lean` beside the better one, toward the other
        rise = g.op("Sub", g.op("Max", before, after), g.op("Mul", here, _f32(g, np.cos(step))))
        lean = g.op("Max", self.zero, g.op("Mul", rise, _f32(g, 1 / np.sin(step))))
        is_outside = g.op("Greater", here, _f32(g, TINY))
        lean = g.op("Where", is_outside, lean, self.zero)
        upright = g.op("Where", is_outside, here, self.one)
        length = g.op("Sqrt", g.op("Add", g.op("Mul", upright, upright), g.op("Mul", lean, lean)))
        side = g.op("Where", g.op("Greater", after, before), lean, g.op("Neg", lean))
        vector = g.op("Add", g.op("Mul", upright, ray), g.op("Mul", side, tangent))
        return g.op("Where", is_outside, length, here), g.op("Div", vector, length)

    def _corrections(self, layers: Layers) -> str:
        """(n, K) the learned N toward each grid direction; a column serves both sides of the course."""
        g = self.g
        tensor = g.cast32(self.linear["scaled"])
        last = len(layers.weights) - 1
        columns = mirrored(self.constants.grid)
        for i, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
            served = columns if i == last else np.arange(len(bias))
            w = g.constant(weight[:, served], np.float32, name=f"weight{i}")
            b = g.constant(bias[served], np.float32, name=f"bias{i}")
            tensor = g.op("Gemm", tensor, w, b)
            tensor = tensor if i == last else g.op("Tanh", tensor)
        return tensor

    def dynamic_direction(self) -> tuple[str, str]:
        """Slack and direction (n, 2) of the best of those that follow the contact."""
        g, n = self.g, DYNAMIC
        cos, sin = self.cos_noise, self.sin_noise
        edge_x, edge_y = self._edges()
        backward = g.op("Neg", sin)
        x = g.op("Concat", backward, backward, g.cast32(self.linear["one"]), edge_x, axis=1)
        y = g.op("Concat", cos, g.op("Neg", cos), self._front_slope(), edge_y, axis=1)
        rays = g.op("Reshape", g.op("Concat", x, y, axis=1), g.index([-1, 2, n]))
        rays = g.op("Div", rays, g.op("ReduceL2", rays, g.index([1]), keepdims=1))

        x, y = (g.op("Squeeze", part, g.index([1])) for part in g.split(rays, [1, 1]))
        within = g.op("Add", g.op("Mul", x, cos), g.op("Mul", g.op("Abs", y), sin))
        arc = g.op("Where", g.op("GreaterOrEqual", x, cos), self.one, within)
        motion = g.op("Max", g.op("Mul", self.far, arc), g.op("Mul", self.near, arc))
        support = g.op("Add", motion, self._hull_support(rays, n))
        vehicle_x, vehicle_y = g.split(self.vehicle, [1, 1])
        toward = g.op("Add", g.op("Mul", vehicle_x, x), g.op("Mul", vehicle_y, y))
        slack = g.op("Sub", toward, support)
        best = g.op("ArgMax", slack, axis=1, keepdims=1)
        chosen = (g.op("GatherElements", v, best, axis=1) for v in (slack, x, y))
        best_slack, best_x, best_y = chosen
        return best_slack, g.op("Concat", best_x, best_y, axis=1)

    def _front_slope(self) -> str:
        """y/x of the direction to p from the front arc's centre, carried to the hull's foremost corner."""
        g = self.g
        steepest = g.op("Div", self.sin_noise, self.cos_noise)
        other = g.op("Neg", steepest)

        def slope(point: str) -> str:
            x, y = g.split(point, [1, 1])
            ratio = g.op("Div", y, g.op("Max", x, self.one))
            return g.op("Min", g.op("Max", ratio, other), steepest)

        ray = g.op("Concat", g.cast32(self.linear["one"]), slope(self.vehicle), axis=1)
        forward = g.op("MatMul", self.hull, g.op("Unsqueeze", ray, g.index([2])))
        foremost = g.op("GatherND", self.hull, g.op("ArgMax", forward, axis=1, keepdims=0), batch_dims=1)
        return slope(g.op("Sub", self.vehicle, foremost))

    def _edges(self) -> tuple[str, str]:
        """(n, 8) x and y of outward normals: the four edges of the turned hull and its four corners'."""
        g = self.g
        normal = np.zeros((4, 3, 2, 2, 8))
        for i in range(4):
            following = (i + 1) % 4  # an edge runs from here, turned by +error, to there, by -error
            normal[following, 0, 1, 0, i], normal[i, 2, 1, 0, i] = 1.0, -1.0  # x = dy
            normal[following, 0, 0, 1, i], normal[i, 2, 0, 1, i] = -1.0, 1.0  # y = -dx
            normal[i, 1, 0, 0, 4 + i] = normal[i, 1, 1, 1, 4 + i] = 1.0  # the middle of a corner's arc
        flat = g.op("Reshape", self.hull, g.index([-1, 24]))
        both = g.op("MatMul", flat, g.constant(normal.reshape(24, 16), np.float32))
        away_from_zero = np.array([[TINY] * 8 + [0.0] * 8])
        x, y = g.split(g.op("Add", both, g.constant(away_from_zero, np.float32)), [8, 8])
        return x, y

    def _between(self, one: tuple[str, str], other: tuple[str, str]) -> tuple[str, str]:
        """Slack and direction of the corner where two half planes meet, or of the better one alone.

        Each is a slack (n, 1) and a unit direction (n, 2).
        """
        g = self.g
        is_one = g.op("Greater", one[0], other[0])
        better, worse = g.op("Max", one[0], other[0]), g.op("Min", one[0], other[0])
        ahead = g.op("Where", is_one, one[1], other[1])
        beside = g.op("Where", is_one, other[1], one[1])
        cos = g.op("ReduceSum", g.op("Mul", ahead, beside), g.index([1]), keepdims=1)
        across = g.op("Sub", beside, g.op("Mul", cos, ahead))
        sin = g.op("ReduceL2", across, g.index([1]), keepdims=1)
        rise = g.op("Sub", worse, g.op("Mul", better, cos))
        is_corner = g.op(
            "And",
            g.op("And", g.op("Greater", better, _f32(g, TINY)), g.op("Greater", rise, self.zero)),
            g.op("Greater", sin, _f32(g, LEAST_SINE)),
        )
        sin = g.op("Where", is_corner, sin, self.one)
        lean = g.op("Where", is_corner, g.op("Div", rise, sin), self.zero)
        upright = g.op("Where", is_corner, better, self.one)
        length = g.op("Sqrt", g.op("Add", g.op("Mul", upright, upright), g.op("Mul", lean, lean)))
        turned = g.op("Mul", across, g.op("Div", lean, sin))
        vector = g.op("Div", g.op("Add", g.op("Mul", upright, ahead), turned), length)
        return g.op("Where", is_corner, length, better), vector

    def outputs(self, grid: tuple[str, str], dynamic: tuple[str, str]) -> None:
        """Distance, direction and eq. (8)'s force, back in the north-east frame."""
        g, c = self.g, self.constants
        slack, direction = self._between(grid, dynamic)
        rounding = g.op("Mul", g.op("Add", self.far, g.op("Abs", slack)), _f32(g, c.margin_relative))
        slack = g.cast64(g.op("Sub", g.op("Sub", slack, self.circle), rounding))
        x, y = g.split(g.cast64(direction), [1, 1])
        distance = g.op("Sub", slack, self.linear["disc"])
        north = g.op("Sub", g.op("Mul", x, self.cos), g.op("Mul", y, self.sin))
        east = g.op("Add", g.op("Mul", x, self.sin), g.op("Mul", y, self.cos))
        away = g.op("Concat", north, east, axis=1, output="away")
        gap = g.op("Max", g.op("Sub", distance, g.constant(c.delta_m)), g.constant(c.singular_gap_m))
        force = g.op("Div", g.constant(c.k_r), g.op("Mul", gap, g.op("Mul", gap, gap)))
        g.op("Mul", away, force, output="repulsion")
        g.op("Squeeze", distance, g.index([1]), output="distance_m")


def _f32(g: GraphBuilder, value: float) -> str:
    return g.constant(value, np.float32)
