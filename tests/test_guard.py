import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion import reach
from companion.config import Config
from companion.instant import Instant, instant
from companion.messages import OwnState, Tracks
from companion.planning.creep import CREEP_MPS
from companion.planning.guard import Guard, Velocity, Verdict
from companion.planning.guard.search import Search
from companion.planning.guard.way_out import WayOut
from sitl.vehicle import Demand, KinematicSubmarine, Limits
from tests.builders import T0, config, heartbeat, own, tracks

AHEAD = (2.5, 0.0, 0.0)
DELTA_M = config().field.delta_m
PAPER = {"speed_noise_mps": 0.05, "course_noise_rad": 0.01, "validity_s": 1500.0}


def codes(verdict: Verdict) -> set[str]:
    return {reason.code for reason in verdict.reasons}


def check(guard: Guard, ships: Tracks, wanted: Velocity | None, **changes: object) -> Verdict:
    inputs: dict[str, object] = {
        "now": T0,
        "own": own(),
        "heartbeat": heartbeat(),
        "tracks": ships,
        "reports_heard": 1,
        "wanted_ned_mps": wanted,
    }
    return guard.check(**{**inputs, **changes})  # type: ignore[arg-type]


class Flight:
    """The bundled vehicle under the guard, ten steps a second."""

    def __init__(self, settings: Config | None = None, north_m: float = 0.0, east_m: float = 0.0) -> None:
        self.guard = Guard(settings or config())
        self._hull = KinematicSubmarine(Limits())
        self.state = self._hull.start(north_m, east_m, 45.0, 0.0)
        self.t = 0.0
        self.closest_m = math.inf
        self.codes: set[str] = set()
        self.changed = 0

    @property
    def now(self) -> Instant:
        return instant(self.t)

    def own(self) -> OwnState:
        s = self.state
        return OwnState(self.now, s.north_m, s.east_m, s.depth_m, s.velocity_ned_mps, s.heading_rad)

    def fly(self, ships: Tracks, wanted: Velocity | None, duration_s: float) -> Verdict:
        verdict = None
        for _ in range(round(duration_s * 10)):
            verdict = self.guard.check(self.now, self.own(), heartbeat(self.t), ships, 1, wanted)
            assert verdict.velocity_ned_mps is not None
            self.codes |= codes(verdict)
            self.changed += verdict.changed
            self.state = self._hull.step(self.state, Demand(verdict.velocity_ned_mps), 0.1)
            self.t += 0.1
            sets = reach.at(ships, self.now).nearest(self.own().position_m)
            self.closest_m = min(self.closest_m, float(sets.distance_m.min(initial=math.inf)))
        assert verdict is not None
        return verdict


# ---------------------------------------------------------------- preconditions


def test_a_clear_sea_lets_the_wanted_velocity_through() -> None:
    verdict = check(Guard(config()), Tracks.empty(), AHEAD)
    assert verdict == Verdict(AHEAD, changed=False, reasons=(), way_out=True)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"heartbeat": None}, "guard.no_heartbeat"),
        ({"heartbeat": heartbeat(at_s=-3.1)}, "guard.heartbeat_lost"),
        ({"heartbeat": heartbeat(armed=False)}, "guard.disarmed"),
        ({"heartbeat": heartbeat(takes_setpoints=False, mode="MANUAL")}, "guard.mode"),
        ({"own": None}, "guard.no_position"),
        ({"own": own(at_s=-1.1)}, "guard.position_lost"),
        ({"own": own(north_m=math.nan)}, "guard.position_invalid"),
        ({"own": replace(own(), velocity_ned_mps=(0.0, math.inf, 0.0))}, "guard.position_invalid"),
        ({"reports_heard": 0}, "guard.no_report"),
        ({"wanted_ned_mps": None}, "guard.no_plan"),
        ({"wanted_ned_mps": (math.nan, 0.0, 0.0)}, "guard.plan_invalid"),
        ({"wanted_ned_mps": (0.0, math.inf, 0.0)}, "guard.plan_invalid"),
    ],
)
def test_it_stays_closed_while_a_precondition_is_missing(changes: dict[str, object], code: str) -> None:
    verdict = check(Guard(config()), Tracks.empty(), AHEAD, **changes)
    assert verdict.velocity_ned_mps is None
    assert not verdict.changed
    assert code in codes(verdict)


