"""Losses as the wire brings them: real bytes into the whole core, rows of the table in docs/guard.md."""

import math

import pytest
from pymavlink.dialects.v20 import common as mav

from companion.core import Core
from companion.instant import instant
from companion.loop import Tick
from companion.messages import Command, Decision, Status
from companion.requests import SET_MESSAGE_INTERVAL
from companion.takeover import COMPONENT_ARM_DISARM, DO_SET_MODE
from tests.test_core import LON, Vehicle, core, frame, sail

SUBMARINE, BOAT = 12, 11
GUIDED = {SUBMARINE: 4, BOAT: 15}
PERMITTED: dict[str, object] = {"may_set_mode": True, "may_arm": True}


class Talker(Vehicle):
    """Somebody on the link: by default the vehicle's autopilot."""

    def __init__(self, system: int = 7, component: int = 1) -> None:
        self._mav = mav.MAVLink(None, srcSystem=system, srcComponent=component)

    def beat(self, kind: int = SUBMARINE, mode: int | None = None, armed: bool = True) -> bytes:
        base = 1 | (128 if armed else 0)
        mode = GUIDED[kind] if mode is None else mode
        return self._pack(mav.MAVLink_heartbeat_message(kind, 3, base, mode, 4, 3))

    def fix(self, lat_1e7: int = 597_000_000, lon_1e7: int = round(LON * 1e7), alt_mm: int = 0) -> bytes:
        return self._pack(mav.MAVLink_global_position_int_message(0, lat_1e7, lon_1e7, 0, alt_mm, 0, 0, 0, 0))

    def local(self, **values: float) -> bytes:
        full = {**dict.fromkeys(("x", "y", "z", "vx", "vy", "vz"), 0.0), **values}
        return self._pack(mav.MAVLink_local_position_ned_message(time_boot_ms=0, **full))

    def setpoint(self) -> bytes:
        return self._pack(
            mav.MAVLink_set_position_target_local_ned_message(
                0, 7, 1, 1, 0x0DC7, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0
            )
        )

    def say(self, message: object) -> bytes:
        return self._pack(message)


def step(subject: Core, t_s: float, *data: bytes) -> Decision:
    t = instant(t_s)
    return subject.step(Tick(t, (frame(t, b"".join(data)),)))


def codes(decision: Decision) -> set[str]:
    return {reason.code for reason in decision.reasons}


def under_way(**sections: dict[str, object]) -> Core:
    """Five seconds old, crossing, one ship heard."""
    subject = core(vehicle={"listen_s": 1.0}, **sections)
    assert sail(subject, 5.0)[-1].setpoint is not None
    return subject


def asked(decisions: list[Decision]) -> set[int]:
    return {m.command for d in decisions for m in d.outgoing if isinstance(m, Command)}


# ---------------------------------------------------------------- a human, or a failsafe


@pytest.mark.parametrize(
    ("kind", "mode"),
    [
        *[(SUBMARINE, mode) for mode in (0, 1, 2, 3, 7, 9, 16, 19)],  # STABILIZE ... SURFACE ... MANUAL
        *[(BOAT, mode) for mode in (0, 3, 4, 5, 10, 11, 12)],  # MANUAL ... HOLD, LOITER, AUTO, RTL, SMART_RTL
    ],
)
def test_any_other_mode_whoever_chose_it_is_hands_off_in_the_same_step_until_it_is_given_back(
    kind: int, mode: int
) -> None:
    subject, talker = under_way(autopilot=PERMITTED), Talker()
    taken = [step(subject, 5.0, talker.beat(kind, mode), talker.position(5.0))]
    for k in range(1, 100):
        beat = talker.beat(kind, mode) if k % 10 == 0 else b""
        taken.append(step(subject, 5.0 + k / 10, beat, talker.position(5.0, north_m=0.1 * k)))
    assert all(d.setpoint is None for d in taken)
    assert all(d.status is Status.CLOSED and "guard.mode" in codes(d) for d in taken)
    assert not asked(taken) & {DO_SET_MODE, COMPONENT_ARM_DISARM}  # a human is never argued with
    given = step(subject, 15.0, talker.beat(kind), talker.position(15.0, north_m=10.0))
    assert given.setpoint is not None


