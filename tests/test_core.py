"""The core as a whole: real bytes in, decisions out; hostile bytes in, no exception."""

import math
import random
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mav

from companion.build import build
from companion.core import Core
from companion.instant import Instant, after, instant
from companion.loop import Tick
from companion.messages import Command, Decision, Frame, Heartbeat, Link, Phase, Setpoint, Status, StatusText
from companion.planning.field import ExactRepulsion
from companion.record import DecisionRecorder, encode
from tests.builders import config

LAT, LON = 59.7, 24.7


class Vehicle:
    """An autopilot's side of the wire, one message at a time."""

    def __init__(self) -> None:
        self._mav = mav.MAVLink(None, srcSystem=7, srcComponent=1)

    def heartbeat(self, mode: int = 4, armed: bool = True) -> bytes:
        base = 1 | (128 if armed else 0)
        return self._pack(mav.MAVLink_heartbeat_message(12, 3, base, mode, 4, 3))

    def position(self, t_s: float, north_m: float = 0.0, depth_m: float = 0.0) -> bytes:
        lat = round((LAT + north_m / 111_400) * 1e7)
        return self._pack(
            mav.MAVLink_global_position_int_message(
                int(t_s * 1000) % 2**32, lat, round(LON * 1e7), 0, round(-depth_m * 1000), 0, 0, 0, 0
            )
        )

    def ship(self, mmsi: int, north_m: float, east_m: float, age_s: int = 1, **fields: int) -> bytes:
        values = {
            "MMSI": mmsi,
            "lat": round((LAT + north_m / 111_400) * 1e7),
            "lon": round((LON + east_m / (111_320 * math.cos(math.radians(LAT)))) * 1e7),
            "COG": 9000,
            "heading": 9000,
            "velocity": 500,
            "turn_rate": 0,
            "navigational_status": 0,
            "type": 70,
            "dimension_bow": 50,
            "dimension_stern": 25,
            "dimension_port": 12,
            "dimension_starboard": 13,
            "callsign": b"CALL",
            "name": b"SHIP",
            "tslc": age_s,
            "flags": 1 | 2 | 4 | 64,
            **fields,
        }
        return self._pack(mav.MAVLink_ais_vessel_message(**values))

    def _pack(self, message: object) -> bytes:
        return bytes(message.pack(self._mav))  # type: ignore[attr-defined]


def core(**sections: dict[str, object]) -> Core:
    settled = config(repulsion={"kind": "exact"}, **sections)
    return Core(settled, ExactRepulsion(settled.field))


def frame(t: Instant, data: bytes) -> Frame:
    return Frame(t, Link.MAVLINK, data)


def sail(
    subject: Core, seconds: float, *, from_s: float = 0.0, extra: bytes = b"", **how: float
) -> list[Decision]:
    """Ten ticks a second of a healthy vehicle at rest that hears one ship."""
    vehicle, decisions = Vehicle(), []
    for k in range(round(seconds * 10)):
        t_s = from_s + k / 10
        data = vehicle.position(t_s, **how)
        if k % 10 == 0:
            data += vehicle.heartbeat() + vehicle.ship(230_000_001, 400.0, 2000.0) + extra
        decisions.append(subject.step(Tick(instant(t_s), (frame(instant(t_s), data),))))
    return decisions


def test_it_listens_then_crosses_with_the_vehicles_own_system_id() -> None:
    decisions = sail(core(vehicle={"listen_s": 5.0}), 10.0)
    assert [d.phase for d in (decisions[1], decisions[-1])] == [Phase.LISTEN, Phase.CROSS]
    assert decisions[-1].system_id == 7
    assert decisions[-1].status is Status.OK
    assert len(decisions[-1].tracks) == 1
    setpoint = decisions[-1].setpoint
    assert setpoint is not None
    north, east, down = setpoint.velocity_ned_mps
    assert math.hypot(north, east) == pytest.approx(2.5)
    assert down == pytest.approx(0.5)
    assert setpoint.valid_until == after(setpoint.stamp, 0.5)


