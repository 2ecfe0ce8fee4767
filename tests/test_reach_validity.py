"""Beyond its validity a set grows on all sides: silence closes water, it never opens it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion import reach
from companion.instant import instant
from companion.messages import Model
from tests.builders import tracks

SHIP = {"validity_s": 300.0, "top_speed_mps": 16.0, "disc_speed_mps": 0.5}
HULL_M = math.hypot(37.5, 12.5)
directions = np.column_stack((np.cos(np.arange(0, 6.28, 0.1)), np.sin(np.arange(0, 6.28, 0.1))))


@given(
    st.floats(0, 10),
    st.floats(300.001, 900),
    st.sampled_from([Model.STRAIGHT, Model.DISC]),
    st.floats(0, 2 * math.pi),
    st.floats(0, 16),
    st.floats(0, 2 * math.pi),
)
def test_a_ship_that_keeps_its_bounds_and_then_does_anything_stays_in_its_set(
    sog: float, age: float, model: Model, course: float, speed: float, heading: float
) -> None:
    ship = tracks({**SHIP, "sog_mps": sog, "model": int(model)})
    kept_mps, way = (sog, 0.0) if model is Model.STRAIGHT else (0.5, course)
    antenna = 300.0 * kept_mps * np.array((math.cos(way), math.sin(way)))
    antenna += (age - 300.0) * speed * np.array((math.cos(course), math.sin(course)))
    ahead, aside = (
        np.array((math.cos(heading), math.sin(heading))),
        np.array((-math.sin(heading), math.cos(heading))),
    )
    hull = [antenna + u * 37.5 * ahead + v * 12.5 * aside for u in (-1, 1) for v in (-1, 1)]
    distance, _ = reach.at(ship, instant(age)).nearest_many(np.array(hull))
    assert (distance <= 1e-6).all()


@pytest.mark.parametrize("model", [Model.STRAIGHT, Model.DISC])
def test_a_set_never_shrinks_as_silence_lasts(model: Model) -> None:
    ship = tracks({**SHIP, "model": int(model), "sog_mps": 0.0, "speed_noise_mps": 0.5})
    support = [reach.at(ship, instant(t)).support(directions)[0] for t in np.arange(0, 600, 7.0)]
    assert (np.diff(support, axis=0) >= -1e-9).all()


def test_distance_support_and_outline_tell_of_the_same_grown_set() -> None:
    ship = tracks({**SHIP, "cog_rad": 0.7})
    grown = reach.at(ship, instant(400))
    kept = reach.at(ship, instant(300))
    assert grown.support(directions)[0] == pytest.approx(kept.support(directions)[0] + 1600.0 + HULL_M)
    point = np.array((9000.0, -4000.0))
    assert grown.nearest(point).distance_m == pytest.approx(kept.nearest(point).distance_m - 1600.0 - HULL_M)
    corners = grown.outline(0)
    assert np.abs(grown.nearest_many(corners)[0]).max() < 1.0


def test_a_tube_that_reaches_beyond_the_validity_holds_the_set_at_its_end() -> None:
    ship = tracks(SHIP)
    tube = reach.tube(ship, instant(200), 360.0).support(directions)
    assert (tube >= reach.at(ship, instant(360)).support(directions) - 1e-9).all()
    assert (tube >= reach.at(ship, instant(200)).support(directions) - 1e-9).all()