def test_every_missing_precondition_is_named_once() -> None:
    verdict = check(Guard(config()), Tracks.empty(), None, heartbeat=None, own=None, reports_heard=0)
    named = [reason.code for reason in verdict.reasons]
    assert sorted(named) == ["guard.no_heartbeat", "guard.no_plan", "guard.no_position", "guard.no_report"]


def test_a_stale_limit_is_kept_to_the_tick() -> None:
    guard = Guard(config())
    verdict = check(guard, Tracks.empty(), AHEAD, own=own(at_s=-1.0), heartbeat=heartbeat(at_s=-3.0))
    assert verdict.velocity_ned_mps == AHEAD


def test_px4_gets_zero_velocity_before_offboard_only_when_asked_for() -> None:
    waiting = heartbeat(firmware="px4", takes_setpoints=False, mode="HOLD")
    empty = Tracks.empty()
    assert check(Guard(config()), empty, AHEAD, heartbeat=waiting).velocity_ned_mps is None
    asked = Guard(config(autopilot={"prestream_offboard": True}))
    assert check(asked, empty, AHEAD, heartbeat=waiting).velocity_ned_mps == (0.0, 0.0, 0.0)
    silent = heartbeat(firmware="px4", takes_setpoints=False, at_s=-4.0)
    assert check(asked, empty, AHEAD, heartbeat=silent).velocity_ned_mps is None
    ardupilot = heartbeat(takes_setpoints=False, mode="MANUAL")
    assert check(asked, empty, AHEAD, heartbeat=ardupilot).velocity_ned_mps is None


@pytest.mark.parametrize("what", ["own", "heartbeat"])
def test_what_is_stamped_later_than_now_is_not_fresh(what: str) -> None:
    ahead = {"own": own(at_s=0.001), "heartbeat": heartbeat(at_s=0.001)}
    verdict = check(Guard(config()), Tracks.empty(), AHEAD, **{what: ahead[what]})
    assert verdict.velocity_ned_mps is None
    assert codes(verdict) == {{"own": "guard.position_lost", "heartbeat": "guard.heartbeat_lost"}[what]}


def test_a_clock_set_back_closes_it_for_good_and_says_by_how_much() -> None:
    guard = Guard(config())

    def at(t: float) -> Verdict:
        return check(guard, Tracks.empty(), AHEAD, now=instant(t), own=own(at_s=t), heartbeat=heartbeat(t))

    assert at(10.0).velocity_ned_mps == at(10.0).velocity_ned_mps == AHEAD
    for t in (9.0, 9.5, 20.0, 19.75):
        verdict = at(t)
        assert verdict.velocity_ned_mps is None
        assert codes(verdict) == {"guard.clock_set_back"}
    assert "set back 1.2 s" in verdict.reasons[0].text


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-5, 200))
def test_speed_and_depth_limits_hold_whatever_is_wanted(
    vn: float, ve: float, vd: float, depth: float
) -> None:
    vehicle = config().vehicle
    verdict = check(Guard(config()), Tracks.empty(), (vn, ve, vd), own=own(depth_m=depth))
    assert verdict.velocity_ned_mps is not None
    n, e, d = verdict.velocity_ned_mps
    assert math.hypot(n, e) <= vehicle.max_speed_mps * (1 + 1e-6)
    assert abs(d) <= vehicle.max_vertical_speed_mps
    if d > 0:
        assert depth + d <= vehicle.max_depth_m + 1e-9
    if depth > vehicle.max_depth_m + 1:
        assert d <= 0


# ---------------------------------------------------------------- the way out


def moored(**row: float) -> Tracks:
    still = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "heading_rad": 0.0}
    return tracks({**still, "north_m": 200.0, "validity_s": 1500.0, **row})


def test_a_frozen_planner_steering_at_a_moored_ship_stops_outside_the_margins() -> None:
    flight = Flight()
    ship = moored()
    verdict = flight.fly(ship, AHEAD, 180.0)
    guard = config().guard
    margin = DELTA_M + guard.own_position_error_m
    assert "guard.way_out" in flight.codes
    assert flight.changed > 100
    assert verdict.way_out
    assert margin < flight.closest_m < margin + 15.0


