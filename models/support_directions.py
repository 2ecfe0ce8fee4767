"""Third part of the support graph: the directions in which the distance is bounded from below.

The grid directions carry what is learned.  Others follow the contact and have their support in closed
form: the edges' normals, and the rays from the motion's corners and from the front arc's centre, alone
and carried to each corner of the hull, which are the nearest directions where the set is round.
"""

import numpy as np

from models.layers import Layers, grid_angles, mirrored
from models.onnx_graph import GraphBuilder
from models.support_frame import Frame
from models.support_hull import Hull

TINY = 1e-6


def grid(g: GraphBuilder, frame: Frame, hull: Hull, layers: Layers, count: int) -> tuple[str, str]:
    """Slack (1, n), but for the hull, and direction (2, 1, n) of the best of the grid directions.

    The far end bounds the motion ahead of the beam, the near end abaft of it.  The beam itself is the
    last direction ahead, and none lies between it and a flank's normal.  The best is chosen for the
    hull at its most likely heading; no bound depends on that.
    """
    angles = grid_angles(count)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    is_ahead = rays[:, 0] > -TINY
    pick = np.stack([is_ahead, ~is_ahead], axis=1).astype(np.float64)
    table = np.concatenate([
        np.concatenate([rays, -rays[:, :1] * pick], axis=1),
        np.concatenate([np.zeros_like(rays), pick], axis=1),
    ])  # fmt: skip
    both = g.op("MatMul", g.constant(table, np.float32), frame.position)
    toward, reach = g.split(both, [count, count], axis=0)
    motion = g.op("Sub", toward, g.op("Mul", reach, corrections(g, frame, layers, count)))
    flat = g.op("Reshape", hull.corners, g.index([8, -1]))
    each = np.zeros((4, count, 2, 4), dtype=np.float32)
    for i in range(4):
        each[i, :, :, i] = rays
    reaches = g.op("MatMul", g.constant(each.reshape(4 * count, 8), np.float32), flat)
    reaches = g.op("Max", *g.split(reaches, [count] * 4, axis=0))
    best = g.op("ArgMax", g.op("Sub", motion, reaches), axis=0, keepdims=1)
    slack = g.op("GatherElements", motion, best, axis=0)
    return slack, g.op("Gather", g.constant(rays.T, np.float32), best, axis=1)


def corrections(g: GraphBuilder, frame: Frame, layers: Layers, count: int) -> str:
    """(K, n) what is learned toward each grid direction; a row serves both sides of the course."""
    tensor = frame.noise
    last = len(layers.weights) - 1
    columns = mirrored(count)
    for i, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
        served = columns if i == last else np.arange(len(bias))
        w = g.constant(weight[:, served], np.float32, name=f"weight{i}")
        b = g.constant(bias[served, None], np.float32, name=f"bias{i}")
        tensor = g.op("Gemm", w, tensor, b, transA=1)
        tensor = tensor if i == last else g.op("Tanh", tensor)
    return tensor


def following(g: GraphBuilder, frame: Frame, hull: Hull) -> tuple[str, str]:
    """Slacks (1, D, n), but for the hull, and unit directions (2, D, n) of those that follow the contact.

    The motion is the hull of an arc and of two corners: far port, far starboard, where the tangents at
    these two meet (capped by the arc), the arc's centre, near port, near starboard.
    """
    spread = np.zeros((24, 4))
    spread[:6, 0] = spread[6:12, 1] = 1.0
    spread[[12, 13, 14], 2] = spread[[16, 17], 3] = 1.0
    spread[[18, 19], 2], spread[[22, 23], 3] = (-1.0, 1.0), (-1.0, 1.0)
    both = g.op("MatMul", g.constant(spread, np.float32), frame.position)
    vehicle, reach = g.split(both, [12, 12], axis=0)
    cos, sin = frame.cos_noise, frame.sin_noise
    farther = g.op("Reciprocal", cos)
    where = g.op("Concat", cos, cos, farther, cos, cos, cos, *[sin] * 6, axis=0)
    rays = g.op("Sub", vehicle, g.op("Mul", reach, where))
    rays = g.op("Reshape", rays, g.index([2, 6, -1]))
    ahead, _ = g.split(g.op("Reshape", vehicle, g.index([2, 6, -1])), [4, 2], axis=1)
    carried = g.op("Sub", ahead, hull.corners)
    vectors = g.op("Concat", frame.flanks, hull.normals, rays, carried, axis=1)
    away_from_zero = g.constant([[[TINY]], [[0.0]]], np.float32)  # a vector of no length has no direction
    vectors = g.op("Add", vectors, away_from_zero)
    units = g.op("Div", vectors, g.op("ReduceL2", vectors, g.index([0]), keepdims=1))
    x, y = g.split(units, [1, 1], axis=0)
    ray_x, ray_y = g.split(g.op("Reshape", rays, g.index([12, 1, -1])), [6, 6], axis=0)
    toward = g.op("Add", g.op("Mul", ray_x, x), g.op("Mul", ray_y, y))
    port, starboard, between, centre, *near = g.split(toward, [1] * 6, axis=0)
    arc = g.op("Max", g.op("Min", port, starboard, between), g.op("Sub", centre, frame.far))
    return g.op("Min", arc, *near), units
