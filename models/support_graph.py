"""The support network of straight ships as an ONNX graph.

    d = max_k (n_k . p - h_k)        distance to a convex set, by its support values h_k

The set is the Minkowski sum of motion, hull and position error, so h_k is the sum of three
supports.  Motion: the sector of velocities has one shape for all ships but for the course noise w,
so h_k = A (cos b_k + N_k(w)) where A is the far reach, until * (v + w_v), and b_k the direction
from the course; N is the learned network, one correction per grid direction.  Hull and position
error have closed forms.  Seven more directions follow the contact: both flanks (90 degrees + w from
the course, where h = 0), the ray that meets the front arc, and the four edges of the turned hull.

Each direction alone bounds the distance from below, so nothing but N >= truth is needed for "never
claims more distance than there is".  Between two grid directions the bound is sharpened by
h(a n1 + b n2) <= a h(n1) + b h(n2), a, b >= 0: the corner where two half planes meet.

Course frame: x along the course, y to starboard, origin at the reported antenna position.  What
may be kilometres long is computed in float64, the wide part (n, K) in float32.
"""

from dataclasses import dataclass

import numpy as np
import onnx
from numpy.typing import NDArray

from companion.messages import FloatArray
from companion.planning.rows import COLUMNS
from models.onnx_graph import GraphBuilder

TINY = 1e-9
DYNAMIC = 7  # directions that follow the contact


@dataclass(frozen=True, slots=True)
class Layers:
    """The learned network: w scaled to [-1, 1], tanh layers, a linear one to K/2 + 1 corrections."""

    weights: tuple[FloatArray, ...]  # each (inputs, outputs)
    biases: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True)
class Constants:
    """What is fixed in the graph."""

    delta_m: float
    k_r: float
    singular_gap_m: float  # the force stays what it is at delta + this much when nearer
    grid: int  # K, a multiple of 4
    course_noise_max_rad: float
    heading_error_limit_rad: float  # above it the hull counts as its circumscribed circle
    margin_m: float  # outward, for float32


def grid_angles(grid: int) -> FloatArray:
    """(K,) the grid directions, radians from the course, clockwise."""
    return np.arange(grid) * (2 * np.pi / grid)


def mirrored(grid: int) -> NDArray[np.int64]:
    """(K,) which of the K/2 + 1 learned outputs serves each grid direction."""
    k = np.arange(grid)
    return np.minimum(k, grid - k)


def build(layers: Layers, constants: Constants, metadata: dict[str, str]) -> onnx.ModelProto:
    """`contacts` (n, 15) -> `distance_m` (n,), `away` (n, 2), `repulsion` (n, 2); all float64."""
    graph = _SupportGraph(constants)
    graph.grid_direction(layers)
    graph.dynamic_direction()
    graph.outputs()
    return graph.g.model(
        {"contacts": ("n", len(COLUMNS))},
        {"distance_m": ("n",), "away": ("n", 2), "repulsion": ("n", 2)},
        metadata,
    )


