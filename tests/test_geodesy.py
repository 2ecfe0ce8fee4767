import math

import pymap3d.vincenty
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.geodesy import LocalFrame, wrap_pi


@given(st.floats(-80, 80), st.floats(-180, 180), st.floats(-30_000, 30_000), st.floats(-30_000, 30_000))
def test_there_and_back_is_the_same_place(lat: float, lon: float, north: float, east: float) -> None:
    frame = LocalFrame(lat, lon)
    back = frame.to_local(*frame.to_geodetic(north, east))
    assert back == pytest.approx((north, east), abs=0.02)


@given(st.floats(-80, 80), st.floats(-179, 179), st.floats(0, 2 * math.pi), st.floats(1, 20_000))
def test_distance_and_bearing_are_the_ellipsoids(
    lat: float, lon: float, bearing: float, distance: float
) -> None:
    there = pymap3d.vincenty.vreckon(lat, lon, distance, math.degrees(bearing))
    north, east = LocalFrame(lat, lon).to_local(float(there[0]), float(there[1]))
    assert math.hypot(north, east) == pytest.approx(distance, rel=1e-5, abs=0.01)
    assert abs(wrap_pi(math.atan2(east, north) - bearing)) < 1e-3 + 0.01 / distance


@given(st.floats(-1e4, 1e4))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_pi(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)
