"""What an operator reads: every reason of the guard, word for word, and the limits it cuts to."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.instant import instant
from companion.messages import OwnState, Reason, Tracks
from companion.planning.guard import Guard, Velocity, Verdict
from companion.planning.guard.limits import limited
from companion.planning.guard.watch import Watch
from companion.planning.guard.way_out import WayOut
from tests.builders import T0, config, heartbeat, own, tracks

VEHICLE = config().vehicle
STILL = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0}


def check(**changes: object) -> Verdict:
    inputs: dict[str, object] = {
        "now": T0,
        "own": own(),
        "heartbeat": heartbeat(),
        "tracks": Tracks.empty(),
        "reports_heard": 1,
        "wanted_ned_mps": (1.0, 0.0, 0.0),
    }
    return Guard(config()).check(**{**inputs, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"heartbeat": None}, Reason("guard.no_heartbeat", "no autopilot heartbeat heard yet")),
        (
            {"heartbeat": heartbeat(at_s=-3.25)},
            Reason("guard.heartbeat_lost", "no autopilot heartbeat for 3.2 s"),
        ),
        ({"heartbeat": heartbeat(armed=False)}, Reason("guard.disarmed", "vehicle is disarmed")),
        (
            {"heartbeat": heartbeat(takes_setpoints=False, mode="RTL")},
            Reason("guard.mode", "autopilot is in RTL, not GUIDED or OFFBOARD: hands off"),
        ),
        ({"own": None}, Reason("guard.no_position", "no own position heard yet")),
        ({"own": own(at_s=-1.5)}, Reason("guard.position_lost", "own position is 1.5 s old")),
        ({"own": own(math.inf)}, Reason("guard.position_invalid", "own position is not a number")),
        (
            {"reports_heard": 0},
            Reason("guard.no_report", "no contact report ever heard: that is not an empty sea"),
        ),
        ({"wanted_ned_mps": None}, Reason("guard.no_plan", "the planner gave no velocity")),
        (
            {"wanted_ned_mps": (0.0, 0.0, math.nan)},
            Reason("guard.plan_invalid", "the planner's velocity is no number"),
        ),
        (
            {"wanted_ned_mps": (3.0, 4.0, 0.0)},
            Reason("guard.speed", "5.00 m/s cut to vehicle.max_speed_mps = 2.5"),
        ),
        (
            {"wanted_ned_mps": (0.0, 0.0, 0.5), "own": own(depth_m=VEHICLE.max_depth_m)},
            Reason("guard.depth", f"kept above vehicle.max_depth_m = {VEHICLE.max_depth_m:g}"),
        ),
        (
            {"tracks": tracks({"measured_at_s": -900.0, "north_m": 300.0})},
            Reason("guard.unknown_water", "1 ships silent for too long can be here: holding"),
        ),
        (
            {"tracks": tracks({**STILL, "north_m": 41.0})},
            Reason("guard.no_way_out", "no way out stays clear of every ship: flying the least bad"),
        ),
    ],
)
def test_each_reason_says_what_is_wrong(changes: dict[str, object], reason: Reason) -> None:
    assert check(**changes).reasons == (reason,)


def second_look(speed_mps: float, ships: Tracks, again: Tracks) -> Verdict:
    """Half a second after a first look at rest."""
    guard = Guard(config())
    guard.check(T0, own(), heartbeat(), ships, 1, (0.0, 0.0, 0.0))
    state = replace(own(at_s=0.5), velocity_ned_mps=(speed_mps, 0.0, 0.0))
    return guard.check(state.stamp, state, heartbeat(0.5), again, 1, (2.5, 0.0, 0.0))


def test_a_stored_way_out_that_is_flown_is_told_and_so_is_what_it_rests_on() -> None:
    ship = {**STILL, "position_error_m": 10.0, "heading_rad": 0.0, "validity_s": 1500.0}
    near = tracks({**ship, "north_m": 64.0})
    nearer = tracks({**ship, "north_m": 45.0, "measured_at_s": 0.4})
    assert Reason("guard.way_out", "what is wanted leaves no way out: flying the stored one") in (
        second_look(2.0, near, near).reasons
    )
    rests = second_look(0.0, near, nearer)
    assert Reason("note.guard_older_report", "way out rests on an older report's set") in rests.reasons
    assert rests.way_out


def test_before_offboard_px4_is_told_why_it_gets_zeros() -> None:
    guard = Guard(config(autopilot={"prestream_offboard": True}))
    waiting = heartbeat(firmware="px4", takes_setpoints=False)
    verdict = guard.check(T0, own(), waiting, Tracks.empty(), 1, None)
    text = "zero velocity so that PX4 admits OFFBOARD (autopilot.prestream_offboard)"
    assert verdict == Verdict((0.0, 0.0, 0.0), False, (Reason("guard.prestream", text),))


def test_each_assumption_that_is_left_is_told_with_its_numbers() -> None:
    settings = config()
    off = WayOut(T0, np.array((0.0, 9.0)), np.zeros(2), np.full(2, 12.5), (0.0, 0.0), 5.0, verified=True)
    assert Watch(settings).look(T0, own(), off, (0.0, 0.0)) == [
        Reason("guard.tracking", "12.5 m off the way out, guard.tracking_error_m = 8")
    ]

    def at(t: float, north_m: float = 0.0, speed: float = 0.0) -> OwnState:
        return replace(own(north_m, at_s=t), velocity_ned_mps=(speed, 0.0, 0.0))

    watch = Watch(settings)
    watch.look(T0, at(0.0), None, (0.0, 0.0))
    assert watch.look(instant(1.0), at(1.0, 60.4), None, (0.0, 0.0)) == [
        Reason("guard.position_accuracy", "own position jumped 60 m")
    ]
    assert watch.look(instant(2.0), at(2.0, 60.4), None, (0.0, 0.0)) == [
        Reason(
            "guard.position_accuracy",
            "own position may be 60 m off since a jump: margins are that wider",
        )
    ]
    watch = Watch(settings)
    for second in range(90):
        said = watch.look(instant(second), at(second, 1.0 * second, 1.0), None, (2.5, 0.0))
    allowed = settings.guard.current_mps
    assert said == [Reason("guard.current", f"makes 1.5 m/s less than sent, guard.current_mps = {allowed:g}")]
    ship = {"position_error_m": 1.0, "speed_noise_mps": 0.05}
    two = tracks(ship, {**ship, "north_m": 3000.0})
    watch.compare(two, tracks({**ship, "east_m": 900.0, "measured_at_s": 60.0}))
    said = watch.look(instant(91.0), at(91.0, 91.0, 1.0), None, (2.5, 0.0))
    assert Reason("guard.report_unforetold", "MMSI 230000001 left its declared bounds (1 ships)") in said


# ---------------------------------------------------------------- limits


@pytest.mark.parametrize(
    ("wanted", "depth_m", "kept", "codes"),
    [
        ((2.5, 0.0, 0.0), 10.0, (2.5, 0.0, 0.0), []),
        ((1.5, -2.0, 0.0), 10.0, (1.5, -2.0, 0.0), []),
        ((3.0, -4.0, 0.0), 10.0, (1.5, -2.0, 0.0), ["guard.speed"]),
        ((0.0, 0.0, 9.0), 10.0, (0.0, 0.0, 0.5), []),
        ((0.0, 0.0, -9.0), 10.0, (0.0, 0.0, -0.5), []),
        ((0.0, 0.0, 0.25), 59.75, (0.0, 0.0, 0.25), []),  # reaches the floor in a second, not beyond
        ((0.0, 0.0, 0.5), 59.75, (0.0, 0.0, 0.25), ["guard.depth"]),
        ((0.0, 0.0, 0.5), 60.0, (0.0, 0.0, -0.5), ["guard.depth"]),
        ((0.0, 0.0, 0.5), 70.0, (0.0, 0.0, -0.5), ["guard.depth"]),
        ((0.0, 0.0, 0.0), 70.0, (0.0, 0.0, 0.0), []),  # it is not told to rise, only not to sink
    ],
)
def test_what_is_wanted_is_cut_to_the_vehicles_limits(
    wanted: Velocity, depth_m: float, kept: Velocity, codes: list[str]
) -> None:
    vehicle = config(vehicle={"max_depth_m": 60.0}).vehicle
    cut, reasons = limited(wanted, own(depth_m=depth_m), vehicle)
    assert cut == pytest.approx(kept)
    assert [reason.code for reason in reasons] == codes
