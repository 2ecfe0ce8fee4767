"""First part of the turning graph: a row of numbers to the slabs in time its tube is made of.

The slabs are those of `companion.reach.turning`: whole seconds, ten seconds each, forty at most.
Course frame: x along the reported course, y to the side the ship turns to (a ship that turns to port is
mirrored), origin at the reported antenna position.  Tensors are (rows, N), one column for each of the
N = n S slabs; a contact with fewer slabs than another repeats its last.
"""

from dataclasses import dataclass

import numpy as np

from companion.planning.rows import TURNING_COLUMNS
from companion.reach.swept import APART_RAD, ASTERN_RAD
from companion.reach.turning import MOST_SLABS, ROUNDING_S, SLAB_S
from models.onnx_graph import GraphBuilder

HALF = np.pi / 2
CORNERS = (("bow_m", 1, "starboard_m", 1), ("stern_m", -1, "starboard_m", 1),
           ("stern_m", -1, "port_m", -1), ("bow_m", 1, "port_m", -1))  # fmt: skip
# the directions, as (offset, {quantity: factor}); the same as `companion.reach.swept.tangents`
Direction = tuple[float, dict[str, float]]
DIRECTIONS: tuple[Direction, ...] = (
    *((0.0, {"lowest": 1 - i / 19, "highest": i / 19}) for i in range(20)),
    *((HALF, {"noise": 1 - i / 7, "high_end": i / 7}) for i in range(8)),
    (HALF, {"high_start": 1.0}),
    *((-HALF, {"noise": i / 7 - 1, "low_end": i / 7}) for i in range(8)),
    (-HALF, {"low_start": 1.0}),
    *((np.pi, {"turned": i / 3}) for i in range(4)),
    *((k * np.pi / 4, {"lowest": 0.5, "highest": 0.5}) for k in range(-4, 4)),
)
ANGLES = ("lowest", "highest", "noise", "high_end", "high_start", "low_end", "low_start", "turned")


@dataclass(frozen=True, slots=True)
class Slabs:
    """Names of tensors; (1, N) float32 unless said."""

    shape: str  # int64 [n, S]
    ship_side: str  # (n,) float64: 1, or -1 for a ship that turns to port
    side: str  # the same
    course: str  # (n,) float64
    x: str
    y: str
    beside: str  # (K, N) angles from the middle of all courses, neighbours in neighbouring rows
    middle: str
    noise: str
    start: str  # seconds
    far: str  # metres at the end of the slab by the greatest speed
    slow: str  # m/s
    rate: str  # rad/s, not negative
    start_high: str  # radians the upper end of the courses has turned at the start ...
    end_high: str  # ... and at the end of the slab
    end_low_down: str  # radians the lower end has turned at the end of the slab, if to the other side
    end_low_up: str  # ... if to this side
    high_rate: str
    low_rate_down: str
    low_rate_up: str
    corners: str  # (8, N) x, then y of the hull's corners
    radius: str  # (4, N) their distances from the antenna
    cos_swing: str
    sin_swing: str
    circle: str  # of a hull that may lie any way, else 0
    known: str  # 1, or 0 for such a hull
    margin: str


