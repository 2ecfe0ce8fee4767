import math
from dataclasses import replace

import numpy as np
import pytest

from companion.instant import instant
from companion.messages import OwnState
from companion.planning.guard.rollout import Motion, held
from companion.planning.guard.watch import MEMORY_S, Watch
from companion.planning.guard.way_out import WayOut
from tests.builders import T0, config, own


def way_out(north_m: float = 0.0) -> WayOut:
    return WayOut(T0, np.array((0.0, 10.0)), np.full(2, north_m), np.zeros(2), (0.0, 0.0), 5.0, verified=True)


def looked(watch: Watch, state: OwnState, flown: WayOut | None = None, sent: float = 0.0) -> set[str]:
    return {reason.code for reason in watch.look(state.stamp, state, flown, (sent, 0.0))}


def moving(north_m: float, at_s: float, speed: float = 0.0, depth_m: float = 45.0) -> OwnState:
    return replace(own(north_m, at_s=at_s, depth_m=depth_m), velocity_ned_mps=(speed, 0.0, 0.0))


def test_a_vehicle_on_its_way_out_within_the_declared_error_is_not_worth_a_word() -> None:
    allowed = config().guard.tracking_error_m
    assert looked(Watch(config()), own(), way_out(allowed - 0.1)) == set()
    assert looked(Watch(config()), own(), way_out(allowed + 0.1)) == {"guard.tracking"}


def test_what_was_broken_stays_a_reason_for_a_while() -> None:
    watch = Watch(config())
    assert looked(watch, own(), way_out(50.0)) == {"guard.tracking"}
    assert looked(watch, own(at_s=MEMORY_S)) == {"guard.tracking"}
    assert looked(watch, own(at_s=MEMORY_S + 1)) == set()


def test_a_position_that_jumps_beyond_its_declared_accuracy_is_noticed() -> None:
    for jump, codes in ((3.9, set()), (4.3, {"guard.position_accuracy"})):
        watch = Watch(config())
        looked(watch, moving(0.0, 0.0, 2.0))
        assert looked(watch, moving(2.0 + jump, 1.0, 2.0)) == codes


def test_the_longer_under_water_the_more_the_first_fix_may_jump() -> None:
    drifting = config(guard={"own_position_drift_mps": 0.1})
    for depth_m, codes in ((45.0, set()), (0.0, {"guard.position_accuracy"})):
        watch = Watch(drifting)
        for second in range(60):
            looked(watch, moving(0.0, float(second), depth_m=depth_m))
        assert looked(watch, moving(9.0, 60.0, depth_m=0.0)) == codes


def test_the_same_state_twice_is_no_jump() -> None:
    watch = Watch(config())
    looked(watch, own())
    assert watch.look(instant(1.0), own(), None, (0.0, 0.0)) == []


@pytest.mark.parametrize(("made", "codes"), [(2.21, set()), (2.19, {"guard.current"})])
def test_a_vehicle_that_makes_good_less_than_declared_has_more_current_than_declared(
    made: float, codes: set[str]
) -> None:
    watch = Watch(config())
    found: set[str] = set()
    for second in range(90):
        found = looked(watch, moving(made * second, float(second), made), sent=2.5)
    assert found == codes


@pytest.mark.parametrize(("current_mps", "codes"), [(0.2, set()), (0.5, {"guard.current"})])
def test_a_vehicle_that_weaves_for_ever_is_held_against_what_it_can_do(
    current_mps: float, codes: set[str]
) -> None:
    watch, found = Watch(config()), set[str]()
    at = Motion(0.0, 0.0, 0.0, 0.0)
    sent = (0.0, 0.0)
    for step in range(400):
        made = at.velocity_mps[0] - current_mps * (math.hypot(*at.velocity_mps) > 1.0), at.velocity_mps[1]
        state = replace(own(at_s=0.25 * step), velocity_ned_mps=(*made, 0.0))
        found |= {r.code for r in watch.look(state.stamp, state, None, sent) if r.code == "guard.current"}
        sent = 2.5 * math.cos(0.6 * math.sin(0.15 * step)), 2.5 * math.sin(0.6 * math.sin(0.15 * step))
        at = held(at, sent, 0.25, config().vehicle)[-1]
    assert found == codes


def test_what_drifts_across_is_no_speed_missing() -> None:
    watch = Watch(config())
    for second in range(90):
        state = replace(own(at_s=float(second)), velocity_ned_mps=(2.5, 0.6, 0.0))
        assert "guard.current" not in {r.code for r in watch.look(state.stamp, state, None, (2.5, 0.0))}


def test_turning_round_takes_its_time_and_is_no_current() -> None:
    watch = Watch(config())
    for second in range(20):
        assert looked(watch, moving(0.0, float(second), 0.0), sent=2.5) == set()


def test_a_way_out_leads_back_to_its_path_and_stops_in_time() -> None:
    t = np.array((0.0, 10.0))
    way = WayOut(T0, t, np.array((0.0, 20.0)), np.zeros(2), (2.0, 0.0), 8.0, verified=True)
    assert way.command(T0, own(), 0.5, 2.5) == pytest.approx((2.0, 0.0))
    assert way.command(T0, own(east_m=1.0), 0.5, 2.5) == pytest.approx((2.0, -0.25))
    late = instant(7.6)
    assert way.command(late, own(15.2, at_s=7.6), 0.5, 2.5) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert math.hypot(*way.command(T0, own(east_m=90.0), 0.5, 2.5)) == pytest.approx(2.5)
    assert way.end_m == (20.0, 0.0)
    assert way.speed_mps == 2.0
    assert way.deviation_m(own(10.0, 1.0, at_s=5.0)) == pytest.approx(1.0)
    beside = WayOut(T0, t, np.zeros(2), np.full(2, 7.0), (0.0, 0.0), 8.0, verified=True)
    assert beside.deviation_m(own(0.0, 7.5)) == pytest.approx(0.5)
    gone, north, _ = way.rest(instant(25.0))
    assert (gone.tolist(), north.tolist()) == ([0.0], [20.0])


def test_a_velocity_that_is_noisy_about_the_one_sent_is_no_current() -> None:
    watch, allowed = Watch(config()), config().guard.current_mps
    for second in range(120):
        off = (allowed + 0.5) * (-1) ** second
        assert looked(watch, moving(2.0 * second, float(second), 2.0 + off), sent=2.0) <= {
            "guard.position_accuracy"
        }


def test_what_is_missing_along_the_velocity_sent_is_smoothed_over_five_seconds() -> None:
    watch = Watch(config())
    looked(watch, moving(0.0, 0.0, 2.0), sent=2.0)
    for second in range(1, 6):
        looked(watch, moving(0.0, float(second), 1.0), sent=2.0)
    assert watch._missing == pytest.approx(1 - math.exp(-1))
    looked(watch, moving(0.0, 5.0, -3.0), sent=2.0)  # no time has passed
    assert watch._missing == pytest.approx(1 - math.exp(-1))


def test_it_has_been_under_water_since_it_was_last_seen_at_the_surface() -> None:
    watch, surfaced = Watch(config()), config().vehicle.surfaced_depth_m
    assert watch.submerged_s(instant(50.0)) == 0.0
    looked(watch, moving(0.0, 100.0))
    assert watch.submerged_s(instant(130.0)) == 30.0
    looked(watch, moving(0.0, 130.0, depth_m=surfaced))
    looked(watch, moving(0.0, 131.0, depth_m=surfaced + 0.01))
    assert watch.submerged_s(instant(140.0)) == 10.0
    assert watch.submerged_s(instant(120.0)) == 0.0