def test_heartbeats_go_out_once_a_second_and_setpoints_every_step() -> None:
    decisions = sail(core(vehicle={"listen_s": 1.0}), 10.0)
    sent = [message for d in decisions for message in d.outgoing]
    assert sum(isinstance(m, Heartbeat) for m in sent) == 10
    assert sum(isinstance(m, Setpoint) for m in sent) == pytest.approx(100, abs=1)


def test_late_ticks_do_not_slow_the_heartbeat() -> None:
    subject, vehicle = core(), Vehicle()
    beats = 0
    for k in range(600):
        t = Instant(instant(k / 10) + (k * 7919 % 13) * 1_000_000)  # up to 12 ms late
        data = vehicle.position(k / 10) + vehicle.heartbeat()
        outgoing = subject.step(Tick(t, (frame(t, data),))).outgoing
        beats += sum(isinstance(message, Heartbeat) for message in outgoing)
    assert beats == 60


def test_after_a_pause_the_heartbeat_does_not_catch_up() -> None:
    subject, vehicle = core(), Vehicle()
    beats = []
    for t in map(instant, (0.0, 10.0, 10.5, 11.0, 11.1)):
        outgoing = subject.step(Tick(t, (frame(t, vehicle.heartbeat()),))).outgoing
        beats.append(any(isinstance(message, Heartbeat) for message in outgoing))
    assert beats == [True, True, False, True, False]


def test_what_closes_the_guard_is_the_first_reason_given() -> None:
    """A person sees the first few: why nothing moves comes before what is known of the ships."""
    subject, vehicle = core(vehicle={"cruise_depth_m": 0.0}), Vehicle()
    sail(subject, 5.0)
    t = instant(4000.0)
    decision = subject.step(Tick(t, (frame(t, vehicle.position(4000.0)),)))
    assert decision.status is Status.CLOSED
    assert decision.reasons[0].code == "guard.heartbeat_lost"
    assert any(not reason.code.startswith("guard.") for reason in decision.reasons)


@pytest.mark.parametrize("what", ["heartbeat", "position", "mode", "disarmed"])
def test_when_something_is_lost_setpoints_stop_at_once_or_at_their_limit(what: str) -> None:
    subject, vehicle = core(vehicle={"listen_s": 1.0}), Vehicle()
    assert sail(subject, 5.0)[-1].setpoint is not None
    given = []
    for k in range(60):
        t_s = 5.0 + k / 10
        data = b"" if what == "position" else vehicle.position(t_s)
        if what != "heartbeat" and k % 10 == 0:
            mode = 19 if what == "mode" else 4
            data += vehicle.heartbeat(mode, armed=what != "disarmed")
        decision = subject.step(Tick(instant(t_s), (frame(instant(t_s), data),)))
        given.append(decision.setpoint is not None)
    limit = {"heartbeat": 21, "position": 10, "mode": 0, "disarmed": 0}[what]
    assert given == [True] * limit + [False] * (60 - limit)
    assert decision.status is Status.CLOSED
    assert decision.reasons


def test_an_empty_sea_is_not_a_clear_one() -> None:
    subject, vehicle = core(vehicle={"listen_s": 1.0}), Vehicle()
    for k in range(100):
        data = vehicle.position(k / 10) + vehicle.heartbeat()
        decision = subject.step(Tick(instant(k / 10), (frame(instant(k / 10), data),)))
        assert decision.setpoint is None
    assert "guard.no_report" in {reason.code for reason in decision.reasons}


def test_a_goal_five_thousand_kilometres_away_is_refused_with_a_reason() -> None:
    decisions = sail(core(goal={"latitude_deg": 20.0, "longitude_deg": 24.7}), 3.0)
    assert all(d.setpoint is None for d in decisions)
    assert "plan.goal_too_far" in {reason.code for reason in decisions[-1].reasons}


