"""A way out along what the planner intends: rolled out by the guard's own model, checked and flown."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from companion.instant import after, instant
from companion.messages import FloatArray, OwnState
from companion.planning.guard import Guard, Intended
from companion.planning.guard.beginning import Beginning, begin
from companion.planning.guard.course import Rolled, course_to, following, joined
from companion.planning.guard.rollout import held, motion_of
from companion.planning.guard.search import Search
from companion.planning.guard.way_out import WayOut
from companion.reach import at
from tests.builders import T0, config, heartbeat, own, tracks

SETTINGS = config()
VEHICLE = SETTINGS.vehicle
LIMIT = 2.3


def beginning(state: OwnState, at_s: float = 0.0) -> Beginning:
    return begin(instant(at_s), state, (0.0, 2.3), (0.0, 2.3), 0.1, SETTINGS)


def sailing(east_m: float = 0.0, at_s: float = 0.0, north_m: float = 0.0) -> OwnState:
    state = own(north_m, east_m, at_s=at_s)
    return replace(state, velocity_ned_mps=(0.0, 2.3, 0.0), heading_rad=math.pi / 2)


def bending(begin_s: float = 0.0, speed: float = 2.3, end_s: float = 120.0) -> Intended:
    """East for 40 s, north for 40 s, east again."""
    t = np.arange(0.0, end_s + 1.0)
    north = (t >= 40) & (t < 80)
    velocity = speed * np.column_stack((north, ~north))
    place = np.vstack((np.zeros(2), np.cumsum(velocity[:-1], axis=0)))
    return Intended(instant(begin_s), t, place[:, 0], place[:, 1], velocity.astype(np.float64))


def followed(first: Beginning, intended: Intended, at_s: float = 0.0) -> Rolled:
    rolled = following(instant(at_s), first, intended, 300.0, LIMIT, VEHICLE)
    assert rolled is not None
    return rolled


def places(way_out: WayOut, times: FloatArray) -> FloatArray:
    return np.array([way_out.position_m(after(T0, float(t))) for t in times])


def test_what_is_intended_is_followed_as_the_vehicle_can() -> None:
    meant = bending(speed=2.0)
    rolled = followed(beginning(sailing()), meant)
    assert np.hypot(*rolled.moving_mps.T).max() <= LIMIT + 1e-9
    fine = rolled.orders.t_s
    north, east = np.interp(fine, rolled.t_s, rolled.north_m), np.interp(fine, rolled.t_s, rolled.east_m)
    off = np.hypot(
        north - np.interp(fine, meant.t_s, meant.north_m), east - np.interp(fine, meant.t_s, meant.east_m)
    )
    assert off.max() < 15.0  # it cannot turn on the spot
    assert off[-1] < 3.0


def test_a_faster_intention_is_followed_no_faster_than_the_guard_believes_in() -> None:
    rolled = followed(beginning(sailing()), bending(speed=9.0))
    assert np.hypot(*rolled.moving_mps.T).max() <= LIMIT + 1e-9
    assert np.hypot(*rolled.orders.velocity_mps.T).max() <= LIMIT + 1e-9


def test_a_course_is_flown_where_it_was_planned() -> None:
    first = beginning(sailing())
    rolled = followed(first, bending())
    course = course_to(T0, first, rolled, len(rolled.t_s) - 1, VEHICLE.speed_lag_s)
    state, sent, off = sailing(), (0.0, 2.3), []
    motion, queue = motion_of(state, 0.0, 0.0), [sent] * 5
    for step in range(1400):
        now = instant(0.1 * step)
        here = OwnState(
            now, motion.north_m, motion.east_m, 45.0, (*motion.velocity_mps, 0.0), motion.heading_rad
        )
        off.append(course.deviation_m(here))
        queue.append(course.command(now, here, SETTINGS.guard.setpoint_delay_s, VEHICLE.max_speed_mps))
        motion = held(motion, queue.pop(0), 0.1, VEHICLE)[-1]
    assert max(off) < 1.0
    assert off[-1] < 0.5
    assert math.hypot(*motion.velocity_mps) < 0.05


def test_the_same_course_again_from_where_it_leads_is_the_same_course() -> None:
    first = beginning(sailing())
    rolled = followed(first, bending())
    course = course_to(T0, first, rolled, len(rolled.t_s) - 1, VEHICLE.speed_lag_s)
    for at_s in (5.0, 30.0, 60.0, 110.0):
        north, east = course.position_m(instant(at_s))
        ahead_north, ahead_east = course.position_m(instant(at_s + 0.05))
        moving = (20 * (ahead_north - north), 20 * (ahead_east - east), 0.0)
        state = replace(
            own(north, east, at_s=at_s), velocity_ned_mps=moving, heading_rad=math.atan2(moving[1], moving[0])
        )
        told = tuple(course.orders.at(np.array((at_s,)))[0]) if course.orders is not None else ()
        again = joined(
            instant(at_s), begin(instant(at_s), state, told, told, 0.1, SETTINGS), course, LIMIT, VEHICLE
        )
        later = np.linspace(at_s, 125.0, 200)
        assert np.hypot(*(places(again, later) - places(course, later)).T).max() < 0.6
        assert again.stop_s == pytest.approx(course.stop_s - at_s)


@pytest.mark.parametrize("off_m", [(-3.0, 0.0), (2.0, 4.0), (0.0, -8.0)])
def test_a_vehicle_beside_its_course_is_led_back_and_what_is_missing_stays(
    off_m: tuple[float, float],
) -> None:
    first = beginning(sailing())
    rolled = followed(first, bending())
    course = course_to(T0, first, rolled, len(rolled.t_s) - 1, VEHICLE.speed_lag_s)
    north, east = course.position_m(instant(10.0))
    state = sailing(east + off_m[1], 10.0, north + off_m[0])
    again = joined(instant(10.0), beginning(state, 10.0), course, LIMIT, VEHICLE)
    apart = places(again, np.linspace(10.0, 130.0, 400)) - places(course, np.linspace(10.0, 130.0, 400))
    assert apart[0] == pytest.approx(off_m, abs=0.1)
    assert np.hypot(*apart.T)[-1] < np.hypot(*off_m) + 0.1
    tail = apart[200:]
    assert np.abs(tail - tail[-1]).max() < 1e-6  # one and the same course, moved
    steps = np.hypot(np.diff(again.north_m), np.diff(again.east_m)) / np.diff(again.t_s)
    assert steps.max() < LIMIT + 0.15


@pytest.mark.parametrize(
    "spoiled",
    [
        {"north_m": np.full(121, np.nan)},
        {"east_m": np.full(121, 1e300)},
        {"velocity_mps": np.full((121, 2), np.inf)},
        {"north_m": np.zeros(120)},
        {"velocity_mps": np.zeros((121, 3))},
        {"t_s": np.zeros(121)},
    ],
)
def test_an_intention_that_is_none_is_not_heard(spoiled: dict[str, Any]) -> None:
    assert bending().is_sound
    assert not replace(bending(), **spoiled).is_sound
    guard = Guard(SETTINGS)
    ship = tracks({"north_m": 60.0, "cog_rad": math.pi, "sog_mps": 2.0})
    verdict = guard.check(
        T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0), replace(bending(), **spoiled)
    )
    assert verdict == Guard(SETTINGS).check(T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0))


def test_an_intention_that_is_over_or_not_begun_gives_no_course() -> None:
    first = beginning(sailing())
    for begin_s in (-200.0, 10.0):
        assert following(T0, first, bending(begin_s), 300.0, LIMIT, VEHICLE) is None
        guard, ship = Guard(SETTINGS), tracks({"north_m": 60.0, "cog_rad": math.pi, "sog_mps": 2.0})
        told = guard.check(T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0), bending(begin_s))
        assert told == Guard(SETTINGS).check(T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0))


def test_where_stopping_is_a_way_out_nobody_need_know_what_is_intended() -> None:
    guard = Guard(SETTINGS)
    assert not guard.lies_free
    for north_m, free in ((5000.0, True), (60.0, False)):
        ship = tracks({"north_m": north_m, "cog_rad": math.pi, "sog_mps": 2.0})
        guard.check(T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0))
        assert guard.lies_free is free


def test_an_intention_into_a_ship_is_not_flown() -> None:
    """Straight at a ship that lies across: whatever is kept, its end is short of the ship."""
    ship = tracks(
        {"east_m": 120.0, "sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_rad": 0.0, "cog_rad": 0.0}
    )
    guard, t = Guard(SETTINGS), np.arange(0.0, 100.0)
    ahead = Intended(T0, t, 0 * t, 2.3 * t, np.column_stack((0 * t, 0 * t + 2.3)))
    guard.check(T0, sailing(), heartbeat(0.0), ship, 1, (0.0, 2.3, 0.0), ahead)
    kept = guard._way_out
    if kept is not None:
        for k in range(len(kept.t_s)):
            place = np.array((kept.north_m[k], kept.east_m[k]))
            assert at(ship, after(T0, float(kept.t_s[k]))).nearest(place).distance_m.min() > 7.0


def test_a_course_that_is_all_but_flown_ends_by_stopping() -> None:
    first, lag_s = beginning(sailing()), VEHICLE.speed_lag_s
    rolled = followed(first, bending(end_s=20.0))
    course = course_to(T0, first, rolled, len(rolled.t_s) - 1, lag_s)
    search = Search(VEHICLE, LIMIT, SETTINGS.guard.way_out_s)
    for before_s, is_course in ((6.0, True), (0.3, False)):
        at_s = course.stop_s - before_s
        east_m = float(course.position_m(instant(at_s))[1])
        again = search.again(instant(at_s), beginning(sailing(east_m, at_s), at_s), course)
        assert (again.orders is not None) is is_course
        assert again.end_m == pytest.approx(course.end_m, abs=1.0)


@pytest.mark.parametrize(
    ("at_s", "north_m", "east_m"), [(12.0, 2.0, 0.0), (50.0, -1.5, 2.0), (30.0, 0.0, -2.0)]
)
def test_a_course_is_led_back_to_and_its_rest_moved_by_what_is_still_missing(
    at_s: float, north_m: float, east_m: float
) -> None:
    first = beginning(sailing())
    rolled = followed(first, bending())
    course = course_to(T0, first, rolled, len(rolled.t_s) - 1, VEHICLE.speed_lag_s)
    place, soon = places(course, np.array((at_s, at_s + 0.1)))
    speed = (soon - place) / 0.1
    state = own(float(place[0]) + north_m, float(place[1]) + east_m, at_s=at_s)
    velocity = (float(speed[0]), float(speed[1]), 0.0)
    state = replace(state, velocity_ned_mps=velocity, heading_rad=math.atan2(velocity[1], velocity[0]))
    again = joined(
        instant(at_s),
        begin(instant(at_s), state, velocity[:2], velocity[:2], 0.1, SETTINGS),
        course,
        LIMIT,
        VEHICLE,
    )
    assert again.verified
    times = np.arange(at_s, course.stop_s, 0.5)
    off = places(again, times) - places(course, times)
    assert off[0] == pytest.approx((north_m, east_m), abs=0.05)
    assert np.hypot(*np.diff(off, axis=0).T).max() < 0.5  # it goes on without a leap
    assert np.hypot(*off[-1]) < math.hypot(north_m, east_m)
    assert np.hypot(*(off[-20:] - off[-1]).T).max() < 0.02  # joined: the same course, moved
