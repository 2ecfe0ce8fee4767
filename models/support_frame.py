"""First part of the support graph: a row of numbers to the quantities the rest is made of.

All tensors have the contacts last, so that one number per contact multiplies whole rows of numbers.
Course frame: x along the course, y to starboard, origin at the reported antenna position.
"""

from dataclasses import dataclass

import numpy as np

from companion.planning.rows import COLUMNS
from models.onnx_graph import GraphBuilder

QUARTER = np.pi / 2
Terms = dict[str, float]
CORNERS = (("bow_m", "starboard_m"), ("stern_m", "starboard_m"), ("stern_m", "port_m"), ("bow_m", "port_m"))
SIDE = {"bow_m": 1.0, "starboard_m": 1.0, "stern_m": -1.0, "port_m": -1.0}

# One linear product gives all of these; (terms, offset).
COURSE: tuple[tuple[Terms, float], ...] = (
    ({"course_rad": 1}, 0.0),  # the cosines: cos, sin, -sin, cos
    ({"course_rad": 1}, -QUARTER),
    ({"course_rad": 1}, QUARTER),
    ({"course_rad": 1}, 0.0),
)
SPEEDS: tuple[tuple[Terms, float], ...] = (
    ({"speed_mps": 1, "speed_noise_mps": -1}, 0.0),
    ({"speed_mps": 1, "speed_noise_mps": 1}, 0.0),
)
NOISE: tuple[tuple[Terms, float], ...] = (
    ({"course_noise_rad": 1}, QUARTER),  # x of both flanks' normals and of the stern's
    ({"course_noise_rad": 1}, QUARTER),
    ({}, np.pi),
    ({"course_noise_rad": 1}, 0.0),  # y of the same
    ({"course_noise_rad": 1}, np.pi),
    ({}, QUARTER),
    ({"course_noise_rad": 1}, 0.0),  # cosine and sine
    ({"course_noise_rad": 1}, -QUARTER),
)
OFF: Terms = {"heading_rad": 1, "course_rad": -1}
HULL: tuple[tuple[Terms, float], ...] = tuple(
    ({**OFF, "heading_error_rad": error}, shift) for shift in (0.0, -QUARTER) for error in (0.0, 1.0, -1.0)
)  # cosines, then sines, of the hull's heading from the course: amid and at both ends of its error
BEND: tuple[tuple[Terms, float], ...] = (({"heading_error_rad": 1}, 0.0),)


@dataclass(frozen=True, slots=True)
class Frame:
    """Names of tensors; (1, n) float32 unless said."""

    along: str  # (2, n) float64: the course's north and east
    across: str  # (2, n) float64: starboard's
    position: str  # (4, n): x, y of the vehicle, far and near reach
    far: str
    flanks: str  # (2, 3, n): normals of both flanks and of the stern
    cos_noise: str
    sin_noise: str
    noise: str  # scaled to [-1, 1]
    cos_turn: str  # (3, n): of the hull's headings
    sin_turn: str
    cos_bend: str
    corners: str  # (8, n): x and y of the hull's corners, the hull heading along the course
    turned: str  # (8, n): the same a quarter turn on
    error: str
    disc: str  # float64


def frame(g: GraphBuilder, course_noise_max_rad: float) -> Frame:
    """From `contacts` (n, 15)."""
    lengths = [({column: SIDE[column]}, 0.0) for pair in zip(*CORNERS, strict=True) for column in pair]
    turned = [({c: -f for c, f in t.items()}, o) for t, o in lengths[4:]] + lengths[:4]
    places = [({c: 1.0}, 0.0) for c in ("north_m", "east_m", "north_m", "east_m")]
    scaled: tuple[Terms, float] = ({"course_noise_rad": 2 / course_noise_max_rad}, -1.0)
    groups = (
        list(COURSE),
        list(SPEEDS),
        [*places, ({"age_s": 1.0}, 0.0), ({"until_age_s": 1.0}, 0.0)],
        [*places, ({"age_s": 1.0}, 0.0), ({"age_s": 1.0}, 0.0)],
        [({"position_error_m": 1.0}, 0.0)],
        [*NOISE, *HULL, *BEND, scaled, ({"heading_error_rad": 1.0}, 0.0), *lengths, *turned],
    )
    course, speeds, ends, starts, disc, rest = g.split(_linear(g, groups), [len(x) for x in groups], axis=0)
    axes = g.op("Cos", course)
    products = g.op("Mul", g.op("Max", ends, starts), g.op("Concat", axes, speeds, axis=0))
    # float64 to here: what is measured from far away
    mixed = g.op("MatMul", g.constant([
        [1, 1, 0, 0, 0, 0],
        [0, 0, 1, 1, 0, 0],
        [0, 0, 0, 0, 0, 1],
        [0, 0, 0, 0, 1, 0],
    ]), products)  # fmt: skip
    position = g.cast32(mixed)
    sizes = [len(NOISE) + len(HULL) + len(BEND), 1, 1, 8, 8]
    angles, noise, error, corners, a_quarter_on = g.split(g.cast32(rest), sizes, axis=0)
    cosines = g.split(g.op("Cos", angles), [6, 1, 1, 3, 3, 1], axis=0)
    flanks, cos_noise, sin_noise, cos_turn, sin_turn, cos_bend = cosines
    along, across = g.split(axes, [2, 2], axis=0)
    _, far, _ = g.split(position, [2, 1, 1], axis=0)
    return Frame(
        along=along,
        across=across,
        position=position,
        far=far,
        flanks=g.op("Reshape", flanks, g.index([2, 3, -1])),
        cos_noise=cos_noise,
        sin_noise=sin_noise,
        noise=noise,
        cos_turn=cos_turn,
        sin_turn=sin_turn,
        cos_bend=cos_bend,
        corners=corners,
        turned=a_quarter_on,
        error=error,
        disc=disc,
    )


def _linear(g: GraphBuilder, groups: tuple[list[tuple[Terms, float]], ...]) -> str:
    rows = [row for group in groups for row in group]
    matrix, offset = np.zeros((len(rows), len(COLUMNS))), np.zeros((len(rows), 1))
    for i, (terms, constant) in enumerate(rows):
        offset[i] = constant
        for column, factor in terms.items():
            matrix[i, COLUMNS.index(column)] += factor
    return g.op("Gemm", g.constant(matrix), "contacts", g.constant(offset), transB=1)