def test_a_goal_inside_a_ships_set_is_not_entered() -> None:
    """The ship lies at the goal: the vehicle keeps away from it, and does not arrive."""
    subject, vehicle = core(vehicle={"listen_s": 0.5}), Vehicle()
    north, closest = 0.0, math.inf
    for k in range(9000):
        t_s = k / 10
        data = vehicle.position(t_s, north_m=north, depth_m=0.0 if k < 20 else 45.0)
        if k % 10 == 0:
            moored = {"velocity": 0, "navigational_status": 5}
            data += vehicle.heartbeat() + vehicle.ship(230_000_001, 1114.0, 0.0, **moored)
        decision = subject.step(Tick(instant(t_s), (frame(instant(t_s), data),)))
        if decision.setpoint is not None:
            north += decision.setpoint.velocity_ned_mps[0] / 10
        if decision.repulsion is not None:
            closest = min(closest, float(decision.repulsion.nearest.distance_m.min()))
    assert decision.phase in (Phase.CROSS, Phase.RISE, Phase.LISTEN)
    assert closest > 5.0


def test_streams_are_asked_for_and_reasons_told_to_the_ground() -> None:
    decisions = sail(core(), 8.0)
    sent = [message for d in decisions for message in d.outgoing]
    assert {int(m.params[0]) for m in sent if isinstance(m, Command)} >= {33}
    texts = [m.text for m in sent if isinstance(m, StatusText)]
    reasons = {reason.text for d in decisions for reason in d.reasons}
    assert texts
    assert set(texts) <= reasons  # whole, not cut in the middle of what it says


def records(ticks: list[Tick]) -> list[bytes]:
    """Every decision as the log would hold it."""
    subject, recorder = build(config(vehicle={"listen_s": 2.0})).core, DecisionRecorder()
    return [encode(recorder.record(subject.step(tick))) for tick in ticks]


def noisy_ticks(seed: int, count: int) -> Iterator[Tick]:
    """A healthy vehicle whose links carry garbage beside the truth."""
    rng, vehicle = random.Random(seed), Vehicle()
    for k in range(count):
        t = instant(k / 10)
        good = (
            vehicle.position(k / 10)
            + vehicle.heartbeat()
            + vehicle.ship(230_000_001 + k % 9, 900.0, 50.0 * k)
        )
        bad = bytearray(good)
        for _ in range(rng.randrange(1, 4)):
            bad[rng.randrange(len(bad))] = rng.randrange(256)
        junk = rng.randbytes(rng.randrange(60))
        can = Frame(t, Link.CAN, rng.randbytes(rng.randrange(9)), rng.randrange(1 << 29))
        ais = Frame(t, Link.CAN, rng.randbytes(8), 0x11F80E00 | rng.randrange(256))
        yield Tick(t, (frame(t, junk), frame(t, bytes(bad)), can, ais, frame(t, good)))


def test_the_same_ticks_give_the_same_decisions_bit_for_bit() -> None:
    ticks = list(noisy_ticks(1, 80))
    assert records(ticks) == records(ticks)


def test_noise_on_both_links_neither_raises_nor_stops_the_vehicle() -> None:
    subject = core(vehicle={"listen_s": 1.0})
    decisions = [subject.step(tick) for tick in noisy_ticks(2, 400)]
    assert decisions[-1].setpoint is not None
    counts = next(d.counts for d in reversed(decisions) if d.counts)
    assert counts["mavlink.bad_crc"] > 0


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(list(Link)), st.binary(max_size=300), st.integers(0, 2**29 - 1)),
        max_size=20,
    )
)
def test_any_bytes_at_all_are_survived(chunks: list[tuple[Link, bytes, int]]) -> None:
    subject = core()
    for k, (link, data, can_id) in enumerate(chunks):
        part = data[:8] if link is Link.CAN else data
        decision = subject.step(Tick(instant(k / 10), (Frame(instant(k / 10), link, part, can_id),)))
        assert decision.setpoint is None


@pytest.mark.parametrize("jump_s", [-1_200_000.0, -1.0, 0.0, 3600.0])
def test_a_clock_that_jumps_is_survived_and_never_an_old_report_made_new(jump_s: float) -> None:
    subject = core(vehicle={"listen_s": 1.0})
    before = sail(subject, 5.0)[-1]
    after_jump = sail(subject, 5.0, from_s=5.0 + jump_s)[-1]
    assert before.setpoint is not None
    for decision in (before, after_jump):
        ages = decision.tracks.age_s(decision.t)
        assert (ages >= 0).all()
