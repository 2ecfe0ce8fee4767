import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.instant import instant
from companion.messages import OwnState
from companion.planning.guard import Guard
from companion.planning.guard.jumps import SETTLED_S, Jumps
from companion.planning.guard.margins import Margins
from companion.planning.guard.watch import Watch
from tests.builders import config, heartbeat, own, tracks

SPEED = 2.0


def at(at_s: float, off_m: float = 0.0, east_m: float = 0.0, depth_m: float = 45.0) -> OwnState:
    """Northward at 2 m/s, `off_m` ahead of where that leads."""
    state = own(SPEED * at_s + off_m, east_m, at_s=at_s, depth_m=depth_m)
    return replace(state, velocity_ned_mps=(SPEED, 0.0, 0.0))


def seen(jumps: Jumps, *states: OwnState) -> float:
    for state in states:
        jumps.look(state.stamp, state, 0.0)
    return jumps.unexplained_m


def test_what_motion_and_accuracy_explain_enlarges_nothing() -> None:
    assert seen(Jumps(config()), at(0.0), at(1.0, 4.1), at(2.0, 4.1)) == 0.0


def test_a_jump_enlarges_the_error_by_all_of_it_and_stays() -> None:
    jumps = Jumps(config())
    assert seen(jumps, at(0.0), at(1.0, 60.0)) == pytest.approx(60.0)
    assert seen(jumps, *(at(float(t), 60.0) for t in range(2, 200))) == pytest.approx(60.0)
    assert seen(jumps, at(200.0, 60.0, 80.0)) == pytest.approx(100.0)


def test_a_vehicle_that_stopped_while_the_link_was_down_has_not_jumped() -> None:
    """An autopilot without setpoints stops; when it is heard again it is short of where it was going."""
    assert seen(Jumps(config()), at(0.0), at(24.0, -SPEED * 24.0)) == 0.0
    assert seen(Jumps(config()), at(0.0), at(24.0, 60.0)) > 0.0  # farther than it can have gone


ERROR_M = 2 * config().guard.own_position_error_m  # of two positions


@pytest.mark.parametrize("course", [0.0, 1.1, 2.0, -0.6, -2.5])
@pytest.mark.parametrize(("dt", "gap"), [(0.25, False), (1.5, False), (24.0, True)])
@pytest.mark.parametrize("aside", [0.0, 1.3, 3.0])
def test_what_motion_explains_is_the_mean_velocity_times_the_time_in_any_direction(
    course: float, dt: float, gap: bool, aside: float
) -> None:
    def state(t: float, north: float, east: float, speed: float) -> OwnState:
        velocity = (speed * math.cos(course), speed * math.sin(course), 0.4)
        return replace(own(north, east, at_s=t), velocity_ned_mps=velocity)

    first = state(10.0, 500.0, -700.0, 1.0)
    run = 1.5 * dt
    north, east = 500.0 + run * math.cos(course), -700.0 + run * math.sin(course)
    allowed = ERROR_M + 0.2 * dt
    if gap:  # then from where it was, as far as it can have gone
        north, east = 500.0, -700.0
        allowed += (2.5 + config().guard.current_mps) * dt
    for off, unexplained in ((allowed - 0.01, False), (allowed + 0.01, True)):
        jumps = Jumps(config())
        second = state(
            10.0 + dt, north + off * math.cos(course + aside), east + off * math.sin(course + aside), 2.0
        )
        assert (seen(jumps, first, second) > 0) is unexplained


def test_what_is_allowed_grows_with_the_time_under_water() -> None:
    drifting = config(guard={"own_position_drift_mps": 0.1})
    for off, jumped in ((ERROR_M + 10.0, False), (ERROR_M + 10.5, True)):
        jumps = Jumps(drifting)
        jumps.look(instant(0.0), at(0.0), 99.0)
        assert (jumps.look(instant(1.0), at(1.0, off), 100.0) > 0) is jumped


def test_after_settling_the_next_jump_counts_by_itself() -> None:
    jumps = Jumps(config())
    surfaced = config().vehicle.surfaced_depth_m
    seen(jumps, *(at(float(t), 60.0 * (t > 0), depth_m=surfaced) for t in range(40)))
    assert jumps.unexplained_m == 0.0
    assert seen(jumps, at(40.0, 60.0, 70.0, depth_m=surfaced)) == pytest.approx(70.0)
    assert seen(jumps, at(41.0, 100.0, 70.0, depth_m=surfaced)) == pytest.approx(math.hypot(70.0, 40.0))


def test_a_position_that_jumps_back_has_explained_itself() -> None:
    jumps = Jumps(config())
    assert seen(jumps, at(0.0), at(1.0, 500.0)) == pytest.approx(500.0)
    assert seen(jumps, at(2.0, 1.0)) == 0.0


@given(st.lists(st.floats(-300.0, 300.0), min_size=1, max_size=8))
def test_whatever_the_jumps_where_motion_alone_leads_is_within_the_error(offs: list[float]) -> None:
    jumps = Jumps(config())
    for k, off in enumerate((0.0, *offs)):
        seen(jumps, at(float(k), off))
        assert jumps.unexplained_m >= abs(off) - 4.2 * (k + 1)


def test_a_jump_is_believed_after_a_while_at_the_surface_without_another() -> None:
    jumps = Jumps(config())
    seen(jumps, at(0.0), at(1.0, 60.0, depth_m=0.5))
    assert seen(jumps, *(at(2.0 + t, 60.0, depth_m=0.5) for t in range(int(SETTLED_S)))) > 0
    assert seen(jumps, at(2.0 + SETTLED_S, 60.0, depth_m=0.5)) == 0.0
    jumps = Jumps(config())
    seen(jumps, at(0.0), at(1.0, 60.0, depth_m=0.5), at(20.0, 60.0, depth_m=0.5), at(25.0, 60.0))
    assert seen(jumps, at(26.0, 60.0, depth_m=0.5), at(40.0, 60.0, depth_m=0.5)) > 0  # dived meanwhile


def test_the_watch_says_so_for_as_long_as_it_lasts_and_the_margins_have_it() -> None:
    watch = Watch(config())
    for t in range(100):
        reasons = watch.look(instant(float(t)), at(float(t), 60.0 if t > 2 else 0.0), None, (SPEED, 0.0))
        assert ({r.code for r in reasons} == {"guard.position_accuracy"}) is (t > 2)
        assert watch.has_jumped is (t == 3)
    declared, wider = Margins.of(config(), 0.0), Margins.of(config(), 0.0, watch.unexplained_m)
    assert wider.localised(10.0) - declared.localised(10.0) == pytest.approx(60.0)


@pytest.mark.parametrize(("jump_m", "way_out"), [(0.0, True), (140.0, False), (-300.0, True)])
def test_after_a_jump_a_way_out_has_to_hold_against_the_wider_error(jump_m: float, way_out: bool) -> None:
    guard = Guard(config())
    ship = tracks({"north_m": 185.0, "sog_mps": 0.0, "speed_noise_mps": 0.0})
    for step in range(30):
        t = 0.1 * step
        state = own(jump_m if step >= 20 else 0.0, at_s=t)
        verdict = guard.check(instant(t), state, heartbeat(t), ship, 1, (0.0, 0.0, 0.0))
        assert verdict.velocity_ned_mps is not None
    # 8 m from the ship by the new position, 148 m by the old one, and both known within 140 m
    assert verdict.way_out is way_out
    assert ("guard.position_accuracy" in {r.code for r in verdict.reasons}) is (jump_m != 0)
