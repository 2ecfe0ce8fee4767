"""Sets learned from recorded traffic: a quadrilateral that moves and grows, exact against shapely."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPoint, Point

from companion import reach
from companion.instant import instant
from companion.messages import SPREAD_AGES_S, FloatArray, Model, Tracks
from tests.builders import tracks

AGES = np.array((0.0, *SPREAD_AGES_S))
growing = st.lists(st.tuples(*[st.floats(0.0, 400.0)] * 3), min_size=4, max_size=4).map(
    lambda steps: np.cumsum(np.array(steps), axis=0)
)


def ship(spread: FloatArray, model: Model, sog: float = 6.0, course: float = 0.7) -> Tracks:
    """One ship; its hull's circle has 40 m with the position error."""
    row = tracks({"sog_mps": sog, "cog_rad": course, "model": int(model), "validity_s": 600.0})
    return replace(row, spread_m=spread[None])


def corners(spread: FloatArray, model: Model, age: float, sog: float, course: float) -> FloatArray:
    """(4, 2) the set's corners at an age, local frame, without hull and position error."""
    ahead, astern, abeam = (np.interp(age, AGES, np.r_[0.0, spread[:, k]]) for k in range(3))
    x = sog * age
    if model is Model.KITE:
        points = np.array(((x + ahead, 0.0), (x, abeam), (x - astern, 0.0), (x, -abeam)))
    else:
        points = np.array(
            ((x + ahead, abeam), (x + ahead, -abeam), (x - astern, abeam), (x - astern, -abeam))
        )
    turn = np.array(((math.cos(course), math.sin(course)), (-math.sin(course), math.cos(course))))
    return np.asarray(points @ turn)


def margin_m(row: Tracks) -> float:
    return float(
        np.hypot(max(row.bow_m[0], row.stern_m[0]), max(row.port_m[0], row.starboard_m[0]))
        + row.position_error_m[0]
    )


@given(growing, st.sampled_from([Model.KITE, Model.BOX]), st.floats(1.0, 600.0), st.floats(0.0, 7.0))
@settings(max_examples=60)
def test_the_distance_at_one_instant_is_shapely_s(
    spread: FloatArray, model: Model, age: float, bearing: float
) -> None:
    spread = spread + 1.0
    row = ship(spread, model)
    exact = MultiPoint(corners(spread, model, age, 6.0, 0.7)).convex_hull
    points = np.array([[r * math.cos(bearing), r * math.sin(bearing)] for r in (0.0, 300.0, 2000.0, 9000.0)])
    distance, away = reach.at(row, instant(age)).nearest_many(points)
    for point, found, normal in zip(points, distance[:, 0], away[:, 0], strict=True):
        here = Point(point)
        signed = exact.distance(here) if not exact.contains(here) else -exact.exterior.distance(here)
        assert found == pytest.approx(signed - margin_m(row), abs=1e-6)
        assert np.hypot(*normal) == pytest.approx(1.0)


@given(
    growing,
    st.sampled_from([Model.KITE, Model.BOX]),
    st.floats(0.0, 600.0),
    st.floats(0.0, 600.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 12.0),
)
@settings(max_examples=150)
def test_the_tube_contains_the_set_of_every_instant_between(
    spread: FloatArray, model: Model, age: float, until: float, part: float, sog: float
) -> None:
    age, until = sorted((age, until))
    row = ship(spread, model, sog)
    inside = corners(spread, model, age + part * (until - age), sog, 0.7)
    tube = reach.tube(row, instant(age), until)
    distance, _ = tube.nearest_many(inside)
    assert distance.max() <= -margin_m(row) + 1e-6
    angles = np.arange(0.0, 2 * math.pi, 0.1)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    assert (tube.support(directions)[0] + 1e-6 >= (inside @ directions.T).max(axis=0) + margin_m(row)).all()


def test_the_support_of_a_tube_is_that_of_its_own_outline() -> None:
    spread = np.array(((100, 60, 20), (150, 200, 60), (300, 900, 300), (500, 2500, 900)), dtype=float)
    row = ship(spread, Model.KITE)
    tube = reach.tube(row, instant(30.0), 400.0)
    outline = tube.outline(0)
    distance, _ = tube.nearest_many(outline)
    assert np.abs(distance).max() < 1e-3


def test_beyond_the_last_age_the_set_grows_on_all_sides_at_top_speed() -> None:
    spread = np.full((4, 3), 50.0)
    row = ship(spread, Model.BOX)
    north = np.array([[-20_000.0, 0.0]])
    then, later = (reach.at(row, instant(age)).nearest_many(north)[0][0, 0] for age in (600.0, 610.0))
    assert then - later >= 10 * row.top_speed_mps[0]
