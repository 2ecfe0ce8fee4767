"""The paper's ship by two other methods: zonotopes step by step, and boxes as Flow* makes them.

Both are outer approximations of the antenna's motion; together with points that are really reached
they hold the exact set from both sides.
"""

import numpy as np
import pytest

from companion import reach
from companion.instant import instant
from companion.messages import FloatArray
from tests.builders import tracks
from tests.ships import drive, plane

ANGLE = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
NORMAL = np.column_stack((np.cos(ANGLE), np.sin(ANGLE)))
POINT = dict.fromkeys(("bow_m", "stern_m", "port_m", "starboard_m", "heading_error_rad"), 0.0)


def velocity_box(v: float, w: float, spread: float) -> tuple[FloatArray, FloatArray]:
    """Centre and half sides, in the course frame, of the box around the sector of velocities."""
    ahead = np.array(((v - w) * np.cos(spread), v + w))
    aside = (v + w) * np.sin(spread)
    return np.array((ahead.mean(), 0.0)), np.array((np.ptp(ahead) / 2, aside))


def zonotope_support(
    course: float, v: float, w: float, spread: float, age_s: float, steps: int
) -> FloatArray:
    """Support at `age_s` of the zonotope that grows by one parallelogram of displacements a step."""
    turn = np.array(((np.cos(course), -np.sin(course)), (np.sin(course), np.cos(course))))
    centre, half = velocity_box(v, w, spread)
    middle, generators = np.zeros(2), []
    for _ in range(steps):
        middle = middle + turn @ centre * (age_s / steps)
        generators += list((turn * half).T * (age_s / steps))
    return np.asarray(NORMAL @ middle + np.abs(NORMAL @ np.array(generators).T).sum(axis=1))


def box_area(course: float, v: float, w: float, spread: float, age_s: float) -> float:
    """Area of the box with axes north and east that intervals give at `age_s`."""
    low, high = course - spread, course + spread
    courses = np.array([low, high, *[q for q in np.arange(-4, 5) * np.pi / 2 if low < q < high]])
    ends = np.outer((v - w, v + w), np.exp(1j * courses)).ravel() * age_s
    return float(np.ptp(ends.real) * np.ptp(ends.imag))


def area(support: FloatArray) -> float:
    """Area of the polygon of tangents in the directions `ANGLE`."""
    width = ANGLE[1]
    along = (np.roll(support, -1) - support * np.cos(width)) / np.sin(width)
    corner = np.exp(1j * ANGLE) * (support + 1j * along)
    return float(0.5 * np.imag(corner.conj() * np.roll(corner, -1)).sum())


@pytest.mark.parametrize("course", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("age_s", [30.0, 600.0])
def test_the_exact_set_lies_between_what_is_reached_and_a_zonotope(course: float, age_s: float) -> None:
    ship = tracks({"cog_rad": course, **POINT})
    exact = reach.at(ship, instant(age_s)).support(NORMAL)[0]
    points = plane(drive(np.random.default_rng(1), ship, 0, age_s, age_s, 20_000))
    reached = (points @ NORMAL.T).max(axis=0)
    zonotope = zonotope_support(course, 5.0, 0.05, 0.01, age_s, 60)
    assert (reached <= exact + 1e-9).all()
    assert (exact <= zonotope + 1e-9).all()
    # in the course's own frame the sector is nearly a box: the two outer sets nearly agree
    assert (zonotope - exact).max() < 0.002 * age_s


def test_boxes_cost_little_along_an_axis_and_nearly_double_the_area_across() -> None:
    ratio = {}
    for course in (0.0, 0.5):
        exact = area(reach.at(tracks({"cog_rad": course, **POINT}), instant(600.0)).support(NORMAL)[0])
        ratio[course] = box_area(course, 5.0, 0.05, 0.01, 600.0) / exact
    assert ratio[0.0] == pytest.approx(1.01, abs=0.01)
    assert ratio[0.5] == pytest.approx(1.86, abs=0.03)
