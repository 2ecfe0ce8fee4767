"""The parts a way out is put together from, number by number: beginning, waiting, stopping, margins."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from companion.instant import Instant, instant
from companion.messages import FloatArray, Tracks
from companion.planning.guard import Guard
from companion.planning.guard.beginning import Beginning, begin
from companion.planning.guard.berth import LEAST_M, Berth, to_stop_m
from companion.planning.guard.beside import Beside
from companion.planning.guard.clearance import Clearance, Paths, _to_segment
from companion.planning.guard.margins import BETWEEN_M, Margins
from companion.planning.guard.rollout import Motion, Runner, held
from companion.planning.guard.search import Search, _first_s
from companion.planning.guard.vertical import Dive
from companion.planning.guard.way_out import STOP_S, WayOut, stopped
from companion.reach import Slices
from tests.builders import T0, config, heartbeat, own, tracks

SETTINGS = config()
VEHICLE = SETTINGS.vehicle
STILL = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "cog_rad": 0.0}


# ---------------------------------------------------------------- beginning and waiting


def test_a_beginning_is_what_was_sent_for_the_delay_and_then_the_command() -> None:
    settings = config(guard={"setpoint_delay_s": 0.5})
    state = replace(own(3.0, -4.0, at_s=-0.2), velocity_ned_mps=(1.0, 0.5, 0.0), heading_rad=0.4)
    begun = begin(T0, state, (2.0, 1.0), (-1.0, 2.0), 0.75, settings)
    start = Motion(
        3.2,
        -3.9,
        0.4,
        math.cos(0.4) + 0.5 * math.sin(0.4),
        1.0 - math.cos(0.4) * (math.cos(0.4) + 0.5 * math.sin(0.4)),
        0.5 - math.sin(0.4) * (math.cos(0.4) + 0.5 * math.sin(0.4)),
    )
    first = held(start, (2.0, 1.0), 0.5, VEHICLE)
    then = held(first[-1], (-1.0, 2.0), 0.75, VEHICLE)
    motions = [start, *first, *then]
    assert begun.t_s == pytest.approx((0.0, 0.25, 0.5, 0.75, 1.0))
    assert begun.end_s == pytest.approx(1.25)
    assert begun.north_m == pytest.approx([m.north_m for m in motions[:-1]])
    assert begun.east_m == pytest.approx([m.east_m for m in motions[:-1]])
    assert begun.end == then[-1]


def test_a_beginning_of_no_time_is_the_vehicle_itself() -> None:
    at_once = config(guard={"setpoint_delay_s": 0.0})
    begun = begin(T0, replace(own(3.0), heading_rad=None), (0.0, 0.0), (0.0, 1.0), 0.0, at_once)
    assert (len(begun.t_s), begun.end_s) == (0, 0.0)
    # at rest and without a heading it is taken to lie against the command
    assert begun.end.heading_rad == pytest.approx(math.pi * 1.5)


@pytest.mark.parametrize(
    ("wait_s", "times"),
    [
        (0.75, (0.5,)),
        (5.0, (0.5, 1, 1.5, 2, 3, 4)),
        (8.0, (0.5, 1, 1.5, 2, 3, 4, 6)),
        (30.0, (0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 20, 24, 28)),
    ],
)
def test_waiting_is_coasting_to_rest_point_by_point(wait_s: float, times: tuple[float, ...]) -> None:
    before = np.array((0.0, 0.25))
    end = Motion(10.0, 5.0, 0.3, 2.0, 0.4, -0.7)
    waited = Beginning(before, before + 8.0, before + 4.0, 0.6, end).waiting(wait_s, 2.0)
    t = np.array((0.0, *times))
    v_north, v_east = 2.0 * math.cos(0.3) + 0.4, 2.0 * math.sin(0.3) - 0.7
    gone_s = 2.0 * (1 - np.exp(-t / 2.0))
    assert waited.t_s == pytest.approx((0.0, 0.25, *(0.6 + t)))
    assert waited.north_m == pytest.approx((8.0, 8.25, *(10.0 + v_north * gone_s)))
    assert waited.east_m == pytest.approx((4.0, 4.25, *(5.0 + v_east * gone_s)))
    left = math.exp(-wait_s / 2.0)
    assert waited.end_s == pytest.approx(0.6 + wait_s)
    expected = (10.0 + v_north * 2 * (1 - left), 5.0 + v_east * 2 * (1 - left), 0.3, 2 * left)
    found = waited.end
    assert (found.north_m, found.east_m, found.heading_rad, found.forward_mps) == pytest.approx(expected)
    assert (found.aside_north_mps, found.aside_east_mps) == pytest.approx((0.4 * left, -0.7 * left))


# ---------------------------------------------------------------- stopping, and following


def test_stopping_coasts_for_the_lags_length_along_the_heading() -> None:
    before = np.array((0.0, 2.0, 7.0))
    t, north, east = stopped(before, before + 1.0, before - 3.0, 2.0, 1.5, 2.0)
    run = 3.0 * (1 - np.exp(-STOP_S / 2.0))
    run[-1] = 3.0  # the last point is where it rests, all of the way
    assert t == pytest.approx((*before, *(7.0 + STOP_S)))
    assert north == pytest.approx((1.0, 3.0, 8.0, *(8.0 + run * math.cos(2.0))))
    assert east == pytest.approx((-3.0, -1.0, 4.0, *(4.0 + run * math.sin(2.0))))


def way_out(speed: float = 2.0, run_s: float = 40.0, turn_s: float = 10.0, stop_s: float = 60.0) -> WayOut:
    """Waits, turns on the spot, then runs north-east."""
    t = np.array((0.0, run_s, stop_s, stop_s + 12.0))
    far = speed * (stop_s - run_s)
    north, east = np.array((0.0, 0.0, 0.6 * far, 0.6 * far)), np.array((0.0, 0.0, 0.8 * far, 0.8 * far))
    velocity = (0.6 * speed, 0.8 * speed)
    return WayOut(T0, t, north, east, velocity, stop_s, verified=True, run_s=run_s, turn_s=turn_s)


@pytest.mark.parametrize(
    ("acts_s", "command"),
    [
        (29.9, (0.0, 0.0)),
        (30.0, (0.06, 0.08)),  # turns on the spot
        (39.9, (0.06, 0.08)),
        (40.0, (1.2, 1.6)),
        (59.9, (1.2, 1.6)),
        (60.0, (0.0, 0.0)),
    ],
)
def test_it_waits_turns_runs_and_stops_each_a_delay_ahead(
    acts_s: float, command: tuple[float, float]
) -> None:
    plan, now = way_out(), instant(acts_s - 0.5)
    north, east = plan.position_m(now)
    state = own(north, east, at_s=acts_s - 0.5)
    assert plan.command(now, state, 0.5, 2.5) == pytest.approx(command, abs=1e-9)


def test_it_says_how_long_it_still_waits_and_what_is_still_to_come() -> None:
    plan = way_out()
    assert [plan.wait_s(instant(t)) for t in (0.0, 15.0, 40.0, 50.0)] == [40.0, 25.0, 0.0, 0.0]
    t, north, east = plan.rest(instant(50.0))
    assert t == pytest.approx((0.0, 10.0, 22.0))
    assert north == pytest.approx((12.0, 24.0, 24.0))
    assert east == pytest.approx((16.0, 32.0, 32.0))


def test_at_no_speed_nothing_is_turned_to() -> None:
    slow = way_out(speed=0.5).command(instant(35.0), own(at_s=35.0), 0.5, 2.5)
    assert slow == pytest.approx((0.06, 0.08))
    assert way_out(speed=0.0).command(instant(35.0), own(at_s=35.0), 0.5, 2.5) == (0.0, 0.0)


# ---------------------------------------------------------------- margins


def test_the_margins_are_the_declared_ones_added_up() -> None:
    settings = config(guard={"own_position_drift_mps": 0.02})
    below = Margins.of(settings, 100.0, 7.0)
    delta, guard = settings.field.delta_m, settings.guard
    still = delta + guard.own_position_error_m + 7.0
    assert below.localised(30.0) == pytest.approx(still + 0.02 * 130.0)
    assert below.at(0.0) == pytest.approx(still + 2.0 + BETWEEN_M)
    assert below.at(1.5) == pytest.approx(still + 0.02 * 101.5 + BETWEEN_M + guard.tracking_error_m / 2)
    assert below.at(90.0) == pytest.approx(still + 0.02 * 190.0 + BETWEEN_M + guard.tracking_error_m)


@pytest.mark.parametrize(("cruise_depth_m", "grows"), [(0.0, 0.0), (0.5, 0.02), (45.0, 0.02)])
def test_only_a_vehicle_that_dives_drifts(cruise_depth_m: float, grows: float) -> None:
    settings = config(vehicle={"cruise_depth_m": cruise_depth_m}, guard={"own_position_drift_mps": 0.02})
    margins = Margins.of(settings, 0.0)
    assert margins.localised(100.0) - margins.localised(0.0) == pytest.approx(100.0 * grows)


def test_a_ship_counts_to_its_draught_and_both_margins() -> None:
    below = config(guard={"vertical": "clear_below", "draught_margin_m": 3.0, "depth_error_m": 0.5})
    ship = replace(tracks({}), draught_m=np.full(1, 6.0))
    dive = Dive.of(below, ship, own(depth_m=9.0), (0.0,))
    assert dive.clear_m == pytest.approx(9.5)
    assert dive.counts(np.zeros(1)).all()
    assert not Dive.of(below, ship, own(depth_m=9.6), (0.0,)).counts(np.zeros(1)).any()


# ---------------------------------------------------------------- the cheap proofs


def test_the_way_to_stop_is_the_age_the_delay_a_period_the_lag_and_the_slip() -> None:
    settings = config(guard={"setpoint_delay_s": 0.5}, timing={"rate_hz": 4.0, "setpoint_validity_s": 1.0})
    state = replace(own(), velocity_ned_mps=(0.9, -1.2, 0.0))
    lag = settings.vehicle.speed_lag_s
    expected = 1.5 * 0.4 + 2.5 * (0.5 + 0.25 + lag) + 1.5 * lag + BETWEEN_M
    assert to_stop_m(instant(0.4), state, settings) == pytest.approx(expected)
    assert to_stop_m(T0, state, settings) == pytest.approx(expected - 0.6)
    fast = replace(own(), velocity_ned_mps=(4.0, 0.0, 0.0))
    assert to_stop_m(T0, fast, settings) == pytest.approx(4.0 * (0.75 + 2 * lag) + BETWEEN_M)


def test_a_berth_counts_the_way_from_its_own_place() -> None:
    berth = Berth(100.0, -50.0, 20.0, instant(10.0))
    for north_m, east_m in ((100.0, -45.0), (100.0, -55.0), (105.0, -50.0), (97.0, -46.0)):
        assert berth.holds(instant(10.0), own(north_m, east_m), 14.9)
        assert not berth.holds(instant(10.0), own(north_m, east_m), 15.0)
    assert not berth.may_be_better(instant(10.0), own(100.0, -50.0 + LEAST_M - 0.1), 1.0)


def test_while_a_berth_holds_no_other_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Instant] = []
    around = Berth.around

    def counted(*args: object) -> Berth:
        asked.append(args[2])  # type: ignore[arg-type]
        return around(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(Berth, "around", counted)
    guard, ship = Guard(SETTINGS), tracks({**STILL, "north_m": 2000.0})
    for k in range(400):
        t = k / 10
        guard.check(instant(t), own(at_s=t), heartbeat(t), ship, 1, (0.0, 0.0, 0.0))
    assert asked == [T0, instant(30.1)]


def path(begin_s: float, t: tuple[float, ...], north: tuple[float, ...], east: tuple[float, ...]) -> WayOut:
    return WayOut(
        instant(begin_s), np.array(t), np.array(north), np.array(east), (1.0, 0.0), t[-1], verified=True
    )


GRID = (0.0, 4.0, 8.0, 12.0)
NORTH = (0.0, 8.0, 16.0, 24.0)
FLAT = (7.0, 7.0, 7.0, 7.0)


@pytest.mark.parametrize(
    ("room", "other", "covered"),
    [
        # as far east as north: the difference counts, not the sum
        ((3.0, 3.0, 3.0, 3.0), path(0.0, GRID, NORTH, (8.0, 8.0, 8.0, 8.0)), True),
        # apart at the very beginning only, where there is little room
        ((1.0, 9.0, 9.0, 9.0), path(0.0, GRID, NORTH, (9.0, 7.0, 7.0, 7.0)), False),
        ((9.0, 9.0, 9.0, 1.0), path(0.0, GRID, NORTH, (9.0, 7.0, 7.0, 7.0)), True),
        # only what is still to come counts, each cell by its own ends
        ((1.0, 9.0, 9.0, 9.0), path(0.0, GRID, NORTH, (7.0, 7.0, 9.0, 9.0)), True),
        ((1.0, 9.0, 9.0, 9.0), path(4.0, (0.0, 4.0, 8.0), (8.0, 16.0, 24.0), (9.0,) * 3), True),
        # farther on than the first ever goes: what it has at its end for ever
        ((9.0, 9.0, 9.0, 5.0), path(0.0, (0.0, 12.0, 14.0), (0.0, 24.0, 28.0), (7.0,) * 3), True),
        ((9.0, 9.0, 9.0, 3.0), path(0.0, (0.0, 12.0, 14.0), (0.0, 24.0, 28.0), (7.0,) * 3), False),
        ((9.0, 9.0, 1.0, 9.0), path(0.0, (0.0, 12.0, 14.0), (0.0, 24.0, 28.0), (7.0,) * 3), True),
        ((9.0, 1.0, 9.0, 9.0), path(0.0, (0.0, 12.0, 14.0), (0.0, 24.0, 28.0), (7.0,) * 3), True),
        # begun where the first has ended
        ((9.0, 9.0, 9.0, 9.0), path(12.0, GRID, (24.0,) * 4, FLAT), False),
        ((9.0, 9.0, 9.0, 9.0), path(11.9, GRID, (24.0,) * 4, FLAT), True),
    ],
)
def test_beside_a_verified_path_there_is_the_room_of_each_time(
    room: tuple[float, ...], other: WayOut, covered: bool
) -> None:
    beside = Beside.of(path(0.0, GRID, NORTH, FLAT), np.array(room), instant(30.0))
    assert beside.covers(other) is covered


@pytest.mark.parametrize(("corner_m", "covered"), [(2.9, True), (3.0, False)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_corner_of_the_verified_path_counts_against_one_that_cuts_it(
    axis: int, corner_m: float, covered: bool
) -> None:
    bent = [list(NORTH), list(FLAT)]
    bent[axis][2] += corner_m
    verified = path(0.0, GRID, tuple(bent[0]), tuple(bent[1]))
    straight = path(0.0, (0.0, 12.0), (0.0, 24.0), (7.0, 7.0))
    assert Beside.of(verified, np.full(4, 3.0), instant(30.0)).covers(straight) is covered


# ---------------------------------------------------------------- room, where the answer is known


def clearance_of(ships: Tracks, lookahead_s: float = 20.0) -> Clearance:
    margins = Margins(5.0, 2.0, 0.0, 3.0, 0.0)
    return Clearance(Slices.of(ships), T0, margins, 2.5, lookahead_s, np.zeros(2))


RESTING = Paths(np.array((0.0, 4.0, 8.0)), np.full((1, 3), 900.0), np.full((1, 3), -700.0))


@pytest.mark.parametrize("axis", ["north_m", "east_m"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_room_beyond_the_margins_is_told_as_far_as_it_is_asked_for(axis: str, sign: float) -> None:
    ship = {**STILL, "bow_m": 10.0, "stern_m": 10.0, "port_m": 10.0, "starboard_m": 10.0}
    ship |= {"north_m": 900.0, "east_m": -700.0}
    ship[axis] += sign * (10.0 + 10.0 + 20.0)
    found = clearance_of(tracks(ship)).room(RESTING, 30.0)
    assert found[0, -1] == pytest.approx(30.0 - (5.0 + 2.0 + BETWEEN_M + 3.0), abs=1e-6)
    assert np.isinf(clearance_of(tracks(ship)).room(RESTING, 5.0)).all()


def test_a_ship_that_has_expired_is_met_as_far_as_it_can_have_come() -> None:
    """Its set grows at top speed on all sides, and is found by who asks at the edge of it."""
    gone = {**STILL, "validity_s": 600.0, "measured_at_s": -605.0, "north_m": 900.0 + 37.5 + 280.0}
    edge = tracks({**gone, "east_m": -700.0})
    grown = Slices.of(edge).grown_m(np.zeros(1, dtype=np.int64), np.array((613.0,)))[0]
    assert grown > 16.0 * 13.0
    here = clearance_of(edge)
    assert not here.unknown.any()
    room = here.room(RESTING, 400.0)
    expected = 280.0 - grown - (5.0 + 2.0 + BETWEEN_M + 3.0)
    assert room[0, -1] <= expected + 1e-6
    assert room[0, -1] == pytest.approx(expected, abs=16.0 * 2.0 + 2.5 * 2.0)


def test_just_astern_of_a_ship_that_leaves_there_is_no_room_to_stay_yet() -> None:
    leaves = tracks(
        {"cog_rad": 0.0, "speed_noise_mps": 0.0, "course_noise_rad": 0.0, "heading_error_rad": 0.0}
    )
    room = clearance_of(leaves).room_to_stay(np.zeros(1), np.array((-37.5 - 9.0,)), np.zeros(1))
    assert room[0] == pytest.approx(9.0 - 10.0, abs=1e-6)


def test_the_distance_to_a_segment_is_to_its_nearest_point() -> None:
    run = np.array(((3.0, 4.0), (3.0, 4.0), (3.0, 4.0), (0.0, 0.0), (10.0, 0.0)))
    x, y = np.array((6.0, -3.0, 3.5, 3.0, 5.0)), np.array((8.0, 0.0, 0.5, 4.0, -2.0))
    assert _to_segment(x, y, run) == pytest.approx((5.0, 3.0, 2.5, 5.0, 2.0))


@pytest.mark.parametrize(
    ("validity_s", "unchanged_s"), [(1500.0, 1380.0), (130.0, 10.0), (110.0, 0.0), (9000.0, 0.0)]
)
def test_what_is_verified_holds_until_a_ships_bounds_come_into_sight(
    validity_s: float, unchanged_s: float
) -> None:
    ships = tracks({"measured_at_s": -100.0, "validity_s": validity_s}, {"validity_s": 3000.0})
    assert clearance_of(ships).unchanged_s() == pytest.approx(unchanged_s)


def test_a_ship_counts_for_an_hour_and_the_lookahead_at_most() -> None:
    far = tracks(
        {"measured_at_s": -100.0, "validity_s": 9000.0}, {"measured_at_s": -100.0, "validity_s": 1500.0}
    )
    assert clearance_of(far).until_s == pytest.approx((100.0 + 3600.0 + 20.0, 1500.0))
    assert not clearance_of(far).unknown.any()  # however near they are


def test_beneath_a_ship_that_is_about_to_expire_the_water_is_known_only_if_it_is_far() -> None:
    below = config(guard={"vertical": "clear_below"})
    ending = {"measured_at_s": -595.0, "validity_s": 600.0, "sog_mps": 0.0}
    ships = tracks({**ending, "north_m": 9000.0}, ending, {"validity_s": 1500.0, "sog_mps": 0.0})
    margins = Margins(5.0, 2.0, 0.0, 3.0, 0.0)
    for depth_m, unknown in ((0.0, [False, True, False]), (45.0, [False, False, False])):
        dive = Dive.of(below, ships, own(depth_m=depth_m), (0.0,))
        found = Clearance(Slices.of(ships), T0, margins, 2.5, 20.0, np.zeros(2), dive)
        assert found.unknown.tolist() == unknown


# ---------------------------------------------------------------- the search


@pytest.fixture
def search() -> Search:
    return Search(VEHICLE, 2.3, 300.0)


NOWHERE = np.zeros(0)
AT_REST = Beginning(NOWHERE, NOWHERE, NOWHERE, 0.6, Motion(30.0, -20.0, 0.5, 0.0))


@pytest.mark.parametrize("end_m", [(130.0, -20.0), (30.0, 80.0), (-40.0, -90.0), (90.0, -100.0)])
def test_toward_a_place_it_comes_to_rest_there(search: Search, end_m: tuple[float, float]) -> None:
    """The turn takes it aside, so it is abreast of the place where it stops."""
    found = search.toward(T0, AT_REST, end_m, 2.3)
    line = np.array(end_m) - (30.0, -20.0)
    length = float(np.hypot(*line))
    gone = np.array(found.end_m) - (30.0, -20.0)
    assert gone @ line / length == pytest.approx(length, abs=0.3)
    assert abs(gone @ (-line[1], line[0])) / length < 16.0
    assert found.speed_mps == pytest.approx(2.3)
    assert found.verified


def test_toward_a_place_too_near_or_at_no_speed_it_just_stops(search: Search) -> None:
    near = (30.0 + 2.3 * VEHICLE.speed_lag_s - 0.01, -20.0)
    for end_m, speed in ((near, 2.3), ((500.0, 0.0), 0.0)):
        assert search.toward(T0, AT_REST, end_m, speed).speed_mps == 0.0


def test_there_is_a_run_in_every_direction_and_one_of_none(search: Search) -> None:
    """All of them clear: the one toward what is wanted is taken, and the first place to stop on it."""
    sea = clearance_of(tracks({"north_m": 9e4}))
    for wanted in ((1.0, 0.0), (0.0, -2.0), (-0.7, 0.7)):
        found, best = search.best(T0, AT_REST, wanted, sea)
        assert found is best
        assert math.atan2(*found.velocity_mps[::-1]) == pytest.approx(math.atan2(*wanted[::-1]))
        assert found.stop_s - found.run_s == pytest.approx(8.0, abs=0.5)
        assert found.run_s == pytest.approx(0.6)
    slow, _ = search.best(T0, AT_REST, (0.05, 0.05), sea)  # too slow to say whereto: along the hull
    assert slow is not None
    assert slow.velocity_mps == pytest.approx((2.3 * math.cos(0.5), 2.3 * math.sin(0.5)))


def test_a_run_after_waiting_waits_and_turns_first(search: Search) -> None:
    sea = clearance_of(tracks({"north_m": 9e4}))
    found, _ = search.best(T0, AT_REST, (-1.0, 0.0), sea, 30.0)
    assert found is not None
    turn_s = math.pi / VEHICLE.max_turn_rate_radps
    assert (found.run_s, found.turn_s) == pytest.approx((0.6 + 30.0 + turn_s, turn_s))
    along = np.interp(found.run_s + 20.0, found.t_s, found.north_m) - 30.0
    lag = VEHICLE.speed_lag_s
    assert found.east_m == pytest.approx(-20.0, abs=1e-6)  # it lies along the run when that begins
    stop = found.stop_s - found.run_s
    gone = 2.3 * (stop - lag * (1 - math.exp(-stop / lag)))
    assert along <= -gone + 1e-6


def least_bad(search: Search, room: FloatArray) -> int:
    """Which of the runs is taken."""
    direction = np.linspace(0.1, 3.0, len(room))
    first = replace(AT_REST, t_s=np.array((0.0,)), north_m=np.zeros(1), east_m=np.zeros(1))
    found = search._least_bad(T0, first, direction, np.full(len(room), 2.0), room)
    assert not found.verified
    assert found.stop_s == pytest.approx(0.6 + RUN_S[-1])  # it never stops on the way
    (taken,) = np.flatnonzero(np.isclose(direction, math.atan2(*found.velocity_mps[::-1])))
    return int(taken)


RUN_S = Runner(VEHICLE, 300.0).t_s


def test_the_least_bad_run_is_in_least_deep_for_least_long_and_rather_late_than_soon(search: Search) -> None:
    """A metre too near for a second counts e-fold less every minute; room elsewhere counts for nothing."""
    t = [0.0, *(0.6 + RUN_S)]
    lasts_s = [b - a for a, b in pairwise(t)] + [4.0]
    counts = [dt * math.exp(-at / 60.0) for dt, at in zip(lasts_s, t, strict=True)]
    rng = np.random.default_rng(3)
    for k in (0, 1, 5, len(t) // 2, len(t) - 2, len(t) - 1):
        room = rng.choice((0.0, 0.5, 300.0), (6, len(t)))
        other = rng.integers(0, len(t), 6)
        room[np.arange(6), other] = [-1.02 / counts[m] for m in other]
        room[4] = 0.0
        room[4, k] = -1.0 / counts[k]
        assert least_bad(search, room) == 4
        room[4, k] *= 1.04
        assert least_bad(search, room) != 4


def test_where_what_is_wanted_is_just_reached_it_is_reached() -> None:
    t = np.array((0.0, 1.0, 3.0, 4.0))
    assert _first_s(t, np.array((0.0, 2.0, 4.0, 9.0)), 4.0) == 3.0
    assert _first_s(t, np.array((0.0, 2.0, 3.0, 4.0)), 4.0) == 4.0
    assert _first_s(t, np.array((4.0, 2.0, 3.0, 4.0)), 4.0) == 0.0


def test_searches_in_vain_try_a_run_at_once_and_longer_and_longer_waits_in_turns() -> None:
    guard = Guard(SETTINGS)
    waits = []
    for guard._waits in range(10):
        waits.append(guard._wait_s())
    assert waits == [0.0, 15.0, 0.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0, 15.0]
