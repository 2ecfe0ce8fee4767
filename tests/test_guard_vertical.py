import math
from dataclasses import replace

import numpy as np
import pytest

from companion import reach
from companion.instant import instant
from companion.messages import Tracks
from companion.planning.guard import Guard, Velocity, Verdict
from companion.planning.guard.vertical import Dive, draught_m
from sitl.studies.bad_vehicle import BadVehicle
from sitl.studies.hostile import hostile
from sitl.studies.lanes_picture import TRAFFICS, Lanes
from tests.builders import T0, config, heartbeat, own, tracks

BELOW = config(guard={"vertical": "clear_below"})
OVERHEAD = tracks({"east_m": 20.0, "validity_s": 1500.0})


def judged(ships: Tracks, depth_m: float, wanted: Velocity, settings: object = BELOW) -> Verdict:
    return Guard(settings).check(T0, own(depth_m=depth_m), heartbeat(), ships, 1, wanted)  # type: ignore[arg-type]


def test_beneath_a_keel_by_draught_margin_and_depth_error_a_ship_does_not_count() -> None:
    verdict = judged(OVERHEAD, 45.0, (0.0, 2.5, 0.0))
    assert verdict.way_out
    assert not verdict.changed


def test_under_the_papers_reading_depth_counts_for_nothing() -> None:
    verdict = judged(OVERHEAD, 45.0, (0.0, 2.5, 0.0), config())
    assert not verdict.way_out


def test_it_does_not_surface_into_a_set() -> None:
    guard = Guard(BELOW)
    depth, down = 45.0, 0.0
    for step in range(900):
        state = replace(own(depth_m=depth, at_s=step * 0.1), velocity_ned_mps=(0.0, 0.0, down))
        still = tracks({"sog_mps": 0.0, "speed_noise_mps": 0.0, "validity_s": 1500.0})
        verdict = guard.check(state.stamp, state, heartbeat(step * 0.1), still, 1, (0.0, 0.0, -0.5))
        assert verdict.velocity_ned_mps is not None
        assert verdict.way_out
        down = verdict.velocity_ned_mps[2]
        depth += down * 0.1
    keel = 0.09 * 75 + BELOW.guard.draught_margin_m + BELOW.guard.depth_error_m
    assert keel < depth < keel + 5.0


def test_where_no_ship_can_come_it_surfaces() -> None:
    verdict = judged(tracks({"east_m": 5000.0, "validity_s": 1500.0}), 45.0, (0.0, 0.0, -0.5))
    assert verdict.velocity_ned_mps == (0.0, 0.0, -0.5)


def test_a_known_draught_stands_and_an_unknown_one_follows_from_the_length() -> None:
    ships = replace(tracks({}, {}), draught_m=np.array((12.0, np.nan)))
    assert draught_m(ships, 0.09) == pytest.approx((12.0, 6.75))


def test_the_least_depth_counts_the_rise_that_still_acts_and_then_the_dive() -> None:
    dive = Dive.of(BELOW, OVERHEAD, own(depth_m=20.0), (-0.5, 0.0))
    begin = BELOW.guard.setpoint_delay_s + 0.1
    depth = dive.depth_m(np.array((0.0, 5.0, 25.0, 500.0)))
    assert depth[0] == pytest.approx(20.0 - 0.5 * (begin + 2.0))
    assert depth[1] == pytest.approx(depth[0] + 0.5 * (5.0 - begin - 2.0))
    assert depth[3] == 45.0
    assert (np.diff(depth) >= 0).all()


def test_a_vehicle_deeper_than_its_cruise_depth_stays_there() -> None:
    dive = Dive.of(BELOW, OVERHEAD, own(depth_m=55.0), (0.0,))
    assert dive.depth_m(np.array((0.0, 300.0))) == pytest.approx((55.0, 55.0))


def test_a_silent_ship_overhead_closes_no_water_below_it() -> None:
    silent = tracks({"measured_at_s": -900.0, "north_m": 300.0})
    verdict = judged(silent, 45.0, (2.5, 0.0, 0.0))
    assert "guard.unknown_water" not in {reason.code for reason in verdict.reasons}
    assert verdict.velocity_ned_mps == (2.5, 0.0, 0.0)


def test_on_a_way_out_it_dives() -> None:
    bow = tracks({"north_m": -60.0, "east_m": 4.0, "validity_s": 1500.0})
    verdict = judged(bow, 2.0, (0.0, 0.0, 0.0))
    assert verdict.velocity_ned_mps is not None
    assert verdict.velocity_ned_mps[2] == 0.5


def test_a_vehicle_that_sinks_gains_nothing_on_the_way_to_its_least_depth() -> None:
    dive = Dive.of(BELOW, OVERHEAD, replace(own(depth_m=20.0), velocity_ned_mps=(0.0, 0.0, 0.4)), (0.3,))
    assert dive.up_mps == 0.0
    assert dive.depth_m(np.zeros(1))[0] == 20.0


@pytest.mark.parametrize(("depth_m", "down_mps"), [(20.0, 0.5), (44.5, 0.25), (45.0, 0.0), (60.0, -0.5)])
def test_on_a_way_out_it_closes_on_the_cruise_depth(depth_m: float, down_mps: float) -> None:
    assert Dive.of(BELOW, OVERHEAD, own(), (0.0,)).command_mps(depth_m) == pytest.approx(down_mps)


@pytest.mark.parametrize("seed", range(4))
def test_no_planner_that_wants_up_brings_it_into_a_ship_s_water(seed: int) -> None:
    """Toward the nearest ship, or anywhere, and up; current, delay, position and depth as bad as declared.

    A ship's water is what lies within delta of its reachable set, down to its draught and the margin.
    """
    settings = config(
        guard={"vertical": "clear_below", "tracking_error_m": 3.0},
        timing={"rate_hz": 1.0, "setpoint_validity_s": 3.0},
    )
    rng = np.random.default_rng(seed)
    lanes = Lanes(TRAFFICS[seed % 2], rng)
    vehicle, guard = BadVehicle(settings, rng, lanes.start_m(rng)), Guard(settings)
    plan = hostile(("adversarial", "random")[seed // 2], rng, settings.vehicle.max_speed_mps)
    beneath, least_m = 0, math.inf
    for step in range(400):
        now, ships = instant(float(step)), lanes.tracks(float(step))
        keel_m = draught_m(ships, settings.guard.draught_per_length) + settings.guard.draught_margin_m
        true = vehicle.measured(now)
        believed = replace(true, depth_m=true.depth_m + settings.guard.depth_error_m)
        wanted = plan(float(step), believed, ships, now)
        assert wanted is not None
        verdict = guard.check(now, believed, heartbeat(float(step)), ships, 1, (wanted[0], wanted[1], -0.5))
        assert verdict.velocity_ned_mps is not None
        vehicle.send(float(step), verdict.velocity_ned_mps)
        for tenth in range(10):
            at = instant(step + 0.1 * tenth)
            near = reach.at(ships, at).nearest(vehicle.true_m).distance_m < settings.field.delta_m
            depth_m = vehicle.measured(at).depth_m
            assert not (near & (keel_m > depth_m)).any()
            beneath += bool(near.any())
            vehicle.move(step + 0.1 * tenth)
        least_m = min(least_m, true.depth_m)
    assert beneath or seed // 2  # the adversary does get beneath ships
    assert least_m < 40.0  # and is let up between them
