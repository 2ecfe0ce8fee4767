"""The bundled hulls: limits, inertia, current, and a boat that does not crab."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.vehicle import Demand, Dynamics, KinematicBoat, KinematicSubmarine, Limits, VehicleState

speeds = st.floats(-4.0, 4.0)
drifts = st.floats(-0.5, 0.5)


def sail(
    hull: Dynamics, demand: Demand | None, seconds: float, dt_s: float = 0.1, heading: float = 0.0
) -> VehicleState:
    state = hull.start(0.0, 0.0, 0.0, heading)
    for _ in range(round(seconds / dt_s)):
        state = hull.step(state, demand, dt_s)
    return state


@given(speeds, speeds, st.floats(-1.0, 1.0), drifts, drifts)
def test_a_submarine_makes_good_the_wanted_velocity_against_the_current(
    north: float, east: float, down: float, drift_north: float, drift_east: float
) -> None:
    hull = KinematicSubmarine(Limits(), (drift_north, drift_east))
    through = math.hypot(north - drift_north, east - drift_east)
    state = sail(hull, Demand((north, east, down)), 90.0)
    if 0.1 < through < 2.5:
        assert state.velocity_ned_mps[:2] == pytest.approx((north, east), abs=0.01)
    water = math.hypot(state.velocity_ned_mps[0] - drift_north, state.velocity_ned_mps[1] - drift_east)
    assert water <= 2.5 + 1e-9
    assert state.depth_m >= 0.0


@given(speeds, speeds)
def test_a_boat_turns_velocity_into_heading_and_never_leaves_the_surface(north: float, east: float) -> None:
    state = sail(KinematicBoat(Limits()), Demand((north, east, 0.5)), 60.0)
    assert state.depth_m == 0.0
    wanted = min(math.hypot(north, east), 2.5)
    assert math.hypot(*state.velocity_ned_mps[:2]) == pytest.approx(wanted, abs=1e-3)
    if wanted > 0.01:
        assert math.cos(state.heading_rad - math.atan2(east, north)) == pytest.approx(1.0, abs=1e-9)


def test_a_boat_in_a_cross_current_is_set_off_course_because_it_does_not_crab() -> None:
    state = sail(KinematicBoat(Limits(), (0.0, 0.5)), Demand((2.0, 0.0, 0.0)), 60.0)
    north, east, _ = state.velocity_ned_mps
    assert math.degrees(math.atan2(east, north)) == pytest.approx(14.0, abs=1.0)  # measured: 15


def test_a_zero_velocity_turns_a_boat_north_and_holding_does_not() -> None:
    swung = sail(KinematicBoat(), Demand((0.0, 0.0, 0.0)), 30.0, heading=math.pi / 2)
    held = sail(KinematicBoat(), Demand((0.0, 0.0, 0.0), hold_heading=True), 30.0, heading=math.pi / 2)
    assert swung.heading_rad == pytest.approx(0.0, abs=1e-9)
    assert held.heading_rad == pytest.approx(math.pi / 2)


def test_speed_follows_a_lag_of_two_seconds() -> None:
    state = sail(KinematicSubmarine(), Demand((2.0, 0.0, 0.0)), 2.0)
    assert state.speed_mps == pytest.approx(2.0 * (1.0 - math.exp(-1.0)), rel=1e-9)


def test_a_reversal_takes_the_time_of_the_turn_rate() -> None:
    hull = KinematicSubmarine()
    state = sail(hull, Demand((2.5, 0.0, 0.0)), 30.0)
    for _ in range(150):  # pi / 0.2 = 15.7 s
        state = hull.step(state, Demand((-2.5, 0.0, 0.0)), 0.1)
    assert abs(state.heading_rad) == pytest.approx(0.2 * 15.0, abs=1e-9)


def test_motors_off_means_drifting_with_the_current() -> None:
    state = sail(KinematicSubmarine(Limits(), (0.3, -0.2)), None, 100.0)
    assert (state.north_m, state.east_m) == pytest.approx((30.0, -20.0))


def test_halving_the_step_changes_the_path_by_second_order_only() -> None:
    path = Demand((1.0, 2.0, 0.3))
    coarse, fine = (sail(KinematicSubmarine(), path, 40.0, dt) for dt in (0.1, 0.05))
    assert math.hypot(coarse.north_m - fine.north_m, coarse.east_m - fine.east_m) < 0.05
