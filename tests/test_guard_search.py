"""The search against trying every manoeuvre in turn, and what it says of those it makes."""

import math

import numpy as np
import pytest

from companion.config import Vehicle
from companion.messages import Tracks
from companion.planning.guard.beginning import begin
from companion.planning.guard.clearance import Clearance, Paths
from companion.planning.guard.margins import Margins
from companion.planning.guard.search import Search
from companion.planning.guard.way_out import WayOut
from companion.reach import Slices
from tests.builders import T0, config, own, tracks

VEHICLE = Vehicle()


@pytest.fixture
def search() -> Search:
    return Search(VEHICLE, 2.3, 300.0)


FIRST = begin(T0, own(), (1.0, 0.0), (1.5, 1.0), 0.5, config())
HALF_TURN_S = math.pi / VEHICLE.max_turn_rate_radps
STOPS_S = (8.0, 15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 300.0)
STILL = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "validity_s": 1500.0}


def clearance_of(ships: Tracks) -> Clearance:
    return Clearance(Slices.of(ships), T0, Margins(5.0, 2.0, 0.0, 3.0, 0.0), 2.5, 20.0, np.zeros(2))


def crowd(seed: int) -> Tracks:
    """Ships around the vehicle, some of which pass where it could stop."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(9):
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(70.0, 450.0)
        rows.append(
            {
                "north_m": far * math.cos(angle),
                "east_m": far * math.sin(angle),
                "cog_rad": rng.uniform(-math.pi, math.pi),
                "sog_mps": rng.choice((0.0, 2.0, 5.0)),
                "validity_s": 200.0,
            }
        )
    return tracks(*rows)


def manoeuvres(search: Search, toward: float, wait_s: float) -> list[tuple[float, WayOut]]:
    """Sixteen ways at full speed, eight at half, and none, each with every place to stop; and their costs."""
    ways = [(toward + k * math.tau / 16, 2.3) for k in range(16)]
    ways += [(toward + k * math.tau / 8, 1.15) for k in range(8)] + [(FIRST.end.heading_rad, 0.0)]
    turned = wait_s > 0
    first = FIRST.waiting(wait_s + HALF_TURN_S, VEHICLE.speed_lag_s) if turned else FIRST
    grid = search._runner.t_s
    made = []
    for direction, speed in ways:
        for stop_s in sorted({float(grid[grid >= least_s - 1e-9].min()) for least_s in STOPS_S}):
            plan = search._straight(T0, first, direction, speed, stop_s, verified=True, turned=turned)
            made.append((first.end_s + stop_s + 60.0 * (1 - math.cos(direction - toward)), plan))
    return made


@pytest.mark.parametrize("wait_s", [0.0, 30.0])
@pytest.mark.parametrize("seed", range(6))
def test_it_finds_the_cheapest_of_all_manoeuvres_that_are_clear(
    search: Search, seed: int, wait_s: float
) -> None:
    toward = (0.4, -2.0, 2.9)[seed % 3]
    clearance = clearance_of(crowd(seed))
    wanted = 2.0 * math.cos(toward), 2.0 * math.sin(toward)
    found, best = search.best(T0, FIRST, wanted, clearance, wait_s)
    costs = [
        (cost, plan)
        for cost, plan in manoeuvres(search, toward, wait_s)
        if search.is_clear(plan, T0, clearance)
    ]
    if found is None:
        assert costs == []
        assert not best.verified
        return
    cheapest = min(costs, key=lambda each: each[0])[0]
    same = [plan for cost, plan in costs if cost < cheapest + 1e-9]
    assert any(
        found.stop_s == pytest.approx(plan.stop_s) and found.velocity_mps == pytest.approx(plan.velocity_mps)
        for plan in same
    )
    assert search.is_clear(found, T0, clearance)
    assert found.verified
    assert (np.diff(found.t_s) > 0).all()
    assert (found.run_s, found.turn_s) == pytest.approx(
        (FIRST.end_s + wait_s + HALF_TURN_S, HALF_TURN_S) if wait_s else (FIRST.end_s, 0.0)
    )


def test_both_outcomes_are_among_those_scenes(search: Search) -> None:
    found = [
        search.best(T0, FIRST, (2.0, 0.0), clearance_of(crowd(seed)))[0] is not None for seed in range(6)
    ]
    assert any(found)


def test_what_is_clear_on_the_way_must_be_clear_to_stay(search: Search) -> None:
    """Nothing is near while it runs north; then a ship passes where it rests."""
    plan = search._straight(T0, FIRST, 0.0, 2.3, 30.0, verified=True)
    north, east = plan.end_m
    later = {"sog_mps": 5.0, "speed_noise_mps": 0.0, "cog_rad": -math.pi / 2, "validity_s": 1500.0}
    comes = tracks({**later, "north_m": north, "east_m": east + 1500.0})
    clearance = clearance_of(comes)
    room = search.room(plan, T0, clearance, 30.0)
    on_the_way = clearance.room(Paths(plan.t_s, plan.north_m[None], plan.east_m[None]), 30.0)[0]
    assert on_the_way.min() > 0
    assert room[:-1] == pytest.approx(on_the_way[:-1])
    at_rest = clearance.room_to_stay(plan.t_s[-1:], plan.north_m[-1:], plan.east_m[-1:], 30.0)[0]
    assert room[-1] == at_rest < 0
    assert not search.is_clear(plan, T0, clearance)


@pytest.mark.parametrize(("spare_m", "clear"), [(0.3, True), (-0.3, False)])
def test_clear_means_some_room_however_little(search: Search, spare_m: float, clear: bool) -> None:
    plan = search._straight(T0, FIRST, 0.0, 2.3, 60.0, verified=True)
    ahead = tracks({**STILL, "north_m": plan.end_m[0] + 37.5 + 10.15 + spare_m, "east_m": plan.end_m[1]})
    assert search.is_clear(plan, T0, clearance_of(ahead)) is clear
    aside = {**STILL, "north_m": 40.0, "bow_m": 300.0, "east_m": plan.east_m.max() + 12.5 + 10.15 + spare_m}
    assert search.is_clear(plan, T0, clearance_of(tracks(aside))) is clear


@pytest.mark.parametrize(("spare_s", "waits"), [(0.01, True), (-0.01, False)])
def test_it_waits_again_only_if_there_is_the_time_to_turn(
    search: Search, spare_s: float, waits: bool
) -> None:
    wait_s = FIRST.end_s + HALF_TURN_S + spare_s
    plan = search.toward(T0, FIRST, (-200.0, 50.0), 2.3, wait_s)
    assert plan.run_s == pytest.approx(wait_s if waits else FIRST.end_s)
    assert plan.turn_s == pytest.approx(HALF_TURN_S if waits else 0.0)
    assert search.toward(T0, FIRST, (-200.0, 50.0), 2.3).run_s == pytest.approx(FIRST.end_s)


@pytest.mark.parametrize("far_m", [9.0, 12.0, 40.0, 171.3])
def test_straight_ahead_it_stops_at_the_very_place(search: Search, far_m: float) -> None:
    end = FIRST.end
    ahead = np.array((math.cos(end.heading_rad), math.sin(end.heading_rad)))
    place = np.array((end.north_m, end.east_m)) + far_m * ahead
    plan = search.toward(T0, FIRST, (float(place[0]), float(place[1])), 2.3)
    gone = (np.array(plan.end_m) - (end.north_m, end.east_m)) @ ahead
    assert gone == pytest.approx(far_m, abs=0.15)
    assert plan.verified


def test_stopping_is_clear_by_its_callers_word_and_takes_its_time(search: Search) -> None:
    plan = search.stop(T0, FIRST)
    assert plan.verified
    assert (plan.speed_mps, plan.turn_s) == (0.0, 0.0)
    assert plan.stop_s == pytest.approx(FIRST.end_s + 8.0)
    assert plan.t_s[: len(FIRST.t_s)] == pytest.approx(FIRST.t_s)
    assert (np.diff(plan.t_s) > 0).all()


@pytest.mark.parametrize("length_s", [300.0, 100.0, 90.0, 30.0])
def test_it_may_stop_at_the_end_of_the_longest_run(length_s: float) -> None:
    search = Search(VEHICLE, 2.3, length_s)
    stops = search._runner.t_s[search._stops]
    assert stops[-1] == search._runner.t_s[-1] >= length_s - 4.0
    assert stops[0] == 8.0
    assert len(set(stops)) == len(stops)