class _SupportGraph:
    """The graph under construction: attributes are names of tensors, (n, 1) unless said."""

    def __init__(self, constants: Constants) -> None:
        self.constants = constants
        self.g = g = GraphBuilder()
        self.column = dict(zip(COLUMNS, g.split("contacts", [1] * len(COLUMNS)), strict=True))
        self.zero, self.one = g.constant([[0.0]]), g.constant([[1.0]])
        self._frame()
        self._reach()
        self._hull()

    def _frame(self) -> None:
        """x, y: the vehicle in the course frame."""
        g, north, east = self.g, self.column["north_m"], self.column["east_m"]
        self.cos, self.sin = g.op("Cos", self.column["course_rad"]), g.op("Sin", self.column["course_rad"])
        self.x = g.op("Add", g.op("Mul", north, self.cos), g.op("Mul", east, self.sin))
        self.y = g.op("Sub", g.op("Mul", east, self.cos), g.op("Mul", north, self.sin))

    def _reach(self) -> None:
        """far, near: greatest and least signed distance run; near < 0 where a ship may drift astern."""
        g, speed, noise = self.g, self.column["speed_mps"], self.column["speed_noise_mps"]
        age = self.column["age_s"]
        until = g.op("Max", age, self.column["until_age_s"])
        slow = g.op("Sub", speed, noise)
        self.far = g.op("Mul", until, g.op("Add", speed, noise))
        self.near = g.op("Min", g.op("Mul", age, slow), g.op("Mul", until, slow))

    def _hull(self) -> None:
        """Corners turned by heading - course, and by the heading error either way.

        `hull_x`, `hull_y` (n, 12): turned by -error, by 0 (and moved out to where the tangents at
        the ends of the corner's arc meet), by +error; capped by `radius` (n, 4, 1) a corner's three
        points have exactly the support of its arc.
        """
        g, error = self.g, self.column["heading_error_rad"]
        corners = np.zeros((len(COLUMNS), 8))
        order = (("bow_m", "starboard_m"), ("stern_m", "starboard_m"), ("stern_m", "port_m"), ("bow_m", "port_m"))
        for i, (along, across) in enumerate(order):
            corners[COLUMNS.index(along), i] = 1.0 if along == "bow_m" else -1.0
            corners[COLUMNS.index(across), 4 + i] = 1.0 if across == "starboard_m" else -1.0
        corner = g.op("MatMul", "contacts", g.constant(corners))
        corner_x, corner_y = g.split(corner, [4, 4])
        radius = g.op("Sqrt", g.op("Add", g.op("Mul", corner_x, corner_x), g.op("Mul", corner_y, corner_y)))
        is_circle = g.op("Greater", error, g.constant([[self.constants.heading_error_limit_rad]]))
        greatest = g.op("ReduceMax", radius, g.index([1]), keepdims=1)
        self.circle = g.op("Where", is_circle, greatest, self.zero)
        shown = g.op("Where", is_circle, self.zero, self.one)
        self.radius = g.op("Unsqueeze", g.op("Mul", radius, shown), g.index([2]))

        error = g.op("Mul", error, shown)
        offset = g.op("Sub", self.column["heading_rad"], self.column["course_rad"])
        angles = g.op("Concat", g.op("Sub", offset, error), offset, g.op("Add", offset, error), axis=1)
        outward = g.op("Div", shown, g.op("Cos", error))
        scale = g.op("Unsqueeze", g.op("Concat", shown, outward, shown, axis=1), g.index([2]))
        cos = g.op("Mul", g.op("Unsqueeze", g.op("Cos", angles), g.index([2])), scale)
        sin = g.op("Mul", g.op("Unsqueeze", g.op("Sin", angles), g.index([2])), scale)
        cx, cy = g.op("Unsqueeze", corner_x, g.index([1])), g.op("Unsqueeze", corner_y, g.index([1]))
        flat = g.index([-1, 12])
        self.hull_x = g.op("Reshape", g.op("Sub", g.op("Mul", cos, cx), g.op("Mul", sin, cy)), flat)
        self.hull_y = g.op("Reshape", g.op("Add", g.op("Mul", sin, cx), g.op("Mul", cos, cy)), flat)

    def _hull_support(self, products: str, directions: int, radius: str) -> str:
        """(n, directions) from the products (n, 12, directions) of hull points and directions."""
        g = self.g
        arcs = g.op("Reshape", products, g.index([-1, 3, 4, directions]))
        corner = g.op("Min", g.op("ReduceMax", arcs, g.index([1]), keepdims=0), radius)
        return g.op("ReduceMax", corner, g.index([1]), keepdims=0)

    def grid_direction(self, layers: Layers) -> None:
        """The best of the K fixed directions, sharpened by its better neighbour."""
        g, k = self.g, self.constants.grid
        angles = grid_angles(k)
        rays = g.constant(np.stack([np.cos(angles), np.sin(angles)]), np.float32)
        learned = g.op("Reshape", self._corrections(layers), g.index([-1, 3, k]))
        back = g.op("Sub", self.x, self.near)
        ahead = g.op("Sub", self.x, self.far)
        points = g.op("Concat", ahead, self.y, back, self.y, back, self.y, axis=1)
        points = g.op("Reshape", g.cast32(points), g.index([-1, 3, 2]))
        reach = g.cast32(g.op("Concat", self.far, self.near, g.op("Neg", self.near), axis=1))
        reach = g.op("Unsqueeze", reach, g.index([2]))
        slacks = g.op("Sub", g.op("MatMul", points, rays), g.op("Mul", reach, learned))
        hull = g.op("Concat", *(g.op("Unsqueeze", v, g.index([2])) for v in (self.hull_x, self.hull_y)), axis=2)
        products = g.op("MatMul", g.cast32(hull), rays)
        support = self._hull_support(products, k, g.cast32(self.radius))
        slack = g.op("Sub", g.op("ReduceMin", slacks, g.index([1]), keepdims=0), support)  # (n, K)

        best = g.op("ArgMax", slack, axis=1, keepdims=0)
        ring = np.arange(k)
        three = g.op("Gather", g.index(np.stack([(ring - 1) % k, ring, (ring + 1) % k], axis=1)), best)
        before, here, after = g.split(g.cast64(g.op("GatherElements", slack, three, axis=1)), [1, 1, 1])
        ray = g.op("Gather", g.constant(np.stack([np.cos(angles), np.sin(angles)], axis=1)), best)
        ray_x, ray_y = g.split(ray, [1, 1])
        step = 2 * np.pi / k
        side = g.op("Where", g.op("Greater", after, before), self.one, g.constant([[-1.0]]))
        rise = g.op("Sub", g.op("Max", before, after), g.op("Mul", here, g.constant(np.cos(step))))
        is_outside = g.op("Greater", here, g.constant([[TINY]]))
        lean = g.op("Max", self.zero, g.op("Mul", rise, g.constant(1 / np.sin(step))))
        lean = g.op("Where", is_outside, g.op("Mul", lean, side), self.zero)
        upright = g.op("Where", is_outside, here, self.one)
        length = g.op("Sqrt", g.op("Add", g.op("Mul", upright, upright), g.op("Mul", lean, lean)))
        self.grid_slack = g.op("Where", is_outside, length, here)
        self.grid_x = g.op("Div", g.op("Sub", g.op("Mul", upright, ray_x), g.op("Mul", lean, ray_y)), length)
        self.grid_y = g.op("Div", g.op("Add", g.op("Mul", upright, ray_y), g.op("Mul", lean, ray_x)), length)

    def _corrections(self, layers: Layers) -> str:
        """(n, 3 K) N toward each direction twice, for far and near reach, and N toward its opposite."""
        g, k = self.g, self.constants.grid
        once = mirrored(k)
        columns = np.concatenate([once, once, np.roll(once, k // 2)])
        scaled = g.op("Mul", self.column["course_noise_rad"], g.constant(2 / self.constants.course_noise_max_rad))
        tensor = g.cast32(g.op("Sub", scaled, self.one))
        last = len(layers.weights) - 1
        for i, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
            w = g.constant(weight, np.float32, name=f"weight{i}")
            b = g.constant(bias, np.float32, name=f"bias{i}")
            if i == last:
                w = g.op("Gather", w, g.index(columns), axis=1)
                b = g.op("Gather", b, g.index(columns), axis=0)
            tensor = g.op("Add", g.op("MatMul", tensor, w), b)
            tensor = tensor if i == last else g.op("Tanh", tensor)
        return tensor

    def dynamic_direction(self) -> None:
        """The best of the seven directions that follow the contact, in float64 throughout."""
        g, n = self.g, DYNAMIC
        cos_w = g.op("Cos", self.column["course_noise_rad"])
        sin_w = g.op("Sin", self.column["course_noise_rad"])
        flank_x, flank_y = self._flank(cos_w, sin_w)
        radial_x, radial_y = self._radial(g.op("Div", sin_w, cos_w))
        edge_x, edge_y = self._edges()
        nx = g.op("Concat", flank_x, flank_x, radial_x, edge_x, axis=1)
        ny = g.op("Concat", flank_y, g.op("Neg", flank_y), radial_y, edge_y, axis=1)

        along, across = g.op("Mul", nx, cos_w), g.op("Mul", g.op("Abs", ny), sin_w)
        ahead = g.op("Where", g.op("GreaterOrEqual", nx, cos_w), self.one, g.op("Add", along, across))
        behind = g.op("LessOrEqual", nx, g.op("Neg", cos_w))
        behind = g.op("Where", behind, self.one, g.op("Sub", across, along))
        motion = g.op(
            "Max",
            g.op("Mul", self.far, ahead),
            g.op("Mul", self.near, ahead),
            g.op("Neg", g.op("Mul", self.near, behind)),
        )
        hull = [g.op("Unsqueeze", v, g.index([2])) for v in (self.hull_x, self.hull_y)]
        rays = [g.op("Unsqueeze", v, g.index([1])) for v in (nx, ny)]
        products = g.op("Add", g.op("Mul", hull[0], rays[0]), g.op("Mul", hull[1], rays[1]))
        support = g.op("Add", motion, self._hull_support(products, n, self.radius))
        toward = g.op("Add", g.op("Mul", self.x, nx), g.op("Mul", self.y, ny))
        slack = g.op("Sub", toward, support)
        self.dynamic_slack = g.op("ReduceMax", slack, g.index([1]), keepdims=1)
        best = g.op("ArgMax", slack, axis=1, keepdims=1)
        self.dynamic_x = g.op("GatherElements", nx, best, axis=1)
        self.dynamic_y = g.op("GatherElements", ny, best, axis=1)

    def _flank(self, cos_w: str, sin_w: str) -> tuple[str, str]:
        """The starboard flank's normal: 90 degrees + w, less where the ship may drift astern."""
        g, tiny = self.g, self.g.constant(TINY)
        across = g.op("Add", g.op("Sub", self.far, g.op("Abs", self.near)), tiny)
        along = g.op("Add", g.op("Sub", self.far, self.near), tiny)
        x, y = g.op("Neg", g.op("Mul", across, sin_w)), g.op("Mul", along, cos_w)
        length = g.op("Sqrt", g.op("Add", g.op("Mul", x, x), g.op("Mul", y, y)))
        return g.op("Div", x, length), g.op("Div", y, length)

    def _radial(self, tan_w: str) -> tuple[str, str]:
        """The direction from the front arc's centre, carried to the hull's foremost corner, to p."""
        g = self.g

        def slope(x: str, y: str) -> str:
            ratio = g.op("Div", y, g.op("Max", x, self.one))
            return g.op("Min", g.op("Max", ratio, g.op("Neg", tan_w)), tan_w)

        leaning = g.op("Mul", self.hull_y, slope(self.x, self.y))
        best = g.op("ArgMax", g.op("Add", self.hull_x, leaning), axis=1, keepdims=1)
        corner_x, corner_y = (g.op("GatherElements", v, best, axis=1) for v in (self.hull_x, self.hull_y))
        lean = slope(g.op("Sub", self.x, corner_x), g.op("Sub", self.y, corner_y))
        length = g.op("Sqrt", g.op("Add", g.op("Mul", lean, lean), self.one))
        return g.op("Div", self.one, length), g.op("Div", lean, length)

    def _edges(self) -> tuple[str, str]:
        """(n, 4) the outward normals of the hull between one corner's arc and the next."""
        g = self.g
        difference = np.zeros((12, 4))
        for i in range(4):
            difference[(i + 1) % 4, i] = 1.0  # the next corner, turned by -error
            difference[8 + i, i] = -1.0  # this corner, turned by +error
        dx = g.op("MatMul", self.hull_x, g.constant(difference))
        dy = g.op("Add", g.op("MatMul", self.hull_y, g.constant(difference)), g.constant(TINY))
        length = g.op("Sqrt", g.op("Add", g.op("Mul", dx, dx), g.op("Mul", dy, dy)))
        return g.op("Div", dy, length), g.op("Neg", g.op("Div", dx, length))

    def outputs(self) -> None:
        """Distance, direction and eq. (8)'s force, back in the north-east frame."""
        g, c = self.g, self.constants
        is_dynamic = g.op("GreaterOrEqual", self.dynamic_slack, self.grid_slack)
        slack = g.op("Max", self.dynamic_slack, self.grid_slack)
        x = g.op("Where", is_dynamic, self.dynamic_x, self.grid_x)
        y = g.op("Where", is_dynamic, self.dynamic_y, self.grid_y)
        disc = g.op("Add", g.op("Add", self.column["position_error_m"], self.circle), g.constant(c.margin_m))
        distance = g.op("Sub", slack, disc)
        north = g.op("Sub", g.op("Mul", x, self.cos), g.op("Mul", y, self.sin))
        east = g.op("Add", g.op("Mul", x, self.sin), g.op("Mul", y, self.cos))
        away = g.op("Concat", north, east, axis=1, output="away")
        gap = g.op("Max", g.op("Sub", distance, g.constant(c.delta_m)), g.constant(c.singular_gap_m))
        force = g.op("Div", g.constant(c.k_r), g.op("Mul", gap, g.op("Mul", gap, gap)))
        g.op("Mul", away, force, output="repulsion")
        g.op("Squeeze", distance, g.index([1]), output="distance_m")
