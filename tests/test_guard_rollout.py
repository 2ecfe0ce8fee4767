import math

import numpy as np
import pytest

from companion.config import Vehicle
from companion.instant import after
from companion.messages import OwnState
from companion.planning.guard.beginning import Beginning
from companion.planning.guard.rollout import Motion, Runner, held, motion_of
from companion.planning.guard.search import Search, _first_s
from sitl.vehicle import Demand, KinematicSubmarine, Limits
from tests.builders import T0

VEHICLE = Vehicle()


@pytest.fixture
def runner() -> Runner:
    return Runner(VEHICLE, 300.0)


@pytest.mark.parametrize("direction", [0.0, 0.7, -2.0, 3.1, math.pi])
@pytest.mark.parametrize("speed", [2.3, 1.2, 0.0])
def test_a_run_is_what_small_steps_of_the_same_model_give(
    runner: Runner, direction: float, speed: float
) -> None:
    start = Motion(10.0, -5.0, 0.3, 2.0, 0.2, -0.1)
    north, east, made = runner.paths(start, np.array((direction,)), np.array((speed,)))
    command = (speed * math.cos(direction), speed * math.sin(direction))
    for k in (1, 3, 10, 25, len(runner.t_s) - 1):
        last = held(start, command, float(runner.t_s[k]), VEHICLE)[-1]
        assert (north[0, k], east[0, k]) == pytest.approx((last.north_m, last.east_m), abs=0.5)
        assert made[0, k] == pytest.approx(last.forward_mps, abs=0.15)
    heading = runner.heading_rad(start, direction, speed, 5.0)
    expected = held(start, command, 5.0, VEHICLE)[-1].heading_rad
    assert heading == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("direction", [0.5, 2.5])
def test_the_bundled_vehicle_goes_where_the_rollout_says(runner: Runner, direction: float) -> None:
    hull = KinematicSubmarine(Limits())
    state = hull.start(0.0, 0.0, 45.0, 0.0)
    north, east, _ = runner.paths(Motion(0.0, 0.0, 0.0, 0.0), np.array((direction,)), np.array((2.0,)))
    demand = Demand((2.0 * math.cos(direction), 2.0 * math.sin(direction), 0.0))
    t, worst = 0.0, 0.0
    for k in range(1, 40):
        while t < runner.t_s[k] - 1e-9:
            state, t = hull.step(state, demand, 0.1), t + 0.1
        worst = max(worst, math.hypot(state.north_m - north[0, k], state.east_m - east[0, k]))
    assert worst < 1.0  # its turn lag, which guard.tracking_error_m has to cover


def own_state(velocity: tuple[float, float], heading: float | None) -> OwnState:
    return OwnState(T0, 1.0, 2.0, 0.0, (*velocity, 0.0), heading)


def test_the_motion_now_is_the_state_moved_on_by_its_age() -> None:
    motion = motion_of(own_state((1.0, 0.5), 0.0), 2.0, 0.0)
    assert (motion.north_m, motion.east_m) == (3.0, 3.0)
    assert (motion.forward_mps, motion.aside_north_mps, motion.aside_east_mps) == (1.0, 0.0, 0.5)


def test_without_heading_a_moving_vehicle_lies_along_its_motion_and_a_resting_one_the_worst_way() -> None:
    assert motion_of(own_state((0.0, 1.0), None), 0.0, 0.0).heading_rad == pytest.approx(math.pi / 2)
    assert motion_of(own_state((0.0, 0.0), None), 0.0, 1.0).heading_rad == pytest.approx(1.0 + math.pi)
    assert motion_of(own_state((0.0, 0.0), math.nan), 0.0, 1.0).heading_rad == pytest.approx(1.0 + math.pi)


def test_a_vehicle_that_drifts_astern_counts_as_drifting_not_as_running() -> None:
    motion = motion_of(own_state((-1.0, 0.0), 0.0), 0.0, 0.0)
    assert (motion.forward_mps, motion.aside_north_mps) == (0.0, -1.0)


