"""Second part of the support graph: the hull around its antenna, turned by its heading error."""

from dataclasses import dataclass

import numpy as np

from models.onnx_graph import GraphBuilder
from models.support_frame import Frame


@dataclass(frozen=True, slots=True)
class Hull:
    """Each corner sweeps an arc, given by three points: its ends, and where their tangents meet.

    Capped by the corner's distance the three points have exactly the support of the arc.
    """

    points_x: str  # (12, 1, n): four tangents' meeting points, four ends, four ends
    points_y: str
    radius: str  # (4, 1, n)
    corners: str  # (2, 4, n), the hull at its most likely heading, arcs' middles a little farther out
    normals: str  # (2, 12, n) outward normals of the edges and of the arcs' ends, of any length
    circle: str  # (1, n) of a hull that may lie any way

    def support(self, g: GraphBuilder, x: str, y: str) -> str:
        """(1, D, n) for directions with x and y (1, D, n)."""
        reach = g.op("Add", g.op("Mul", self.points_x, x), g.op("Mul", self.points_y, y))
        arcs = g.op("Min", g.op("Max", *g.split(reach, [4, 4, 4], axis=0)), self.radius)
        return g.op("Max", *g.split(arcs, [1, 1, 1, 1], axis=0))


def hull(g: GraphBuilder, frame: Frame, unknown_heading_rad: float) -> Hull:
    """The hull in the course frame."""
    is_known = g.op("Less", frame.error, g.constant([[unknown_heading_rad]], np.float32))
    shown = g.cast32(is_known)
    lengths = g.op("Reshape", frame.corners, g.index([2, 4, -1]))
    radius = g.op("ReduceL2", lengths, g.index([0]), keepdims=0)
    greatest = g.op("ReduceMax", radius, g.index([0]), keepdims=1)
    circle = g.op("Where", is_known, g.constant([[0.0]], np.float32), greatest)
    # the middle point of an arc lies farther out, by 1 / cos(error)
    scale = g.op("Concat", g.op("Div", shown, frame.cos_bend), shown, shown, axis=0)
    cos, sin = (
        g.op("Reshape", g.op("Mul", turn, scale), g.index([3, 1, -1]))
        for turn in (frame.cos_turn, frame.sin_turn)
    )
    points = g.op("Add", g.op("Mul", frame.corners, cos), g.op("Mul", frame.turned, sin))  # (3, 8, n)
    flat = g.op("Reshape", points, g.index([24, -1]))
    order = np.zeros((24, 3, 2, 4), dtype=np.float32)
    for axis in range(2):
        for point in range(12):
            order[12 * axis + point, point // 4, axis, point % 4] = 1.0
    normal = np.zeros((2, 4, 3, 2, 4), dtype=np.float32)
    for i in range(4):
        following = (i + 1) % 4  # an edge runs from here, turned by +error, to there, by -error
        normal[0, i, 2, 1, following], normal[0, i, 1, 1, i] = 1.0, -1.0  # x = dy
        normal[1, i, 2, 0, following], normal[1, i, 1, 0, i] = -1.0, 1.0  # y = -dx
    by_axis = order.reshape(2, 12, 24)
    # the normals of the edges, and where the arcs end
    rays = np.concatenate([normal.reshape(2, 4, 24), by_axis[:, 4:]], axis=1).reshape(24, 24)
    matrix = np.concatenate([order.reshape(24, 24), np.eye(8, 24), rays])
    both = g.op("MatMul", g.constant(matrix, np.float32), flat)
    x, y, amid, normals = g.split(both, [12, 12, 8, 24], axis=0)
    return Hull(
        points_x=g.op("Unsqueeze", x, g.index([1])),
        points_y=g.op("Unsqueeze", y, g.index([1])),
        radius=g.op("Unsqueeze", g.op("Mul", radius, shown), g.index([1])),
        corners=g.op("Reshape", amid, g.index([2, 4, -1])),
        normals=g.op("Reshape", normals, g.index([2, 12, -1])),
        circle=circle,
    )