def slabs(g: GraphBuilder, margin_m: float, margin_relative: float) -> Slabs:  # noqa: PLR0915 - one list
    """From `contacts` (n, 17)."""
    turned = g.op("Unsqueeze", g.op("Transpose", "contacts", perm=[1, 0]), g.index([2]))
    c = dict(zip(TURNING_COLUMNS, g.split(turned, [1] * len(TURNING_COLUMNS), axis=0), strict=True))
    zero, one = g.constant(0.0), g.constant(1.0)

    def add(*parts: str) -> str:
        total = parts[0]
        for part in parts[1:]:
            total = g.op("Add", total, part)
        return total

    def mul(a: str, b: str | float) -> str:
        return g.op("Mul", a, b if isinstance(b, str) else g.constant(b))

    side = g.op("Where", g.op("Less", c["turn_rate_radps"], zero), g.constant(-1.0), one)
    rate = g.op("Abs", c["turn_rate_radps"])
    high_rate = add(rate, c["turn_rate_error_radps"])
    low_rate = g.op("Sub", rate, c["turn_rate_error_radps"])
    noise = c["course_noise_rad"]
    fast, slow = add(c["speed_mps"], c["speed_noise_mps"]), g.op("Sub", c["speed_mps"], c["speed_noise_mps"])

    first = g.op("Floor", add(c["age_s"], g.constant(ROUNDING_S)))
    until = g.op("Max", c["age_s"], c["until_age_s"])
    whole = g.op("Sub", g.op("Ceil", g.op("Sub", until, g.constant(ROUNDING_S))), first)
    pieces = g.op("Ceil", g.op("Div", whole, g.constant(SLAB_S)))
    pieces = g.op("Min", g.op("Max", pieces, one), g.constant(float(MOST_SLABS)))
    length = g.op("Div", whole, pieces)
    most = g.op(
        "ReduceMax",
        g.op("Concat", g.op("Reshape", pieces, g.index([-1])), g.constant([1.0]), axis=0),
        keepdims=0,
    )
    steps = g.op("Range", zero, most, one)
    step = g.op("Min", g.op("Reshape", steps, g.index([1, 1, -1])), g.op("Sub", pieces, one))
    start = add(first, mul(length, step))  # (1, n, S) from here
    end = add(start, length)

    end_high, start_high = mul(high_rate, end), mul(high_rate, start)
    end_low = mul(low_rate, end)
    angle = {
        "noise": noise,
        "high_end": add(noise, end_high),
        "high_start": add(noise, start_high),
        "low_end": g.op("Sub", end_low, noise),
        "low_start": g.op("Sub", mul(low_rate, start), noise),
        "turned": mul(rate, end),
    }
    angle["lowest"] = g.op("Min", angle["low_end"], g.op("Neg", noise))
    angle["highest"] = angle["high_end"]

    cos, sin = g.op("Cos", c["course_rad"]), g.op("Sin", c["course_rad"])
    x = add(mul(c["north_m"], cos), mul(c["east_m"], sin))
    y = mul(g.op("Sub", mul(c["east_m"], cos), mul(c["north_m"], sin)), side)
    far = mul(fast, end)

    heading = add(
        mul(side, g.op("Sub", c["heading_rad"], c["course_rad"])), mul(mul(rate, 0.5), add(start, end))
    )
    swing = add(c["heading_error_rad"], mul(c["turn_rate_error_radps"], end), mul(mul(rate, 0.5), length))
    cos_heading, sin_heading = g.op("Cos", heading), g.op("Sin", heading)
    along, across, radius = [], [], []
    for ahead, ahead_sign, right, right_sign in CORNERS:
        a, r = mul(c[ahead], float(ahead_sign)), mul(mul(c[right], float(right_sign)), side)
        along.append(g.op("Sub", mul(a, cos_heading), mul(r, sin_heading)))
        across.append(add(mul(a, sin_heading), mul(r, cos_heading)))
        radius.append(g.op("Sqrt", add(mul(a, a), mul(r, r))))
    longest = g.op("Max", *radius)
    is_known = g.op("LessOrEqual", swing, g.constant(HALF))
    within = g.op("Min", swing, g.constant(HALF))
    far_off = add(g.op("Abs", x), g.op("Abs", y), far, longest)
    rounding = mul(add(fast, mul(high_rate, longest)), ROUNDING_S)
    margin = add(c["position_error_m"], rounding, mul(far_off, margin_relative), g.constant(margin_m))

    rows = {
        "side": side, "x": x, "y": y, "noise": noise, "start": start, "far": far, "slow": slow, "rate": rate,
        "start_high": start_high, "end_high": end_high,
        "end_low_down": g.op("Min", end_low, zero), "end_low_up": g.op("Max", end_low, zero),
        "high_rate": high_rate,
        "low_rate_down": g.op("Min", low_rate, zero), "low_rate_up": g.op("Max", low_rate, zero),
        "cos_swing": g.op("Cos", within), "sin_swing": g.op("Sin", within),
        "circle": g.op("Where", is_known, zero, longest), "known": g.cast64(is_known), "margin": margin,
        **{f"along{i}": v for i, v in enumerate(along)}, **{f"across{i}": v for i, v in enumerate(across)},
        **{f"radius{i}": v for i, v in enumerate(radius)},
    }  # fmt: skip
    shape = g.op("Shape", start)
    whole_rows = [g.op("Expand", v, shape) for v in (*(angle[name] for name in ANGLES), *rows.values())]
    flat = g.op("Reshape", g.op("Concat", *whole_rows, axis=0), g.index([len(whole_rows), -1]))
    angles, rest = g.split(flat, [len(ANGLES), len(rows)], axis=0)
    sizes = [1] * (len(rows) - 12) + [8, 4]
    named = dict(
        zip([*list(rows)[:-12], "corners", "radius"], g.split(g.cast32(rest), sizes, axis=0), strict=True)
    )
    beside, middle = _directions(g, angles, g.op("Reshape", g.op("Expand", side, shape), g.index([1, -1])))
    return Slabs(
        shape=g.op("Slice", shape, g.index([1]), g.index([3])),
        ship_side=g.op("Reshape", side, g.index([-1])),
        course=g.op("Reshape", c["course_rad"], g.index([-1])),
        beside=beside,
        middle=middle,
        **named,
    )


def _directions(g: GraphBuilder, angles: str, side: str) -> tuple[str, str]:
    """(K, N) the directions in ascending order as the ship turns, and the middle of all its courses.

    Step by step what `companion.reach.swept.tangents` does, so that both give the same polygon.
    """
    count = len(DIRECTIONS)
    matrix, offset = np.zeros((count, len(ANGLES))), np.zeros((count, 1))
    for i, (constant, terms) in enumerate(DIRECTIONS):
        offset[i] = constant
        for name, factor in terms.items():
            matrix[i, ANGLES.index(name)] += factor
    matrix[:, :2] -= 0.5  # from the middle
    beside = g.op("Add", g.op("MatMul", g.constant(matrix), angles), g.constant(offset))
    beside = g.op("Mul", beside, side)  # not mirrored: the order of `tangents`
    rounds = g.op(
        "Floor", g.op("Div", g.op("Add", beside, g.constant(np.pi + ASTERN_RAD)), g.constant(2 * np.pi))
    )
    beside = g.op("Sub", beside, g.op("Mul", rounds, g.constant(2 * np.pi)))
    beside = g.op("Clip", beside, g.constant(-np.pi), g.constant(np.pi - APART_RAD * count))
    shift = g.constant(APART_RAD * np.arange(count)[:, None], np.float32)
    apart = g.op("Sub", g.ascending(g.cast32(beside), count), shift)
    step = 1
    while step < count:  # the greatest so far
        start, _ = g.split(apart, [count - step, step], axis=0)
        first, _ = g.split(apart, [step, count - step], axis=0)
        apart = g.op("Max", apart, g.op("Concat", first, start, axis=0))
        step *= 2
    lowest, highest, _ = g.split(angles, [1, 1, len(ANGLES) - 2], axis=0)
    middle = g.op("Mul", g.op("Add", lowest, highest), g.constant(0.5))
    return g.op("Mul", g.op("Add", apart, shift), g.cast32(side)), g.cast32(middle)