def test_disarmed_by_a_human_it_does_not_arm_again() -> None:
    subject, talker = under_way(autopilot=PERMITTED), Talker()
    disarmed = [
        step(subject, 5.0 + k / 10, talker.beat(armed=False), talker.position(5.0)) for k in range(60)
    ]
    assert all(d.setpoint is None and "guard.disarmed" in codes(d) for d in disarmed)
    assert not asked(disarmed) & {DO_SET_MODE, COMPONENT_ARM_DISARM}


def test_an_autopilot_that_reboots_is_asked_for_its_streams_again_and_left_to_a_human() -> None:
    subject, talker = under_way(autopilot=PERMITTED), Talker()
    away = [step(subject, 5.0 + k / 10) for k in range(100)]
    assert all(d.setpoint is None for d in away[31:])
    back = []
    for k in range(50):
        beat = talker.beat(mode=19, armed=False) if k % 10 == 0 else b""
        back.append(step(subject, 15.0 + k / 10, beat, talker.position(k / 10)))
    assert all(d.setpoint is None for d in back)
    assert {"guard.mode", "guard.disarmed"} <= codes(back[-1])
    assert asked(back) == {SET_MESSAGE_INTERVAL}
    assert step(subject, 20.0, talker.beat(), talker.position(5.0)).setpoint is not None


# ---------------------------------------------------------------- somebody else on the link


@pytest.mark.parametrize(
    "other",
    [
        Talker(7, 190).say(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)),  # a ground station
        Talker(7, 1).say(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)),  # even under the autopilot's id
        Talker(255, 190).say(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)),
        Talker(7, 196).say(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)),  # another companion
        Talker(8, 1).beat(),  # another vehicle, armed and in GUIDED
    ],
)
def test_only_the_autopilots_own_heartbeat_keeps_the_guard_open(other: bytes) -> None:
    subject, talker = under_way(), Talker()
    heard = [step(subject, 5.0 + k / 10, other, talker.position(5.0)) for k in range(40)]
    given = [d.setpoint is not None for d in heard]
    assert given == [True] * 21 + [False] * 19  # the last own heartbeat came at 4 s
    assert "guard.heartbeat_lost" in codes(heard[-1])


@pytest.mark.parametrize(
    "nothing",
    [
        b"",
        Talker(8).fix(),  # another vehicle's
        Talker(7, 191).fix(),  # another component's
        Talker().fix(0, 0),  # no fix
        Talker().fix(910_000_000),
        Talker().fix(alt_mm=-20_000_000),  # 20 km deep
        *[Talker().local(x=value) for value in (0.0, math.nan, math.inf, 3e38)],  # nobody said from where
    ],
)
def test_a_position_that_is_none_of_ours_or_impossible_is_no_position(nothing: bytes) -> None:
    subject, talker = under_way(), Talker()
    heard = [step(subject, 5.0 + k / 10, talker.beat(), nothing) for k in range(20)]
    assert [d.setpoint is not None for d in heard] == [True] * 10 + [False] * 10
    assert "guard.position_lost" in codes(heard[-1])


def test_a_second_companion_on_the_link_changes_nothing() -> None:
    alone, beside = under_way(), under_way()
    talker, other = Talker(), Talker(7, 196)
    noise = other.say(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)) + other.setpoint() + other.fix(1, 1)
    for k in range(30):
        said = talker.beat() + talker.position(5.0)
        one, two = (step(alone, 5.0 + k / 10, said), step(beside, 5.0 + k / 10, noise, said, noise))
        assert one.setpoint == two.setpoint is not None
    counts = [step(s, 9.0, talker.beat(), talker.position(9.0)).counts for s in (alone, beside)]
    assert counts[1]["mavlink.own_component"] >= 60
    assert "mavlink.own_component" not in counts[0]


# ---------------------------------------------------------------- positions and clocks that jump