def test_a_command_too_small_to_turn_to_keeps_the_heading() -> None:
    motion = held(Motion(0.0, 0.0, 1.0, 0.0), (0.0, -0.01), 3.0, VEHICLE)[-1]
    assert motion.heading_rad == 1.0


def test_the_shortest_way_out_still_has_the_time_to_turn_round() -> None:
    short = Runner(VEHICLE, 10.0)
    assert short.t_s[-1] >= math.pi / VEHICLE.max_turn_rate_radps
    assert (np.diff(short.t_s) > 0).all()


def test_a_value_is_first_reached_between_the_times_at_the_first_or_never() -> None:
    t = np.array((0.0, 1.0, 3.0))
    assert _first_s(t, np.array((0.0, 2.0, 4.0)), 3.0) == pytest.approx(2.0)
    assert _first_s(t, np.array((5.0, 2.0, 4.0)), 3.0) == 0.0
    assert _first_s(t, np.array((0.0, 2.0, 2.5)), 3.0) == 3.0


def test_waiting_comes_to_rest_where_the_lag_carries_and_then_stays() -> None:
    empty = np.zeros(0)
    first = Beginning(empty, empty, empty, 0.6, Motion(10.0, 5.0, 0.0, 2.0, 0.0, 0.5))
    waited = first.waiting(30.0, 2.0)
    assert first.waiting(0.0, 2.0) is first
    assert waited.end_s == pytest.approx(30.6)
    assert (waited.end.north_m, waited.end.east_m) == pytest.approx((14.0, 6.0), abs=1e-5)
    assert waited.end.forward_mps == pytest.approx(0.0, abs=1e-5)
    assert waited.t_s[0] == pytest.approx(0.6)
    assert np.all(np.diff(waited.t_s) > 0)
    assert np.interp(2.6, waited.t_s, waited.north_m) == pytest.approx(10 + 4 * (1 - math.exp(-1)), abs=0.05)


@pytest.mark.parametrize("heading", [0.0, 1.0, 2.0, 3.1, -1.5])
def test_a_way_out_that_waited_is_kept_however_the_hull_came_to_lie_meanwhile(heading: float) -> None:
    """Holding a place turns the hull any way; found by one of ten thousand hostile trials."""
    search = Search(VEHICLE, 2.3, 300.0)
    rest = Beginning(np.zeros(1), np.zeros(1), np.zeros(1), 0.5, Motion(0.0, 0.0, 0.0, 0.0))
    planned = search.toward(T0, rest, (0.0, -100.0), 2.3, 40.0)
    begins = planned.run_s - planned.turn_s
    assert 0.0 < begins < planned.run_s
    hull = Motion(0.0, 0.0, heading, 0.0)
    t, worst = begins, 0.0
    while t < planned.t_s[-1]:
        now = after(T0, t)
        own = OwnState(now, hull.north_m, hull.east_m, 45.0, (0.0, 0.0, 0.0), hull.heading_rad)
        worst = max(worst, planned.deviation_m(own))
        hull, t = held(hull, planned.command(now, own, 0.0, 2.5), 0.5, VEHICLE)[-1], t + 0.5
    assert worst < 2.0


# ---------------------------------------------------------------- the model, step by step


def stepped(start: Motion, direction: float, speed: float, dt: float, steps: int) -> list[Motion]:
    """The model as its page says it, in steps of `dt`."""
    rate, lag, out, m = VEHICLE.max_turn_rate_radps, VEHICLE.speed_lag_s, [start], start
    left = math.exp(-dt / lag)
    for _ in range(steps):
        error = math.remainder(direction - m.heading_rad, math.tau) if speed > 0.05 else 0.0
        turn = math.copysign(min(abs(error), rate * dt), error)
        target = speed * max(math.cos(error - turn), 0.0)
        run = target * dt + (m.forward_mps - target) * lag * (1 - left)
        along, slip = m.heading_rad + turn / 2, lag * (1 - left)
        m = Motion(
            m.north_m + run * math.cos(along) + m.aside_north_mps * slip,
            m.east_m + run * math.sin(along) + m.aside_east_mps * slip,
            m.heading_rad + turn,
            target + (m.forward_mps - target) * left,
            m.aside_north_mps * left,
            m.aside_east_mps * left,
        )
        out.append(m)
    return out


