"""A ship that turns: no sampled ship escapes; straight ships are its limit; models live side by side."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import reach
from companion.instant import instant
from companion.messages import Model, Tracks
from companion.reach.shapes import only
from companion.reach.swept import Turn, swept_support
from tests.builders import T0, tracks
from tests.ships import plane, random_ships, random_turns, swing

TOLERANCE_M = 1e-9
ANGLE = np.linspace(0, 2 * np.pi, 90, endpoint=False)
NORMAL = np.column_stack((np.cos(ANGLE), np.sin(ANGLE)))


def worst_escape_m(rng: np.random.Generator, ships: Tracks, last_s: float, each: int) -> float:
    """The largest signed distance of sampled points to their own ship's tube; sound if <= 0."""
    worst, age = -np.inf, ships.age_s(T0)
    for i in range(len(ships)):
        until = age[i] + rng.uniform(0, last_s)
        points = swing(rng, ships, i, age[i], until, each)
        distance, _ = reach.tube(only(ships, np.array([i])), T0, until).nearest_many(plane(points))
        worst = max(worst, float(distance.max()))
    return worst


def test_no_sampled_turning_ship_escapes_its_tube() -> None:
    rng = np.random.default_rng(1)
    assert worst_escape_m(rng, random_turns(rng, 25), 300.0, 1500) <= TOLERANCE_M


def test_no_sampled_turning_ship_escapes_its_set_at_one_time() -> None:
    rng = np.random.default_rng(2)
    assert worst_escape_m(rng, random_turns(rng, 25), 0.0, 1500) <= TOLERANCE_M


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_swept_support_is_the_integral_of_the_best_velocity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ship = random_turns(rng, 1, speed_noise_mps=np.array([0.2]), sog_mps=rng.uniform(0.5, 12, 1))
    turn = Turn(*(float(column[0]) for column in turn_columns(ship)))
    end = rng.uniform(1, 250)
    angle = rng.uniform(-np.pi, np.pi, (6, 1))
    s = (np.arange(40_000) + 0.5) / 40_000 * end
    low, high = turn.course_limits(s)
    off = np.abs(np.remainder(angle - 0.5 * (low + high) + np.pi, 2 * np.pi) - np.pi) - 0.5 * (high - low)
    cosine = np.cos(np.maximum(off, 0.0))
    speed = np.where(cosine > 0, turn.speed + turn.speed_noise, turn.speed - turn.speed_noise)
    whole_turn = 2 * np.pi / max(abs(turn.rate) + turn.rate_error, 1e-12)
    if end < whole_turn:
        expected = (speed * cosine).mean(axis=1) * end
        at_end = swept_support(turn, np.array([end]), np.array([end]), angle)[:, 0]
        assert at_end == pytest.approx(expected, abs=1e-3)


def turn_columns(t: Tracks) -> list[np.ndarray]:
    return [
        t.cog_rad,
        t.sog_mps,
        t.speed_noise_mps,
        t.course_noise_rad,
        t.turn_rate_radps,
        t.turn_rate_error_radps,
        t.heading_rad,
        t.heading_error_rad,
        t.bow_m,
        t.stern_m,
        t.port_m,
        t.starboard_m,
        t.position_error_m,
    ]


def test_a_ship_that_does_not_turn_has_nearly_the_straight_set() -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        ship = random_ships(
            rng,
            1,
            sog_mps=rng.uniform(1, 12, 1),
            speed_noise_mps=np.array([0.25]),
            course_noise_rad=np.array([0.05]),
            heading_error_rad=np.array([0.05]),
            measured_at_ns=np.array([-100_000_000_000]),
        )
        straight = reach.tube(ship, T0, 300.0).support(NORMAL)
        turning = reach.tube(replace(ship, model=np.array([2])), T0, 300.0).support(NORMAL)
        assert (turning - straight).min() >= -TOLERANCE_M
        assert (turning - straight).max() <= 3.0


def test_a_known_turn_bends_the_tube_away_from_the_straight_course() -> None:
    ahead = tracks({"model": int(Model.TURNING), "sog_mps": 8.0})
    ship = replace(ahead, turn_rate_radps=np.array([0.01]), turn_rate_error_radps=np.array([0.001]))
    sets = reach.tube(ship, instant(100.0), 150.0)
    circle = 8.0 / 0.01 * np.array([[np.sin(1.2), 1 - np.cos(1.2)]])  # after 120 s
    straight_on = np.array([[960.0, 0.0]])
    distance, _ = sets.nearest_many(np.concatenate((circle, straight_on)))
    assert distance[0, 0] < 0
    assert distance[1, 0] > 200.0


def test_the_turning_tube_is_not_much_larger_than_what_is_reached() -> None:
    rng = np.random.default_rng(5)
    ship = random_turns(
        rng,
        1,
        sog_mps=np.array([8.0]),
        speed_noise_mps=np.array([0.25]),
        course_noise_rad=np.array([0.05]),
        turn_rate_radps=np.array([0.005]),
        turn_rate_error_radps=np.array([0.001]),
        measured_at_ns=np.array([-60_000_000_000]),
        **dict.fromkeys(("bow_m", "stern_m", "port_m", "starboard_m", "position_error_m"), np.zeros(1)),
    )
    ours = shapely.union_all([shapely.Polygon(p) for p in reach.tube(ship, T0, 180.0).outlines(0)])
    times = np.arange(60.0, 181.0, 4.0)
    reached = shapely.union_all(
        [shapely.MultiPoint(plane(swing(rng, ship, 0, t, t, 4000))).convex_hull for t in times]
    )
    assert ours.area < 1.25 * reached.area


def test_a_set_at_one_time_lies_in_the_tube_but_for_the_looseness_of_its_own_tangents() -> None:
    ships = random_turns(np.random.default_rng(6), 10, measured_at_ns=np.zeros(10, dtype=np.int64))
    whole = reach.tube(ships, T0, 120.0).support(NORMAL)
    for age in (0.0, 0.3, 60.0, 119.9):
        assert (reach.at(ships, instant(age)).support(NORMAL) - whole).max() <= 1.0


def test_contacts_of_all_models_answer_side_by_side_as_they_do_alone() -> None:
    rng = np.random.default_rng(7)
    ships = random_turns(rng, 12, model=np.arange(12) % 3)
    positions = rng.normal(0, 6000, (30, 2))
    sets = reach.tube(ships, T0, 200.0)
    distance, away = sets.nearest_many(positions)
    for i in range(12):
        alone = reach.tube(only(ships, np.array([i])), T0, 200.0)
        one_distance, one_away = alone.nearest_many(positions)
        assert distance[:, i] == pytest.approx(one_distance[:, 0], abs=1e-9)
        assert away[:, i] == pytest.approx(one_away[:, 0], abs=1e-9)
        assert sets.outline(i) == pytest.approx(alone.outline(0), abs=1e-6)
    for k, position in enumerate(positions):
        assert sets.nearest(position).distance_m == pytest.approx(distance[k], abs=1e-9)


def test_a_model_nobody_wrote_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tracks\.model"):
        reach.at(tracks({"model": 9}), T0)