@pytest.mark.parametrize("jump_m", [60.0, -400.0, 30_000.0])
def test_a_position_that_jumps_is_told_at_once_and_steered_by_with_wider_margins(jump_m: float) -> None:
    subject, talker = under_way(), Talker()
    decision = step(subject, 5.0, talker.beat(), talker.position(5.0, north_m=jump_m))
    assert {"own.position_jumped", "guard.position_accuracy"} <= codes(decision)
    assert decision.status is Status.DEGRADED
    assert decision.setpoint is not None
    later = [step(subject, 5.1 + k, talker.beat(), talker.position(k, north_m=jump_m)) for k in range(20)]
    assert all("guard.position_accuracy" in codes(d) for d in later)


@pytest.mark.parametrize("back_s", [0.5, 1.0, 60.0, 3600.0, 13.9 * 86_400])
def test_a_clock_set_back_closes_for_good_however_fresh_everything_seems(back_s: float) -> None:
    """Ages would be too young by that much: nothing is steered by them."""
    subject = under_way()
    decisions = sail(subject, 120.0, from_s=5.0 - back_s)
    assert all(d.setpoint is None for d in decisions)
    assert all(d.reasons[0].code == "guard.clock_set_back" for d in decisions)
    assert all(d.status is Status.CLOSED for d in decisions)


def test_a_clock_set_ahead_makes_everything_old_and_nothing_new() -> None:
    subject, talker = under_way(), Talker()
    known = step(subject, 5.0, talker.beat(), talker.position(5.0)).tracks
    decision = step(subject, 3605.0, talker.beat(), talker.position(5.0))
    age_s = decision.tracks.age_s(decision.t)
    assert age_s == pytest.approx(known.age_s(instant(5.0)) + 3600.0)
    assert "guard.unknown_water" in codes(decision)
    assert decision.setpoint is not None
    assert math.hypot(*decision.setpoint.velocity_ned_mps[:2]) < 1e-9


@pytest.mark.parametrize("step_s", [-13.9 * 86_400, -61.0, -3.0, 3.0, 3600.0, 400.0 * 86_400])
def test_utc_that_steps_is_counted_and_moves_neither_ships_nor_the_vehicle(step_s: float) -> None:
    """AIS_VESSEL says its own age; UTC only dates what comes over the bus."""
    epoch_us, talker = 1_700_000_000 * 10**6, Talker()

    def sailed(by_s: float) -> list[Decision]:
        subject = core(vehicle={"listen_s": 1.0})
        decisions = []
        for k in range(200):
            utc_us = epoch_us + k * 100_000 + (round(by_s * 1e6) if k >= 100 else 0)
            said = [talker.position(k / 10), talker.say(mav.MAVLink_system_time_message(utc_us, 0))]
            if k % 10 == 0:
                said += [talker.beat(), talker.ship(230_000_001, 400.0, 2000.0)]
            decisions.append(step(subject, k / 10, *said))
        return decisions

    steady, stepped = sailed(0.0), sailed(step_s)
    assert [d.setpoint for d in steady] == [d.setpoint for d in stepped]
    assert (stepped[-1].tracks.measured_at_ns == steady[-1].tracks.measured_at_ns).all()
    counted = [d.counts["utc.steps"] for d in (*steady, *stepped) if d.counts]
    assert counted[-1] == 1
    assert sum(counted[: len(counted) // 2]) == 0


# ---------------------------------------------------------------- the contact source


def test_a_contact_source_that_dies_at_the_surface_is_told_ever_more_plainly_and_never_a_clear_sea() -> None:
    """A boat, always at the surface: its receiver dies after a minute, positions and heartbeats go on."""
    subject, talker = core(vehicle={"listen_s": 1.0, "cruise_depth_m": 0.0}), Talker()
    said: dict[str, float] = {}
    for t in range(0, 1500, 3):
        heard = talker.ship(230_000_001, 2000.0, 0.0, velocity=0) if t <= 60 else b""
        decision = step(subject, float(t), talker.beat(BOAT), talker.position(0.0), heard)
        for code in codes(decision):
            said.setdefault(code, float(t))
        assert len(decision.tracks) == 1  # it is never forgotten
    assert 600 < said["guard.unknown_water"] < 850  # 600 s of validity, then 2 km at 16 m/s
    assert decision.status is Status.DEGRADED
    assert {"guard.unknown_water", "plan.expired"} <= codes(decision)
    assert decision.setpoint is not None
    assert math.hypot(*decision.setpoint.velocity_ned_mps[:2]) < 0.1  # it holds its place
