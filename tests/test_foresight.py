"""The planner played forward: what it says it will do is what it then does."""

from dataclasses import replace

import numpy as np
import pytest

from companion.instant import instant
from companion.messages import Model, Tracks
from companion.planning.foresight import EVERY_S, Foresight
from tests.builders import config, own, tracks

SETTINGS = config(timing={"rate_hz": 5.0, "setpoint_validity_s": 1.0})
GOAL_M = np.array((0.0, 400.0))
SHIP = tracks({"east_m": 200.0, "north_m": -150.0, "cog_rad": 0.0, "sog_mps": 2.0})


def looked(ships: Tracks, steps: int = 60, goal_m: object = GOAL_M) -> Foresight:
    foresight = Foresight(SETTINGS)
    for step in range(steps):
        foresight.look(instant(0.2 * step), own(), ships, np.asarray(goal_m))
    return foresight


def test_it_is_played_a_few_moments_a_step_from_where_the_vehicle_is_to_the_goal() -> None:
    assert looked(SHIP, 3).intended is None
    intended = looked(SHIP, 28).intended
    assert intended is not None
    assert intended.is_sound
    assert intended.begin == instant(0.0)
    assert (intended.north_m[0], intended.east_m[0]) == (0.0, 0.0)
    assert np.hypot(intended.north_m[-1], intended.east_m[-1] - 400.0) <= SETTINGS.goal.radius_m
    assert np.abs(intended.north_m).max() > 5.0  # around the ship
    assert np.hypot(*intended.velocity_mps.T).max() <= 2.3 + 1e-9  # full speed less the declared current


def test_a_goal_too_far_is_looked_for_as_long_as_a_way_out_may_last() -> None:
    intended = looked(SHIP, goal_m=(0.0, 9000.0)).intended
    assert intended is not None
    assert intended.t_s[-1] == SETTINGS.guard.way_out_s
    assert intended.velocity_mps[-1] == pytest.approx((0.0, 0.0))


def test_it_begins_again_every_few_seconds_and_forgets_when_told_to() -> None:
    foresight = looked(SHIP, 250)
    assert foresight.intended is not None
    assert foresight.intended.begin > instant(EVERY_S)
    foresight.forget()
    assert foresight.intended is None


def test_ships_far_away_silent_too_long_or_turning_are_left_to_the_guard() -> None:
    straight = looked(tracks({"east_m": 9000.0})).intended
    assert straight is not None
    for ship in (
        replace(SHIP, model=np.array([Model.TURNING])),
        replace(SHIP, validity_s=np.array([0.0]), measured_at_ns=np.array([-(10**9)])),
        tracks({"east_m": 200.0, "north_m": 60_000.0}),
    ):
        intended = looked(ship).intended
        assert intended is not None
        assert np.array_equal(intended.north_m, straight.north_m)