def test_the_grid_is_fine_while_it_turns_and_coarser_later() -> None:
    turns_s = math.ceil(math.pi / VEHICLE.max_turn_rate_radps / 0.5) * 0.5
    fine = [0.5 * k for k in range(int(2 * turns_s) + 1)]
    fine = [t for k, t in enumerate(fine) if t <= 3.0 or k % 2 == 0 or t == turns_s]
    for length_s in (300.0, 130.0, 90.0, 30.0):
        t = list(fine)
        while t[-1] + 2.0 <= min(length_s, 120.0):
            t.append(t[-1] + 2.0)
        while t[-1] + 4.0 <= length_s:
            t.append(t[-1] + 4.0)
        assert Runner(VEHICLE, length_s).t_s == pytest.approx(t)


@pytest.mark.parametrize("direction", [0.3, 0.9, -0.2, 3.0, -2.9, 6.0])
@pytest.mark.parametrize("speed", [2.3, 1.2, 0.0])
@pytest.mark.parametrize("turned", [False, True])
def test_a_run_is_the_model_stepped_exactly(
    runner: Runner, direction: float, speed: float, turned: bool
) -> None:
    start = Motion(10.0, -5.0, -3.0, 2.0, 0.2, -0.1)
    north, east, made = runner.paths(start, np.array((direction,)), np.array((speed,)), turned=turned)
    begun = start
    if turned and speed > 0:
        begun = Motion(10.0, -5.0, direction, 2.0, 0.2, -0.1)
    exact = stepped(begun, direction, speed, 0.5, 600)
    for k, t in enumerate(runner.t_s):
        m = exact[round(t / 0.5)]
        assert (north[0, k], east[0, k], made[0, k]) == pytest.approx((m.north_m, m.east_m, m.forward_mps))
        heading = runner.heading_rad(start, direction, speed, float(t), turned=turned)
        assert math.cos(heading - m.heading_rad) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("duration_s", "steps"), [(0.1, 1), (0.25, 1), (0.26, 2), (0.5, 2), (0.6, 3), (2.0, 8), (0.75, 3)]
)
def test_holding_a_command_is_the_model_stepped_exactly(duration_s: float, steps: int) -> None:
    start = Motion(1.0, 2.0, 2.9, 1.5, -0.3, 0.4)
    found = held(start, (-1.2, -0.9), duration_s, VEHICLE)
    exact = stepped(start, math.atan2(-0.9, -1.2), 1.5, duration_s / steps, steps)[1:]
    assert len(found) == steps
    for m, e in zip(found, exact, strict=True):
        assert vars_of(m) == pytest.approx(vars_of(e))


def vars_of(m: Motion) -> tuple[float, ...]:
    return m.north_m, m.east_m, m.heading_rad, m.forward_mps, m.aside_north_mps, m.aside_east_mps


@pytest.mark.parametrize("heading", [0.4, 2.0, -1.2])
@pytest.mark.parametrize("forward", [1.5, 0.0])
def test_a_velocity_is_split_along_the_hull_and_aside(heading: float, forward: float) -> None:
    aside = 0.4
    ahead = np.array((math.cos(heading), math.sin(heading)))
    across = np.array((-ahead[1], ahead[0]))
    north, east = forward * ahead + aside * across
    motion = motion_of(own_state((float(north), float(east)), heading), 0.0, 0.0)
    assert motion.forward_mps == pytest.approx(forward, abs=1e-12)
    assert (motion.aside_north_mps, motion.aside_east_mps) == pytest.approx(tuple(aside * across))


@pytest.mark.parametrize(
    ("velocity", "heading"), [((0.31, 0.0), 0.0), ((0.0, -0.31), -1.5708), ((0.2, 0.2), 2.0)]
)
def test_a_drift_is_no_heading(velocity: tuple[float, float], heading: float) -> None:
    assert motion_of(own_state(velocity, None), 0.0, 2.0 - math.pi).heading_rad == pytest.approx(
        heading, abs=1e-4
    )
