"""Second part of the turning graph: how far the antenna may get in a direction, by what is learned.

The support of a slab [a, b] in the direction beta is, C the largest cosine between beta and the
courses possible at s (`companion.reach.turning`),

    fast * integral to b of max(C, 0)  -  slow * integral to a of max(-C, 0)

Both ends of the courses move at constant rates, so each integral is made of sweeps over an interval of
angles [x, y], and of such a sweep only one thing needs more than adding and clipping:

    T(x, y) = mean of the cosine over [x, y],   0 <= x <= y <= pi/2

That is what the network learns: how much of what a turning ship sails is made good.  It is at or above
the truth ahead, and its greatest excess is taken off astern, where less is safe.
"""

import numpy as np

from companion.planning.turning_proof import MOST_ABOVE
from models.layers import Layers
from models.onnx_graph import GraphBuilder
from models.turning_slabs import DIRECTIONS, HALF, Slabs

TINY_RAD = 1e-6  # what float32 tells apart; a narrower sweep counts as its clipped part throughout


def support(g: GraphBuilder, s: Slabs, layers: Layers, most_above: float) -> str:
    """(K, N) support of the antenna's motion in the directions of the slabs, metres."""
    angle = g.op("Add", s.beside, s.middle)
    is_beside = g.op("Sign", g.op("Add", s.beside, _f32(g, 1e-20)))
    astern = g.op("Sub", angle, g.op("Mul", is_beside, _f32(g, np.pi)))  # angle from straight astern
    zero = _f32(g, 0.0)
    # until then the lower end of the courses is nearer to beta, if seen over the stern
    split = g.op("Div", astern, g.op("Max", s.rate, _f32(g, 1e-9)))
    split = g.op("Min", g.op("Max", split, zero), s.start)

    above = g.op("Sub", angle, s.noise)  # beta past the upper end, at the report
    below = g.op("Neg", g.op("Add", angle, s.noise))  # the lower end past beta
    over, under = g.op("Add", astern, s.noise), g.op("Sub", s.noise, astern)
    low = g.op("Concat",
        g.op("Sub", above, s.end_high),
        g.op("Add", below, s.end_low_down),
        g.op("Sub", over, g.op("Mul", s.low_rate_up, split)),
        g.op("Add", under, g.op("Mul", s.high_rate, split)),
        axis=0,
    )  # fmt: skip
    high = g.op("Concat",
        above,
        g.op("Add", below, s.end_low_up),
        g.op("Sub", over, g.op("Mul", s.low_rate_down, split)),
        g.op("Add", under, s.start_high),
        axis=0,
    )  # fmt: skip
    x, y = (g.op("Clip", end, zero, _f32(g, HALF)) for end in (low, high))
    tiny = _f32(g, TINY_RAD)
    width = g.op("Add", g.op("Sub", high, low), tiny)
    made_good = g.op("Mul", g.op("Add", g.op("Sub", y, x), tiny), mean_cosine(g, layers, x, y))
    count = len(DIRECTIONS)
    ahead, rear = g.split(made_good, [2 * count, 2 * count], axis=0)
    (low_ahead, _), (high_ahead, _), (width_ahead, width_rear) = (
        g.split(t, [2 * count, 2 * count], axis=0) for t in (low, high, width)
    )
    straight_on = g.op("Sub", g.op("Min", high_ahead, zero), g.op("Min", low_ahead, zero))
    ahead = g.op("Div", g.op("Add", straight_on, ahead), width_ahead)
    upper, lower = g.split(ahead, [count, count], axis=0)
    forward = g.op("Mul", s.far, g.op("Sub", g.op("Add", upper, lower), _f32(g, 1.0)))
    first, second = g.split(g.op("Div", rear, width_rear), [count, count], axis=0)
    back = g.op("Add", g.op("Mul", split, first), g.op("Mul", g.op("Sub", s.start, split), second))
    # what was learned may be this much above the truth, for as long as the ship sailed
    excess = g.op("Mul", s.start, g.constant(most_above, np.float32, name=MOST_ABOVE))
    return g.op("Sub", forward, g.op("Mul", s.slow, g.op("Sub", back, excess)))


def mean_cosine(g: GraphBuilder, layers: Layers, x: str, y: str) -> str:
    """The learned T of tensors of one shape."""
    flat = [g.op("Reshape", t, g.index([1, -1])) for t in (x, y)]
    tensor = g.op("Concat", *flat, axis=0)
    last = len(layers.weights) - 1
    for i, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
        w = g.constant(weight, np.float32, name=f"weight{i}")
        b = g.constant(bias[:, None], np.float32, name=f"bias{i}")
        tensor = g.op("Gemm", w, tensor, b, transA=1)
        tensor = tensor if i == last else g.op("Tanh", tensor)
    return g.op("Reshape", tensor, g.op("Shape", x))


def _f32(g: GraphBuilder, value: float) -> str:
    return g.constant(value, np.float32)