def test_it_does_not_enter_a_lane_that_it_cannot_leave_in_time() -> None:
    """Outside delta now says nothing: the bow is 100 m away and twice as fast as the vehicle."""
    bow = tracks({"cog_rad": math.pi / 2, "east_m": -150.0, "north_m": 25.0, **PAPER})
    flight = Flight(north_m=-20.0)
    flight.fly(bow, AHEAD, 120.0)
    assert flight.closest_m > DELTA_M
    assert flight.changed > 0


def test_a_planner_that_falls_silent_leaves_the_vehicle_on_its_way_out() -> None:
    for nothing, code in ((None, "guard.no_plan"), ((math.nan, 0.0, 0.0), "guard.plan_invalid")):
        lane = tracks({"cog_rad": math.pi / 2, "east_m": -600.0, "north_m": 60.0, **PAPER})
        flight = Flight()
        flight.fly(lane, AHEAD, 25.0)
        flight.codes = set()
        verdict = flight.fly(lane, nothing, 200.0)
        assert verdict.changed
        assert code in flight.codes
        assert "guard.way_out" not in flight.codes  # nothing was wanted that could leave none
        assert flight.closest_m > DELTA_M


def test_put_in_front_of_a_bow_it_flies_the_least_bad_and_says_so() -> None:
    bow = tracks({"cog_rad": 0.0, "north_m": -60.0, "east_m": 4.0, **PAPER})
    flight = Flight()
    verdict = flight.fly(bow, (0.0, 0.0, 0.0), 2.0)
    assert "guard.no_way_out" in flight.codes
    assert not verdict.way_out
    assert verdict.velocity_ned_mps is not None
    assert verdict.velocity_ned_mps[1] < -1.0  # to the nearer side
    later = flight.fly(bow, (0.0, 0.0, 0.0), 60.0)
    assert later.way_out
    assert "guard.no_way_out" not in codes(later)


@pytest.mark.parametrize("beyond_m", [1.0, 3.0, 6.0])
def test_from_a_start_a_few_metres_outside_delta_it_leaves(beyond_m: float) -> None:
    ship = tracks({"cog_rad": 0.0, **PAPER})
    side = reach.at(ship, T0).support(np.array(((0.0, 1.0),)))[0, 0]
    flight = Flight(east_m=float(side) + DELTA_M + beyond_m)
    flight.fly(ship, (0.0, -2.5, 0.0), 30.0)
    assert flight.closest_m > DELTA_M


def test_it_takes_the_wanted_velocity_again_as_soon_as_that_leaves_a_way_out() -> None:
    passing = tracks({"cog_rad": math.pi / 2, "east_m": -150.0, "north_m": 40.0, **PAPER})
    flight = Flight()
    flight.fly(passing, AHEAD, 20.0)
    assert flight.changed > 0
    verdict = flight.fly(passing, AHEAD, 100.0)
    assert not verdict.changed
    assert flight.state.north_m > 100.0
    assert flight.closest_m > DELTA_M


@pytest.mark.parametrize(
    ("firmware", "prestream", "meanwhile"),
    [("ardupilot", False, None), ("px4", False, None), ("px4", True, (0.0, 0.0, 0.0))],
)
@pytest.mark.parametrize("near_m", [0.0, 120.0])  # stopping is the way out; one was rolled out
def test_hands_off_voids_what_was_planned(
    firmware: str, prestream: bool, meanwhile: Velocity | None, near_m: float
) -> None:
    ship = moored()
    flight = Flight(config(autopilot={"prestream_offboard": prestream}), north_m=near_m)
    flight.fly(ship, AHEAD, 5.0)
    taken = heartbeat(flight.t, takes_setpoints=False, mode="MANUAL", firmware=firmware)
    assert flight.guard.check(flight.now, flight.own(), taken, ship, 1, AHEAD).velocity_ned_mps == meanwhile
    flight.t += 0.1
    silent = flight.guard.check(flight.now, flight.own(), heartbeat(flight.t), ship, 1, None)
    assert silent.velocity_ned_mps is None  # starts closed again


def test_a_sea_that_empties_needs_no_way_out() -> None:
    flight = Flight()
    flight.fly(moored(), AHEAD, 2.0)
    verdict = flight.fly(Tracks.empty(), AHEAD, 0.2)
    assert verdict.way_out
    assert verdict.velocity_ned_mps == AHEAD


