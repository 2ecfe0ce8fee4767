import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.instant import Instant, instant
from companion.messages import FloatArray, Nearest, Phase, Repulsion, Tracks
from companion.planning.attraction import attraction
from companion.planning.creep import CREEP_MPS
from companion.planning.field import ExactRepulsion
from companion.planning.horizon import SHORTEST_S, Corridors, paper_until_age_s
from companion.planning.steering import Steering
from tests.builders import T0, config, own, tracks

GOAL = np.array((1230.0, 0.0))
READINGS: tuple[Literal["unit", "proportional"], ...] = ("unit", "proportional")
coordinates = st.floats(-2000, 2000)


@given(coordinates, coordinates)
def test_both_readings_of_the_attraction_are_minus_a_gradient(north: float, east: float) -> None:
    here = np.array((north, east))
    distance = math.dist(here, GOAL)
    if distance < 1:
        return

    def potential(reading: str, at: FloatArray) -> float:
        d = float(np.hypot(*(at - GOAL)))
        return 2.5 * d * d if reading == "proportional" else 5.0 * d

    for reading in READINGS:
        pull = attraction(here, GOAL, 5.0, reading)
        h = 1e-3
        numeric = [
            (potential(reading, here - step) - potential(reading, here + step)) / (2 * h)
            for step in np.eye(2) * h
        ]
        assert pull == pytest.approx(numeric, rel=1e-5, abs=1e-5)


def test_at_the_goal_the_unit_pull_is_nothing() -> None:
    assert attraction(GOAL, GOAL, 5.0, "unit").tolist() == [0.0, 0.0]


def test_full_force_balance_lies_where_the_paper_found_its_closest_approach() -> None:
    settings = config()
    ship = tracks({"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "north_m": 100.0})
    field = ExactRepulsion(settings.field)
    d = settings.field.delta_m + (settings.field.k_r / settings.field.k_p) ** (1 / 3)
    push = field(ship, T0, np.array([600.0]), np.array((100.0 - 37.5 - d, 0.0)))
    pull = attraction(np.array((100.0 - 37.5 - d, 0.0)), GOAL, settings.field.k_p, "unit")
    assert d == pytest.approx(19.42, abs=0.01)
    assert push.velocity.sum(axis=0) + pull == pytest.approx((0.0, 0.0), abs=1e-3)


class Still:
    """A field that pushes with a given velocity."""

    def __init__(self, *push: tuple[float, float]) -> None:
        self.push = np.array(push)

    def __call__(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray, position_m: FloatArray
    ) -> Repulsion:
        speed = np.hypot(*self.push.T)[:, None]
        away = self.push / np.where(speed > 0, speed, 1.0)
        nearest = Nearest(np.full(len(self.push), 50.0), away)
        return Repulsion(nearest, self.push, np.ones(len(self.push), dtype=bool))


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0, 100))
def test_the_wanted_velocity_keeps_the_vehicles_limits(north: float, east: float, depth: float) -> None:
    settings = config()
    steering = Steering(settings, Still((north, east)))
    ships = tracks({"north_m": 100.0})
    state = own(depth_m=depth)
    push = steering.repulsion(ships, T0, state, GOAL)
    pull = steering.attraction(state, GOAL, Phase.CROSS)
    vn, ve, vd = steering.velocity(state, ships, pull, push, 45.0)
    assert math.hypot(vn, ve) <= settings.vehicle.max_speed_mps + 1e-9
    assert abs(vd) <= settings.vehicle.max_vertical_speed_mps
    assert vd * (45.0 - depth) >= 0


def test_a_boat_at_rest_creeps_along_its_heading_instead_of_turning_north() -> None:
    settings = config(vehicle={"cruise_depth_m": 0.0})
    state = own(depth_m=0.0)
    state = type(state)(state.stamp, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), math.pi)
    velocity = Steering(settings, Still()).velocity(state, Tracks.empty(), np.zeros(2), None, 0.0)
    assert velocity == pytest.approx((-CREEP_MPS, 0.0, 0.0))


def test_while_listening_only_ships_move_the_vehicle() -> None:
    steering = Steering(config(), Still((0.0, 1.0)))
    state = own(depth_m=0.0)
    pull = steering.attraction(state, GOAL, Phase.LISTEN)
    assert steering.velocity(state, Tracks.empty(), pull, None, 0.0) == (0.0, 0.0, 0.0)


def test_passing_astern_turns_the_push_toward_the_stern() -> None:
    settings = config(planner={"horizon": "clearing", "astern_gain": 0.5})
    ship = tracks({"north_m": 100.0, "cog_rad": math.pi / 2})  # eastbound, north of us
    steering = Steering(settings, Still((-1.0, 0.0)))
    state = own()
    push = steering.repulsion(ship, T0, state, GOAL)
    velocity = steering.velocity(state, ship, np.zeros(2), push, 45.0)
    assert velocity == pytest.approx((-1.0, -0.5, 0.0))


def test_the_paper_looks_ahead_to_the_same_instant_for_every_ship() -> None:
    ships = tracks({"measured_at_s": -100.0}, {"measured_at_s": -10.0})
    assert paper_until_age_s(ships, config().field).tolist() == [600.0, 600.0]


def test_clearing_looks_ahead_until_the_corridor_is_behind_us() -> None:
    settings = config()
    ships = tracks(
        {"north_m": 200.0, "east_m": -900.0, "cog_rad": math.pi / 2},  # crosses ahead of us
        {"north_m": -300.0, "east_m": -900.0, "cog_rad": math.pi / 2},  # its corridor lies behind us
    )
    until = Corridors().clearing_until_age_s(
        ships,
        instant(60),
        np.zeros(2),
        GOAL,
        settings.vehicle.max_speed_mps,
        settings.field,
        settings.planner,
    )
    ahead_s, behind_s = until - 60.0
    assert 1.3 * 200 / 2.5 < ahead_s < 1.3 * 400 / 2.5
    assert behind_s == SHORTEST_S
