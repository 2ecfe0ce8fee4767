"""The bundled autopilot, spoken to by pymavlink's own encoder and heard by its own decoder."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import Hull
from sitl.ais import AisPosition, AisStatic
from sitl.autopilot import Autopilot
from sitl.profiles import PROFILES
from sitl.submarine import Submarine
from sitl.vehicle import Limits, VehicleState

FRAME = LocalFrame(60.0, 19.2)
UTC_NS = 1_780_000_000_000_000_000
AT_REST = VehicleState(0.0, 0.0, 0.0, 0.0)


def make(profile: str = "sub", *, armed: bool = True, operator_mode: str | None = None) -> Autopilot:
    return Autopilot(
        PROFILES[profile],
        frame=FRAME,
        home_m=(0.0, 0.0),
        utc_ns_at_zero=UTC_NS,
        boot=instant(-30.0),
        armed=armed,
        operator_mode=operator_mode,
    )


def encode(*messages: mav.MAVLink_message, system: int = 1, component: int = 196) -> bytes:
    link = mav.MAVLink(None, srcSystem=system, srcComponent=component)
    return b"".join(bytes(m.pack(link)) for m in messages)


def decode(data: bytes) -> list[mav.MAVLink_message]:
    return list(mav.MAVLink(None).parse_buffer(data) or [])


def setpoint(
    velocity: tuple[float, float, float] = (1.0, 2.0, 0.25),
    *,
    mask: int = 0x0DC7,
    frame: int = 1,
    system: int = 1,
    component: int = 1,
) -> bytes:
    nan = math.nan  # in ignored fields NaN is harmless
    return encode(
        mav.MAVLink_set_position_target_local_ned_message(
            0, system, component, frame, mask, nan, nan, nan, *velocity, nan, nan, nan, nan, nan
        )
    )


def command(number: int, *params: float) -> bytes:
    filled = (*params, *([0.0] * (7 - len(params))))
    return encode(mav.MAVLink_command_long_message(1, 1, number, 0, *filled))


def flown(autopilot: Autopilot, t: Instant) -> tuple[float, float, float] | None:
    demand = autopilot.demand(t)
    return None if demand is None else demand.velocity_ned_mps


def test_a_velocity_setpoint_in_guided_is_flown() -> None:
    autopilot = make()
    autopilot.receive(instant(1.0), setpoint())
    assert flown(autopilot, instant(1.1)) == (1.0, 2.0, 0.25)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (setpoint(mask=0x0DE7), "setpoint.mask"),
        (setpoint(mask=0x09C7), "setpoint.mask"),
        (setpoint(mask=0x0DC0), "setpoint.mask"),
        (setpoint(mask=0), "setpoint.mask"),
        (setpoint(frame=12), "setpoint.frame"),
        (setpoint(frame=0), "setpoint.frame"),
        (setpoint((math.nan, 0.0, 0.0)), "setpoint.nan"),
        (setpoint((0.0, 0.0, math.inf)), "setpoint.nan"),
        (setpoint(system=2), "mavlink.not_for_us"),
        (setpoint(system=0), "mavlink.not_for_us"),
        (setpoint(component=191), "mavlink.not_for_us"),
    ],
)
def test_a_sub_drops_what_a_real_one_drops_silently_and_counts_it(data: bytes, reason: str) -> None:
    autopilot = make()
    autopilot.receive(instant(1.0), data)
    assert flown(autopilot, instant(1.1)) == (0.0, 0.0, 0.0)
    assert autopilot.counts == {reason: 1}
    said = {m.get_type() for m in decode(autopilot.step(instant(1.1), AT_REST))}
    assert "STATUSTEXT" not in said


def test_setpoints_do_nothing_outside_guided_or_while_disarmed() -> None:
    manual = make(operator_mode="MANUAL")
    manual.receive(instant(1.0), setpoint())
    assert flown(manual, instant(1.1)) == (0.0, 0.0, 0.0)
    assert manual.counts["setpoint.mode"] == 1
    disarmed = make(armed=False)
    disarmed.receive(instant(1.0), setpoint())
    assert disarmed.demand(instant(1.1)) is None
    assert disarmed.counts["setpoint.disarmed"] == 1


@pytest.mark.parametrize(("profile", "timeout_s"), [("sub", 3.0), ("boat", 3.0)])
def test_the_velocity_is_zeroed_3_s_after_the_last_setpoint(profile: str, timeout_s: float) -> None:
    autopilot = make(profile)
    autopilot.receive(instant(1.0), setpoint())
    assert flown(autopilot, instant(1.0 + timeout_s)) == (1.0, 2.0, 0.25)
    assert flown(autopilot, instant(1.01 + timeout_s)) == (0.0, 0.0, 0.0)
    assert autopilot.counts["setpoint.timeout"] == 1
    texts = [m for m in decode(autopilot.step(instant(4.1), AT_REST)) if m.get_type() == "STATUSTEXT"]
    assert len(texts) == (1 if profile == "boat" else 0)


def test_a_boat_takes_horizontal_velocity_alone_and_complains_about_other_masks() -> None:
    boat = make("boat")
    boat.receive(instant(1.0), setpoint(mask=0x0DE7))
    assert flown(boat, instant(1.1)) == (1.0, 2.0, 0.0)
    boat.receive(instant(1.2), setpoint(mask=0x0C07))
    (text,) = [m for m in decode(boat.step(instant(1.2), AT_REST)) if m.get_type() == "STATUSTEXT"]
    assert "ACC_IGNORE" in text.text


def test_px4_enters_offboard_only_on_a_stream_and_leaves_it_1_s_after_the_stream_stops() -> None:
    px4 = make("px4")
    assert px4.mode.name == "MANUAL"
    offboard = command(mav.MAV_CMD_DO_SET_MODE, 1.0, 6.0, 0.0)
    manual = make("px4", operator_mode="MANUAL")
    manual.receive(instant(0.5), offboard)
    (ack,) = [m for m in decode(manual.step(instant(0.5), AT_REST)) if m.get_type() == "COMMAND_ACK"]
    assert ack.result == mav.MAV_RESULT_DENIED
    for k in range(12):  # the operator of `px4` is waiting for the stream
        px4.receive(instant(1.0 + 0.1 * k), setpoint())
    assert px4.mode.name == "OFFBOARD"
    assert flown(px4, instant(2.2)) == (1.0, 2.0, 0.25)
    assert flown(px4, instant(3.2)) == (0.0, 0.0, 0.0)
    assert px4.mode.name == "AUTO.LOITER"
    px4.receive(instant(3.3), setpoint())
    px4.receive(instant(3.4), offboard)  # one setpoint is no stream
    assert px4.mode.name == "AUTO.LOITER"


@pytest.mark.parametrize(("profile", "kind", "number"), [("sub", 12, 4), ("boat", 11, 15)])
def test_the_heartbeat_names_vehicle_mode_and_arming(profile: str, kind: int, number: int) -> None:
    beat = next(m for m in decode(make(profile).step(instant(0.0), AT_REST)) if m.get_type() == "HEARTBEAT")
    assert (beat.type, beat.autopilot, beat.custom_mode) == (kind, 3, number)
    assert beat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, 1)


def test_default_streams_have_their_rates_and_ais_is_not_among_them() -> None:
    autopilot = make()
    autopilot.hear(instant(0.0), report(230_000_001))
    seen: dict[str, int] = {}
    for k in range(100):
        for message in decode(autopilot.step(instant(0.1 * k), AT_REST)):
            seen[message.get_type()] = seen.get(message.get_type(), 0) + 1
    fast = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE")
    assert seen == {"HEARTBEAT": 10, "SYSTEM_TIME": 10, **dict.fromkeys(fast, 100)}


def test_boot_time_and_utc_advance_together() -> None:
    autopilot = make()
    first = next(m for m in decode(autopilot.step(instant(0.0), AT_REST)) if m.get_type() == "SYSTEM_TIME")
    later = next(m for m in decode(autopilot.step(instant(7.0), AT_REST)) if m.get_type() == "SYSTEM_TIME")
    assert first.time_unix_usec == UTC_NS // 1000
    assert first.time_boot_ms == 30_000
    assert later.time_unix_usec - first.time_unix_usec == 7_000_000
    assert later.time_boot_ms - first.time_boot_ms == 7_000


def report(mmsi: int, latitude: float = 60.01) -> AisPosition:
    return AisPosition(mmsi, latitude, 19.21, 30, math.pi, 4.99, math.pi)


def ask_for_ais(autopilot: Autopilot, t: Instant) -> None:
    autopilot.receive(t, command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 301.0, 1e6))
    (ack,) = [m for m in decode(autopilot.step(t, AT_REST)) if m.get_type() == "COMMAND_ACK"]
    assert (ack.command, ack.result, ack.target_component) == (511, mav.MAV_RESULT_ACCEPTED, 196)


def ais_of(autopilot: Autopilot, t: Instant) -> list[mav.MAVLink_message]:
    return [m for m in decode(autopilot.step(t, AT_REST)) if m.get_type() == "AIS_VESSEL"]


def test_ais_vessel_comes_one_vessel_an_interval_again_after_30_s_older_each_time_until_600_s() -> None:
    autopilot = make()
    ask_for_ais(autopilot, instant(0.0))
    for mmsi in (230_000_001, 230_000_002):
        autopilot.hear(instant(0.5), report(mmsi))
    log = [(k, m.MMSI, m.tslc) for k in range(1, 700) for m in ais_of(autopilot, instant(float(k)))]
    assert [row[:2] for row in log[:4]] == [
        (1, 230_000_001), (2, 230_000_002), (31, 230_000_001), (32, 230_000_002)
    ]  # fmt: skip
    assert all(tslc == int(k - 0.5) for k, _, tslc in log)
    assert max(k for k, _, _ in log) <= 601


def test_ais_vessel_carries_the_report_and_the_hull_once_it_is_known() -> None:
    autopilot = make()
    ask_for_ais(autopilot, instant(0.0))
    autopilot.hear(instant(0.5), report(230_000_001))
    (bare,) = ais_of(autopilot, instant(1.0))
    assert (bare.lat, bare.lon, bare.COG, bare.velocity) == (600_100_000, 192_100_000, 18_000, 499)
    assert not bare.flags & mav.AIS_FLAGS_VALID_DIMENSIONS
    assert (bare.dimension_bow, bare.dimension_port) == (65535, 255)
    hull = Hull(55.0, 20.0, 10.0, 15.0)
    autopilot.hear(instant(1.5), AisStatic(230_000_001, "ONE", "SITL", 9_000_000, 70, hull, 8.0))
    assert not ais_of(autopilot, instant(2.0))  # it rides with the next position
    autopilot.hear(instant(2.5), report(230_000_001))
    (full,) = ais_of(autopilot, instant(3.0))
    assert full.tslc == 0
    assert full.flags & mav.AIS_FLAGS_VALID_DIMENSIONS
    dims = (full.dimension_bow, full.dimension_stern, full.dimension_port, full.dimension_starboard)
    assert dims == (55, 20, 10, 15)


def test_static_data_does_not_make_an_old_position_new() -> None:
    autopilot = make()
    autopilot.hear(instant(0.0), report(230_000_001))
    hull = Hull(55.0, 20.0, 10.0, 15.0)
    autopilot.hear(instant(9.0), AisStatic(230_000_001, "ONE", "SITL", 9_000_000, 70, hull, 8.0))
    autopilot.hear(instant(9.9), AisStatic(230_000_002, "TWO", "SITL", 9_000_001, 70, hull, 8.0))
    autopilot.receive(instant(9.9), command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 301.0, 1e5))
    sent = [(k, m.MMSI, m.tslc) for k in range(10, 50) for m in ais_of(autopilot, instant(float(k)))]
    assert sent == [(10, 230_000_001, 10), (40, 230_000_001, 40)]


def test_messages_come_once_on_request_and_unknown_ones_are_refused() -> None:
    autopilot = make()
    autopilot.step(instant(0.0), AT_REST)
    autopilot.receive(instant(0.01), command(mav.MAV_CMD_REQUEST_MESSAGE, 49.0))
    autopilot.receive(instant(0.02), command(mav.MAV_CMD_REQUEST_MESSAGE, 12_345.0))
    autopilot.receive(instant(0.03), command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 30.0, -1.0))
    out = decode(autopilot.step(instant(0.1), VehicleState(40.0, -30.0, 5.0, 0.0)))
    acks = [m.result for m in out if m.get_type() == "COMMAND_ACK"]
    assert acks == [mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_FAILED, mav.MAV_RESULT_ACCEPTED]
    (origin,) = [m for m in out if m.get_type() == "GPS_GLOBAL_ORIGIN"]
    assert (origin.latitude, origin.longitude) == (600_000_000, 192_000_000)
    (local,) = [m for m in out if m.get_type() == "LOCAL_POSITION_NED"]
    assert (local.x, local.y, local.z) == (40.0, -30.0, 5.0)
    assert "ATTITUDE" not in {m.get_type() for m in out}


def test_mode_and_arming_commands_are_obeyed_and_acknowledged() -> None:
    autopilot = make()
    autopilot.receive(instant(1.0), command(mav.MAV_CMD_DO_SET_MODE, 1.0, 9.0))
    assert autopilot.mode.name == "SURFACE"
    assert (flown(autopilot, instant(1.0)) or (0, 0, 0))[2] == -math.inf
    autopilot.receive(instant(1.1), command(mav.MAV_CMD_DO_SET_MODE, 1.0, 77.0))
    autopilot.receive(instant(1.2), command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0.0))
    autopilot.receive(instant(1.3), command(mav.MAV_CMD_NAV_LAND))
    acks = [m.result for m in decode(autopilot.step(instant(1.3), AT_REST)) if m.get_type() == "COMMAND_ACK"]
    assert acks == [
        mav.MAV_RESULT_ACCEPTED,
        mav.MAV_RESULT_DENIED,
        mav.MAV_RESULT_ACCEPTED,
        mav.MAV_RESULT_UNSUPPORTED,
    ]
    assert not autopilot.armed


def test_a_ground_station_gets_its_parameter_list_and_time() -> None:
    autopilot = make()
    autopilot.receive(instant(1.0), encode(mav.MAVLink_param_request_list_message(1, 1), system=255))
    autopilot.receive(instant(1.0), encode(mav.MAVLink_timesync_message(0, 77), system=255))
    out = decode(autopilot.step(instant(1.0), AT_REST))
    values = [m for m in out if m.get_type() == "PARAM_VALUE"]
    assert [m.param_index for m in values] == list(range(values[0].param_count))
    assert "FS_PILOT_INPUT" in {m.param_id for m in values}
    (sync,) = [m for m in out if m.get_type() == "TIMESYNC"]
    assert (sync.tc1, sync.ts1) == (31_000_000_000, 77)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(max_size=80), max_size=6), st.integers(0, 2**32 - 1))
def test_no_bytes_raise_and_a_setpoint_after_them_is_still_heard(chunks: list[bytes], seed: int) -> None:
    autopilot = make()
    for chunk in chunks:
        autopilot.receive(instant(1.0), chunk)
    broken = bytearray(setpoint())
    rng = np.random.default_rng(seed)
    broken[int(rng.integers(len(broken)))] ^= int(rng.integers(1, 256))
    autopilot.receive(instant(1.0), bytes(broken))
    # whatever length the garbage announced, at most 280 bytes of it can swallow what follows
    for _ in range(12):
        autopilot.receive(instant(1.0), setpoint())
    assert flown(autopilot, instant(1.1)) == (1.0, 2.0, 0.25)


def test_speed_turn_rate_and_climb_stay_within_the_hulls_limits() -> None:
    autopilot, limits = make(), Limits()
    hull = Submarine(limits)
    state = hull.start(0.0, 0.0, 0.0, 0.0)
    for k in range(600):
        t = instant(0.1 * k)
        autopilot.receive(t, setpoint((0.0, -90.0, 9.0)))
        before = state
        state = hull.step(state, autopilot.demand(t), 0.1)
        turned = abs((state.heading_rad - before.heading_rad + math.pi) % math.tau - math.pi)
        assert turned <= limits.max_turn_rate_radps * 0.1 * 1.15  # a body has inertia
        assert math.hypot(*state.velocity_ned_mps[:2]) <= limits.max_speed_mps * 1.01
        assert abs(state.velocity_ned_mps[2]) <= limits.max_vertical_speed_mps * 1.2
    assert math.hypot(*state.velocity_ned_mps[:2]) == pytest.approx(2.5, abs=0.02)
    assert state.heading_rad == pytest.approx(-math.pi / 2, abs=1e-3)