def test_blown_off_its_way_out_it_keeps_to_it_where_none_begins_here(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = Flight()
    flight.fly(moored(), AHEAD, 20.0)
    flight.fly(moored(), None, 1.0)
    before = flight.guard._way_out
    flight.state = replace(flight.state, east_m=flight.state.east_m + 3.9)
    monkeypatch.setattr(Search, "is_clear", lambda *_: False)
    monkeypatch.setattr(WayOut, "deviation_m", lambda *_: 50.0)
    flight.fly(moored(), None, 0.2)
    assert flight.guard._way_out is before


@pytest.mark.parametrize("aside_m", [10.0, 40.0])
def test_blown_off_its_way_out_it_anchors_it_anew_where_that_is_clear(aside_m: float) -> None:
    flight = Flight()
    flight.fly(moored(), AHEAD, 20.0)
    flight.fly(moored(), None, 1.0)
    flight.state = replace(flight.state, east_m=flight.state.east_m + aside_m)
    verdict = flight.fly(moored(), None, 0.2)
    assert verdict.way_out
    assert "guard.tracking" in flight.codes
    assert "guard.position_accuracy" in flight.codes


# ---------------------------------------------------------------- new reports


def test_a_new_report_within_the_old_set_does_not_void_the_way_out() -> None:
    """The ship is in both sets: what was clear of the old one stays so."""
    old = moored(position_error_m=10.0)
    flight = Flight(north_m=136.0)
    flight.fly(old, (0.0, 0.0, 0.0), 2.0)
    nearer = moored(position_error_m=10.0, north_m=181.0, measured_at_s=flight.t)
    flight.codes = set()
    verdict = flight.fly(nearer, None, 0.1)
    assert verdict.way_out
    assert "note.guard_older_report" in flight.codes
    assert "guard.report_unforetold" not in flight.codes


def test_a_ship_that_breaks_its_bounds_is_noticed_and_a_new_way_out_is_found() -> None:
    old = tracks({"cog_rad": 0.0, "east_m": 200.0, **PAPER})
    flight = Flight()
    flight.fly(old, AHEAD, 10.0)
    turned = tracks(
        {"cog_rad": -math.pi / 2, "east_m": 200.0, "north_m": 60.0, "measured_at_s": flight.t, **PAPER}
    )
    verdict = flight.fly(turned, AHEAD, 60.0)
    assert "guard.report_unforetold" in flight.codes
    assert verdict.way_out
    assert flight.closest_m > DELTA_M


def test_a_stored_way_out_that_a_ship_out_of_bounds_closes_is_given_up() -> None:
    far = tracks({"north_m": 3000.0, **PAPER})
    flight = Flight()
    flight.fly(far, (0.0, 0.0, 0.0), 5.0)
    upon_us = tracks({"north_m": -45.0, "measured_at_s": flight.t, **PAPER})
    verdict = flight.fly(upon_us, (0.0, 0.0, 0.0), 0.1)
    assert not verdict.way_out
    assert {"guard.no_way_out", "guard.report_unforetold"} <= codes(verdict)


# ---------------------------------------------------------------- the end of the information


def test_in_water_closed_by_a_silent_ship_it_holds_instead_of_fleeing() -> None:
    silent = tracks({"measured_at_s": -900.0, "north_m": 300.0})
    verdict = check(Guard(config()), silent, AHEAD)
    assert verdict.velocity_ned_mps == (0.0, 0.0, 0.0)
    assert "guard.unknown_water" in codes(verdict)


def test_a_boat_that_has_to_hold_keeps_its_heading_instead_of_turning_north() -> None:
    """Zero velocity has a direction to a boat, and the guard's own zero is no exception."""
    settings = config(vehicle={"cruise_depth_m": 0.0})
    silent = tracks({"measured_at_s": -900.0, "north_m": 300.0})
    boat = replace(own(depth_m=0.0), heading_rad=math.pi / 2)
    verdict = check(Guard(settings), silent, AHEAD, own=boat, heartbeat=heartbeat(vehicle="boat"))
    assert verdict.velocity_ned_mps == pytest.approx((0.0, CREEP_MPS, 0.0))


def test_while_it_holds_in_unknown_water_other_ships_still_move_it() -> None:
    silent = {"measured_at_s": -900.0, "north_m": 300.0}
    near = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "north_m": 42.0}
    verdict = check(Guard(config()), tracks(silent, near), AHEAD)
    assert {"guard.unknown_water", "guard.no_way_out"} <= codes(verdict)
    assert verdict.velocity_ned_mps is not None
    assert verdict.velocity_ned_mps[0] < -0.5
