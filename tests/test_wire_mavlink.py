"""MAVLink written by pymavlink and read by us, and the other way round."""

import math
from collections import Counter
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geodesy import LocalFrame
from companion.instant import Instant, elapsed_s, instant
from companion.messages import (
    AutopilotHeartbeat,
    Command,
    CommandAck,
    ContactReport,
    Frame,
    Heard,
    Heartbeat,
    Hull,
    Link,
    Outgoing,
    OwnPosition,
    Setpoint,
    Source,
    Status,
    StatusText,
    UtcTime,
)
from companion.wire import ais_vessel
from companion.wire.ais_rules import UNSTAMPED_AGE_ERROR_S
from companion.wire.ais_vessel import AisQuirk
from companion.wire.mavlink import MavlinkDecoder, MavlinkEncoder
from companion.wire.mavlink_frames import MavlinkFrames

SUB = mav.MAV_TYPE_SUBMARINE
ARDUPILOT = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
PX4 = mav.MAV_AUTOPILOT_PX4
ARMED_CUSTOM = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def near(value: float, tolerance: float | None = None) -> Any:
    return pytest.approx(value, abs=tolerance)


class Talker:
    """Someone on the link, as pymavlink packs it."""

    def __init__(self, system: int = 1, component: int = 1) -> None:
        self._packer = mav.MAVLink(None, srcSystem=system, srcComponent=component)

    def say(self, message: Any, *, v1: bool = False) -> bytes:
        data = bytes(message.pack(self._packer, force_mavlink1=v1))
        self._packer.seq = (self._packer.seq + 1) % 256
        return data


def heartbeat(
    vehicle: int = SUB, autopilot: int = ARDUPILOT, custom_mode: int = 4, base_mode: int = ARMED_CUSTOM
) -> Any:
    return mav.MAVLink_heartbeat_message(vehicle, autopilot, base_mode, custom_mode, mav.MAV_STATE_ACTIVE, 3)


def global_position(**changes: int) -> Any:
    values = {"time_boot_ms": 5000, "lat": 597_200_000, "lon": 247_400_000, "alt": -12_000}
    values |= {"relative_alt": -45_500, "vx": 150, "vy": -20, "vz": 5, "hdg": 9_000}
    return mav.MAVLink_global_position_int_message(**(values | changes))


def vessel(**changes: Any) -> Any:
    values: dict[str, Any] = {"MMSI": 244_123_456, "lat": 597_200_000, "lon": 247_400_000, "COG": 9_000}
    values |= {"heading": 9_200, "velocity": 514, "turn_rate": 20, "navigational_status": 0, "type": 70}
    values |= {"dimension_bow": 100, "dimension_stern": 50, "dimension_port": 10, "dimension_starboard": 15}
    values |= {"callsign": b"PA1234", "name": b"ANNA", "tslc": 7, "flags": 1 | 2 | 4 | 16 | 64 | 2048 | 4096}
    return mav.MAVLink_ais_vessel_message(**(values | changes))


def decoder(quirk: AisQuirk = AisQuirk.STANDARD) -> MavlinkDecoder:
    return MavlinkDecoder(system_id=1, quirk=quirk)


def hear(to: MavlinkDecoder, data: bytes, t_s: float = 0.0) -> list[Heard]:
    return to.decode(Frame(instant(t_s), Link.MAVLINK, data))


def hear_vessel(message: Any, quirk: AisQuirk = AisQuirk.STANDARD, t_s: float = 100.0) -> ContactReport:
    (report,) = hear(decoder(quirk), Talker().say(message), t_s)
    assert isinstance(report, ContactReport)
    return report


def hear_position(to: MavlinkDecoder, message: Any, t_s: float = 0.0) -> OwnPosition | None:
    heard = hear(to, Talker().say(message), t_s)
    assert len(heard) <= 1
    for position in heard:
        assert isinstance(position, OwnPosition)
        return position
    return None


# ---------------------------------------------------------------- heartbeat


@pytest.mark.parametrize(
    ("vehicle", "autopilot", "custom_mode", "expected"),
    [
        (SUB, ARDUPILOT, 4, ("ardupilot", "submarine", "GUIDED", True)),
        (SUB, ARDUPILOT, 19, ("ardupilot", "submarine", "MANUAL", False)),
        (SUB, ARDUPILOT, 15, ("ardupilot", "submarine", "mode 15", False)),
        (mav.MAV_TYPE_SURFACE_BOAT, ARDUPILOT, 15, ("ardupilot", "boat", "GUIDED", True)),
        (mav.MAV_TYPE_SURFACE_BOAT, ARDUPILOT, 4, ("ardupilot", "boat", "HOLD", False)),
        (mav.MAV_TYPE_GROUND_ROVER, ARDUPILOT, 15, ("ardupilot", "rover", "GUIDED", True)),
        (mav.MAV_TYPE_QUADROTOR, ARDUPILOT, 4, ("ardupilot", "other", "GUIDED", True)),
        (mav.MAV_TYPE_QUADROTOR, ARDUPILOT, 15, ("ardupilot", "other", "AUTOTUNE", False)),
        (mav.MAV_TYPE_FIXED_WING, ARDUPILOT, 15, ("ardupilot", "other", "mode 15", False)),
        (mav.MAV_TYPE_GROUND_ROVER, PX4, 6 << 16, ("px4", "rover", "OFFBOARD", True)),
        (mav.MAV_TYPE_SUBMARINE, PX4, 4 << 16 | 3 << 24, ("px4", "submarine", "AUTO.LOITER", False)),
        (mav.MAV_TYPE_SUBMARINE, PX4, 77 << 16, ("px4", "submarine", "mode 77", False)),
        (mav.MAV_TYPE_SUBMARINE, mav.MAV_AUTOPILOT_GENERIC, 4, ("other", "submarine", "mode 4", False)),
        (SUB, ARDUPILOT, 0xFFFFFFFF, ("ardupilot", "submarine", "mode 4294967295", False)),
    ],
)
def test_a_heartbeat_tells_vehicle_mode_and_whether_setpoints_are_taken(
    vehicle: int, autopilot: int, custom_mode: int, expected: tuple[str, str, str, bool]
) -> None:
    data = Talker().say(heartbeat(vehicle, autopilot, custom_mode))
    (heard,) = hear(decoder(), data, 3.0)
    assert isinstance(heard, AutopilotHeartbeat)
    assert (heard.firmware, heard.vehicle, heard.mode, heard.takes_setpoints) == expected
    assert (heard.stamp, heard.system_id, heard.component_id) == (instant(3.0), 1, 1)
    assert heard.armed


def test_a_disarmed_vehicle_says_so_and_a_mode_without_its_flag_is_unknown() -> None:
    (heard,) = hear(decoder(), Talker().say(heartbeat(base_mode=0)))
    assert isinstance(heard, AutopilotHeartbeat)
    assert (heard.armed, heard.mode, heard.takes_setpoints) == (False, "unknown", False)


# ---------------------------------------------------------------- whom to follow


def test_the_first_autopilot_heard_is_followed_and_kept() -> None:
    to = MavlinkDecoder(system_id=0)
    assert to.system_id == 0
    gcs = heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID)
    gimbal = heartbeat(mav.MAV_TYPE_GIMBAL, mav.MAV_AUTOPILOT_INVALID)
    assert hear(to, Talker(255, 190).say(gcs) + Talker(255, 1).say(gcs) + Talker(7, 154).say(gimbal)) == []
    assert hear(to, Talker(7).say(global_position())) == []
    assert to.system_id == 0
    assert len(hear(to, Talker(7).say(heartbeat()))) == 1
    assert to.system_id == 7
    assert hear(to, Talker(8).say(heartbeat()) + Talker(8).say(global_position())) == []
    assert to.system_id == 7
    assert len(hear(to, Talker(7).say(global_position()))) == 1


def test_messages_of_other_systems_and_components_do_not_steer_us() -> None:
    to = decoder()
    for talker in (Talker(2), Talker(1, 2), Talker(1, 191), Talker(1, 196)):
        assert hear(to, talker.say(heartbeat()) + talker.say(global_position())) == []


def test_ais_vessels_may_come_from_a_receiver_of_the_vehicle_but_not_from_us() -> None:
    assert len(hear(decoder(), Talker(1, 156).say(vessel()))) == 1
    to = decoder()
    assert hear(to, Talker(1, 196).say(vessel())) == []
    assert hear(to, Talker(2, 156).say(vessel())) == []
    assert to.counts["mavlink.own_component"] == 1
    assert to.counts["mavlink.other_system"] == 1


# ---------------------------------------------------------------- position


def test_global_position_gives_the_whole_own_position() -> None:
    own = hear_position(decoder(), global_position(), 2.0)
    assert own == OwnPosition(
        stamp=instant(2.0),
        source=Source.MAVLINK,
        latitude_deg=near(59.72),
        longitude_deg=near(24.74),
        depth_m=45.5,
        velocity_ned_mps=(1.5, -0.2, 0.05),
        heading_rad=near(math.pi / 2),
    )


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"lat": 0, "lon": 0}, "mavlink.no_fix"),
        ({"lat": 900_000_001}, "mavlink.position_out_of_range"),
        ({"lon": -1_800_000_001}, "mavlink.position_out_of_range"),
        ({"lat": 2**31 - 1, "lon": 2**31 - 1}, "mavlink.position_out_of_range"),
        ({"relative_alt": -(2**31)}, "mavlink.position_out_of_range"),
    ],
)
def test_a_position_that_is_none_is_dropped_and_counted(changes: dict[str, int], reason: str) -> None:
    to = decoder()
    assert hear_position(to, global_position(**changes)) is None
    assert to.counts[reason] == 1


def attitude(yaw: float) -> Any:
    return mav.MAVLink_attitude_message(0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)


def test_attitude_stands_in_for_a_heading_that_is_not_available() -> None:
    to = decoder()
    bare = hear_position(to, global_position(hdg=65_535))
    assert bare is not None
    assert bare.heading_rad is None
    assert hear_position(to, attitude(-math.pi / 2), 1.0) is None
    own = hear_position(to, global_position(hdg=65_535), 1.5)
    assert own is not None
    assert own.heading_rad == near(1.5 * math.pi)
    hear_position(to, attitude(math.nan), 2.0)
    late = hear_position(to, global_position(hdg=36_001), 2.5)
    assert late is not None
    assert late.heading_rad is None


def origin(**changes: int) -> Any:
    return mav.MAVLink_gps_global_origin_message(
        **({"latitude": 597_200_000, "longitude": 247_400_000, "altitude": 0, "time_usec": 0} | changes)
    )


def local_position(**changes: float) -> Any:
    values = {"x": 300.0, "y": -400.0, "z": 12.5, "vx": 1.0, "vy": -2.0, "vz": 0.25}
    return mav.MAVLink_local_position_ned_message(0, **(values | changes))


def test_a_vehicle_with_local_positions_only_is_placed_by_its_origin() -> None:
    to = decoder()
    assert hear_position(to, local_position()) is None
    assert hear_position(to, origin()) is None
    hear_position(to, attitude(1.0))
    own = hear_position(to, local_position(), 0.5)
    assert own is not None
    north, east = LocalFrame(59.72, 24.74).to_local(own.latitude_deg, own.longitude_deg)
    assert (north, east) == (near(300.0, 0.01), near(-400.0, 0.01))
    assert (own.depth_m, own.velocity_ned_mps) == (12.5, (1.0, -2.0, 0.25))
    assert own.heading_rad == near(1.0)


def test_local_positions_are_not_used_while_global_ones_come() -> None:
    to = decoder()
    hear_position(to, origin())
    assert hear_position(to, global_position(), 10.0) is not None
    assert hear_position(to, local_position(), 10.5) is None
    assert hear_position(to, local_position(), 11.5) is not None


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30])
@pytest.mark.parametrize("name", ["x", "y", "z", "vx", "vz"])
def test_a_local_position_that_is_not_finite_is_dropped(name: str, value: float) -> None:
    to = decoder()
    hear_position(to, origin())
    own = hear_position(to, local_position(**{name: value}))
    if name.startswith("v") and math.isfinite(value):
        return
    assert own is None
    assert to.counts["mavlink.position_out_of_range"] == 1


def test_an_origin_that_is_none_places_nothing() -> None:
    to = decoder()
    for nowhere in ({"latitude": 0, "longitude": 0}, {"latitude": 2**31 - 1}):
        hear_position(to, origin(**nowhere))
        assert hear_position(to, local_position()) is None


# ---------------------------------------------------------------- time and answers


def test_system_time_is_utc_unless_it_was_never_set() -> None:
    to = decoder()
    (said,) = hear(to, Talker().say(mav.MAVLink_system_time_message(1_669_809_600_000_123, 77)), 4.0)
    assert said == UtcTime(instant(4.0), Source.MAVLINK, 1_669_809_600_000_123_000)
    for unset_us in (0, 77_000_000, 315_964_800_000_000, 2**64 - 1):
        assert hear(to, Talker().say(mav.MAVLink_system_time_message(unset_us, 77))) == []
    assert to.counts["mavlink.no_utc"] == 4


@pytest.mark.parametrize(
    ("target", "is_ours"),
    [((0, 0), True), ((1, 196), True), ((1, 0), True), ((255, 190), False), ((1, 191), False)],
)
def test_an_answer_to_somebody_else_is_not_ours(target: tuple[int, int], is_ours: bool) -> None:
    ack = mav.MAVLink_command_ack_message(511, 4, 0, 0, *target)
    heard = hear(decoder(), Talker().say(ack), 1.0)
    assert heard == ([CommandAck(instant(1.0), 511, 4)] if is_ours else [])


def test_a_status_text_is_counted() -> None:
    to = decoder()
    assert hear(to, Talker().say(mav.MAVLink_statustext_message(4, b"EKF primary changed"))) == []
    assert to.counts["mavlink.statustext"] == 1


# ---------------------------------------------------------------- AIS_VESSEL


def test_a_full_vessel_is_read_field_by_field() -> None:
    report = hear_vessel(vessel(), t_s=100.0)
    assert report == ContactReport(
        mmsi=244_123_456,
        source=Source.AIS_VESSEL,
        received_at=instant(100.0),
        measured_at=instant(93.0),
        age_error_s=UNSTAMPED_AGE_ERROR_S,
        latitude_deg=near(59.72),
        longitude_deg=near(24.74),
        accurate=True,
        cog_rad=near(math.pi / 2),
        sog_mps=near(5.14),
        heading_rad=near(math.radians(92.0)),
        turn_rate_radps=near(math.radians(2.0)),
        navigational_status=0,
        hull=Hull(100.0, 50.0, 10.0, 15.0),
        ship_type=70,
        name="ANNA",
    )


@pytest.mark.parametrize(
    ("flag", "field"),
    [(2, "cog_rad"), (4, "sog_mps"), (16, "turn_rate_radps"), (64, "hull"), (4096, "name")],
)
def test_a_field_whose_flag_is_clear_is_not_available(flag: int, field: str) -> None:
    full = 1 | 2 | 4 | 16 | 64 | 2048 | 4096
    assert getattr(hear_vessel(vessel(flags=full)), field) is not None
    assert getattr(hear_vessel(vessel(flags=full & ~flag)), field) is None


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"COG": 65_535}, "cog_rad"),
        ({"COG": 36_000}, "cog_rad"),
        ({"velocity": 65_535}, "sog_mps"),
        ({"velocity": 5_263}, "sog_mps"),  # 102.3 knots
        ({"heading": 65_535}, "heading_rad"),
        ({"heading": 51_100}, "heading_rad"),  # 511 degrees
        ({"heading": 36_000}, "heading_rad"),
        ({"turn_rate": 127}, "turn_rate_radps"),
        ({"turn_rate": -128}, "turn_rate_radps"),
        ({"turn_rate": 1, "flags": 16 | 32}, "turn_rate_radps"),  # the sign only
        ({"dimension_bow": 65_535}, "hull"),
        ({"dimension_starboard": 255}, "hull"),
        ({"navigational_status": 15}, "navigational_status"),
        ({"navigational_status": 200}, "navigational_status"),
        ({"type": 0}, "ship_type"),
        ({"name": b""}, "name"),
        ({"lat": 2**31 - 1}, "latitude_deg"),
        ({"lat": 910_000_000, "lon": 1_810_000_000}, "longitude_deg"),
        ({"lat": 0, "lon": 0}, "latitude_deg"),
    ],
)
def test_not_available_never_becomes_a_number(changes: dict[str, Any], field: str) -> None:
    assert getattr(hear_vessel(vessel()), field) is not None
    assert getattr(hear_vessel(vessel(**changes)), field) is None


def test_clear_flags_win_over_the_zeros_that_old_senders_send() -> None:
    zeros = {"COG": 0, "velocity": 0, "heading": 0, "turn_rate": 0}
    report = hear_vessel(vessel(flags=0, **zeros), AisQuirk.ARDUPILOT_2025)
    assert (report.cog_rad, report.sog_mps, report.heading_rad, report.turn_rate_radps) == (None,) * 4


@pytest.mark.parametrize(
    ("cog", "flags", "is_known"), [(100, 2, True), (35_900, 2, True), (18_000, 2, False), (100, 0, False)]
)
def test_a_heading_of_zero_needs_a_course_that_agrees(cog: int, flags: int, is_known: bool) -> None:
    report = hear_vessel(vessel(heading=0, COG=cog, flags=flags))
    assert report.heading_rad == (0.0 if is_known else None)


def test_a_stopped_ship_has_speed_zero() -> None:
    assert hear_vessel(vessel(velocity=0)).sog_mps == 0.0


@pytest.mark.parametrize(
    ("flags", "sizes", "hull"),
    [
        (64 | 128, (511, 20, 10, 15), Hull(511.0, 20.0, 10.0, 15.0)),
        (64 | 128 | 256, (0, 0, 10, 15), Hull(511.0, 511.0, 10.0, 15.0)),
        (64 | 512, (100, 20, 63, 5), Hull(100.0, 20.0, 63.0, 5.0)),
        (64 | 1024, (100, 20, 5, 0), Hull(100.0, 20.0, 5.0, 63.0)),
        (64, (0, 150, 0, 25), Hull(150.0, 150.0, 25.0, 25.0)),  # antenna unknown: anywhere
        (64, (0, 0, 0, 0), None),
        (64, (100, 50, 0, 0), None),
    ],
)
def test_hulls_hold_the_largest_ship_that_the_flags_allow(
    flags: int, sizes: tuple[int, int, int, int], hull: Hull | None
) -> None:
    names = ("dimension_bow", "dimension_stern", "dimension_port", "dimension_starboard")
    assert hear_vessel(vessel(flags=flags, **dict(zip(names, sizes, strict=True)))).hull == hull


@pytest.mark.parametrize("mmsi", [2**30, 2**32 - 1])
def test_an_impossible_mmsi_is_dropped_and_counted(mmsi: int) -> None:
    to = decoder()
    assert hear(to, Talker().say(vessel(MMSI=mmsi))) == []
    assert to.counts["ais_vessel.bad_mmsi"] == 1


def test_the_early_sender_says_tenths_of_knots_and_loses_the_turn() -> None:
    report = hear_vessel(vessel(velocity=100), AisQuirk.ARDUPILOT_EARLY)
    assert report.sog_mps == near(10 * 1852 / 3600)
    assert report.turn_rate_radps is None
    assert hear_vessel(vessel(velocity=1023), AisQuirk.ARDUPILOT_EARLY).sog_mps is None


def test_the_sender_of_2025_says_the_turn_in_hundredths_of_degrees() -> None:
    report = hear_vessel(vessel(turn_rate=-120), AisQuirk.ARDUPILOT_2025)
    assert report.turn_rate_radps == near(math.radians(-1.2))


def test_an_age_of_many_minutes_reaches_before_the_clocks_zero() -> None:
    report = hear_vessel(vessel(tslc=65_535), t_s=10.0)
    assert elapsed_s(report.measured_at, report.received_at) == 65_535


# ---------------------------------------------------------------- framing


STREAM = [heartbeat(), global_position(), vessel(), mav.MAVLink_system_time_message(1_669_809_600_000_000, 1)]


def stream(times: int = 1) -> list[bytes]:
    talker = Talker()
    return [talker.say(message) for _ in range(times) for message in STREAM]


def kinds(heard: list[Heard]) -> Counter[str]:
    return Counter(type(message).__name__ for message in heard)


@given(st.data())
def test_a_stream_may_be_cut_anywhere(data: st.DataObject) -> None:
    whole = b"".join(stream())
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=8)))
    to = decoder()
    heard: list[Heard] = []
    for k, (start, end) in enumerate(zip([0, *cuts], [*cuts, len(whole)], strict=True)):
        heard += hear(to, whole[start:end], 0.01 * k)
    assert len(heard) == len(STREAM)
    assert to.counts == {"mavlink.packets": len(STREAM)}


def test_mavlink_1_is_read_too() -> None:
    talker = Talker()
    data = b"".join(talker.say(message, v1=True) for message in (heartbeat(), global_position()))
    assert kinds(hear(decoder(), data)) == {"AutopilotHeartbeat": 1, "OwnPosition": 1}


def test_signed_packets_are_read_without_checking_the_signature() -> None:
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    packer.signing.secret_key = bytes(32)
    packer.signing.sign_outgoing = True
    data = b"".join(bytes(message.pack(packer)) for message in (heartbeat(), global_position()))
    assert kinds(hear(decoder(), data)) == {"AutopilotHeartbeat": 1, "OwnPosition": 1}


def test_a_newer_definitions_extra_bytes_are_left() -> None:
    packet = bytearray(Talker().say(global_position()))
    packet[1] += 3
    packet[-2:] = b"\1\2\3"
    crc = mav.x25crc(packet[1:])
    crc.accumulate(bytes((mav.MAVLink_global_position_int_message.crc_extra,)))
    assert len(hear(decoder(), bytes(packet) + crc.crc.to_bytes(2, "little"))) == 1


@pytest.mark.parametrize("flaw", range(39))
def test_one_damaged_byte_costs_one_message_and_no_other(flaw: int) -> None:
    before, damaged, *after = [Talker().say(global_position()) for _ in range(12)]
    broken = bytearray(damaged)
    broken[flaw] ^= 0x40
    to = decoder()
    heard = hear(to, before + bytes(broken) + b"".join(after))
    heard += hear(to, Talker().say(heartbeat()), 1.0)  # a length too large ends here
    # a damaged system or component id would still need its checksum
    assert kinds(heard)["OwnPosition"] == 11


def test_noise_between_packets_is_skipped_and_counted() -> None:
    to = decoder()
    first, *others = stream()
    noise = bytes(range(200))
    heard = hear(to, noise + first + noise + b"".join(others) + noise)
    assert len(heard) == len(STREAM)
    assert to.counts["mavlink.skipped_bytes"] == 600


def test_a_packet_we_do_not_know_is_stepped_over() -> None:
    unknown = bytes((0xFD, 4, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0xEE, 1, 2, 3, 4, 0, 0))
    first, *others = stream()
    to = decoder()
    assert len(hear(to, first + unknown + b"".join(others))) == len(STREAM)
    assert to.counts["mavlink.unknown"] == 1


def test_the_rest_of_a_cut_packet_does_not_swallow_the_good_ones_behind_it() -> None:
    """Three bytes of a header and what follows make an unknown message that ends where the data ends."""
    first, second = Talker().say(heartbeat()), Talker().say(heartbeat())
    cut = bytes((0xFD, 3 + len(first + second) - 12, 0))
    to = decoder()
    assert len(hear(to, cut + first + second)) == 2
    assert to.counts["mavlink.unknown"] == 0


def test_a_packet_that_never_ends_does_not_hold_up_the_next_ones() -> None:
    to = decoder()
    hear(to, b"\xfd\xff\0" + bytes(20), 0.0)
    assert len(hear(to, Talker().say(heartbeat()), 1.0)) == 1
    assert to.counts["mavlink.stalled"] == 1


@given(st.lists(st.binary(max_size=400), max_size=20))
def test_random_bytes_never_raise_and_are_not_hoarded(chunks: list[bytes]) -> None:
    to = decoder()
    for k, chunk in enumerate(chunks):
        assert hear(to, chunk, 0.1 * k) == []
        assert len(to._frames._rest) < 300
    hear(to, bytes(300), 100.0)
    assert len(hear(to, b"".join(stream()), 200.0)) == len(STREAM)


@given(st.integers(0, 2**32), st.sampled_from(["flip", "cut", "insert", "swap"]))
def test_a_damaged_stream_never_raises_and_loses_little(seed: int, damage: str) -> None:
    random = Random(seed)
    packets = stream(10)
    damaged = set(random.sample(range(len(packets)), 5))
    data = [spoil(packet, random, damage) if k in damaged else packet for k, packet in enumerate(packets)]
    to = decoder()
    heard: list[Heard] = []
    for k, packet in enumerate(data):
        heard += hear(to, packet, 0.01 * k)
    heard += hear(to, b"".join(stream()), 10.0)  # whatever was held back comes out
    assert len(heard) >= len(packets) - 5 + len(STREAM)


def spoil(packet: bytes, random: Random, damage: str) -> bytes:
    spoilt = bytearray(packet)
    at = random.randrange(len(packet))
    if damage == "flip":
        spoilt[at] ^= 1 << random.randrange(8)
    elif damage == "cut":
        del spoilt[at:]
    elif damage == "insert":
        spoilt[at:at] = random.randbytes(3)
    else:
        spoilt[at:] = spoilt[at:][::-1]
    return bytes(spoilt)


FIELD_RANGES = st.fixed_dictionaries(
    {
        "MMSI": st.integers(0, 2**32 - 1),
        "lat": st.integers(-(2**31), 2**31 - 1),
        "lon": st.integers(-(2**31), 2**31 - 1),
        "COG": st.integers(0, 65_535),
        "heading": st.integers(0, 65_535),
        "velocity": st.integers(0, 65_535),
        "turn_rate": st.integers(-128, 127),
        "navigational_status": st.integers(0, 255),
        "type": st.integers(0, 255),
        "dimension_bow": st.integers(0, 65_535),
        "dimension_stern": st.integers(0, 65_535),
        "dimension_port": st.integers(0, 255),
        "dimension_starboard": st.integers(0, 255),
        "name": st.binary(max_size=20),
        "tslc": st.integers(0, 65_535),
        "flags": st.integers(0, 65_535),
    }
)


@given(FIELD_RANGES, st.sampled_from(list(AisQuirk)))
def test_whatever_a_vessel_says_stays_in_its_range(values: dict[str, Any], quirk: AisQuirk) -> None:
    for report in hear(decoder(quirk), Talker().say(vessel(**values))):
        assert isinstance(report, ContactReport)
        assert 0 <= report.mmsi < 2**30
        assert (report.latitude_deg is None) == (report.longitude_deg is None)
        for value, low, high in (
            (report.latitude_deg, -90, 90),
            (report.longitude_deg, -180, 180),
            (report.cog_rad, 0, math.tau),
            (report.heading_rad, 0, math.tau),
            (report.sog_mps, 0, 52.61),
            (report.turn_rate_radps, -0.21, 0.21),
        ):
            assert value is None or low <= value <= high
        assert report.name is None or (report.name.isascii() and report.name.isprintable())


@given(
    st.builds(
        vessel,
        MMSI=st.integers(0, 2**32 - 1),
        lat=st.integers(-(2**31), 2**31 - 1),
        lon=st.integers(-(2**31), 2**31 - 1),
        COG=st.integers(0, 65_535),
        heading=st.integers(0, 65_535),
        velocity=st.integers(0, 65_535),
        turn_rate=st.integers(-128, 127),
        navigational_status=st.integers(0, 255),
        type=st.integers(0, 255),
        dimension_bow=st.integers(0, 65_535),
        dimension_port=st.integers(0, 255),
        tslc=st.integers(0, 65_535),
        flags=st.integers(0, 65_535),
        name=st.binary(max_size=20),
    )
)
def test_the_vessel_s_layout_is_the_dialect_s(message: Any) -> None:
    """Unpacked by us and, with all that is cut off and filled up, by pymavlink's own parser."""
    data = Talker().say(message)
    (reference,) = mav.MAVLink(None).parse_buffer(data) or []
    assert ais_vessel.LAYOUT.format == reference.unpacker.format
    (packet,) = MavlinkFrames().push(instant(0.0), data)
    whole = packet.payload.ljust(ais_vessel.LAYOUT.size, b"\0")
    names = reference.ordered_fieldnames
    ours = dict(zip(names, ais_vessel.LAYOUT.unpack(whole), strict=True))
    for name in names:
        raw = getattr(reference, f"_{name}_raw", None)
        if raw is None:
            assert ours[name] == getattr(reference, name), name
        else:
            assert ours[name].rstrip(b"\0") == raw.rstrip(b"\0"), name


@given(st.lists(st.sampled_from([0, 1, 2, 3]), min_size=1, max_size=6), st.booleans())
def test_a_datagram_of_one_packet_is_read_as_in_a_stream(kinds: list[int], v1: bool) -> None:
    """The short cut for a whole packet and the search find the same messages, and as many as pymavlink."""
    talker, makers = Talker(), (heartbeat, global_position, vessel, local_position)
    packets = [talker.say(makers[kind](), v1=v1 and kind != 2) for kind in kinds]
    single, stream = decoder(), decoder()
    one_by_one = [each for data in packets for each in hear(single, data)]
    assert one_by_one == hear(stream, b"".join(packets))
    assert single.counts == stream.counts
    assert single.counts["mavlink.packets"] == len(mav.MAVLink(None).parse_buffer(b"".join(packets)) or [])


# ---------------------------------------------------------------- encoding


def parsed(message: Outgoing, system_id: int = 7) -> Any:
    """What pymavlink's own parser makes of our bytes."""
    data = MavlinkEncoder(system_id=system_id, component_id=196).encode(message)
    assert data[0] == 0xFD
    (found,) = mav.MAVLink(None).parse_buffer(data) or []
    assert (found.get_srcSystem(), found.get_srcComponent()) == (system_id, 196)
    return found


def setpoint(*velocity: float, stamp_ns: int = 12_345_600_000) -> Setpoint:
    north, east, down = velocity
    return Setpoint(Instant(stamp_ns), Instant(stamp_ns + 500_000_000), (north, east, down))


def test_a_setpoint_is_a_local_ned_velocity_and_nothing_else() -> None:
    found = parsed(setpoint(1.5, -2.25, 0.5))
    assert found.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    assert (found.target_system, found.target_component) == (7, 1)
    assert (found.coordinate_frame, found.type_mask) == (1, 0x0DC7)
    assert (found.vx, found.vy, found.vz) == (1.5, -2.25, 0.5)
    assert found.time_boot_ms == 12_345
    ignored = (found.x, found.y, found.z, found.afx, found.afy, found.afz, found.yaw, found.yaw_rate)
    assert ignored == (0.0,) * 8


def test_the_time_of_a_setpoint_wraps_as_the_autopilots_do() -> None:
    assert parsed(setpoint(0.0, 0.0, 0.0, stamp_ns=2**32 * 1_000_000 + 5_000_000)).time_boot_ms == 5


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("axis", range(3))
def test_a_velocity_that_is_not_finite_is_refused(bad: float, axis: int) -> None:
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = bad
    with pytest.raises(ValueError, match="velocity"):
        parsed(setpoint(*velocity))


def test_a_command_goes_to_the_autopilot() -> None:
    found = parsed(Command(511, (301.0, 100_000.0, 0.0, 0.0, 0.0, 0.0, 2.0)))
    assert found.get_type() == "COMMAND_LONG"
    assert (found.target_system, found.target_component, found.confirmation) == (7, 1, 0)
    assert (found.command, found.param1, found.param2, found.param7) == (511, 301.0, 100_000.0, 2.0)
    with pytest.raises(ValueError, match="511"):
        parsed(Command(511, (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize(("status", "state"), [(Status.OK, 4), (Status.DEGRADED, 5), (Status.CLOSED, 3)])
def test_our_heartbeat_is_an_onboard_controllers(status: Status, state: int) -> None:
    found = parsed(Heartbeat(status))
    assert (found.type, found.autopilot, found.base_mode, found.custom_mode) == (18, 8, 0, 0)
    assert found.system_status == state


def test_a_status_text_that_fits_is_one_packet_complete_in_itself() -> None:
    found = parsed(StatusText(4, "ö" + "x" * 49))
    assert (found.severity, found.text, found.id, found.chunk_seq) == (4, "?" + "x" * 49, 0, 0)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=51, max_size=300))
def test_a_longer_status_text_comes_whole_out_of_its_chunks(text: str) -> None:
    """As the definition says: one id, numbered from 0, ended by a chunk that is not full."""
    encoder = MavlinkEncoder(system_id=7, component_id=196)
    encoder.encode(StatusText(4, "y" * 60))
    found = mav.MAVLink(None).parse_buffer(encoder.encode(StatusText(4, text))) or []
    assert {piece.id for piece in found} == {2}
    assert [piece.chunk_seq for piece in found] == list(range(len(found)))
    assert [len(piece.text) for piece in found[:-1]] == [50] * (len(found) - 1)
    assert len(found[-1].text) < 50
    assert "".join(piece.text for piece in found) == text[:200]


def test_the_system_id_can_be_set_when_it_becomes_known_and_packets_are_numbered() -> None:
    encoder = MavlinkEncoder(system_id=0, component_id=196)
    encoder.system_id = 42
    parser = mav.MAVLink(None)
    for k in range(300):
        (found,) = parser.parse_buffer(encoder.encode(setpoint(0.0, 0.0, 0.0))) or []
        assert (found.get_srcSystem(), found.target_system, found.get_seq()) == (42, 42, k % 256)


def test_our_own_decoder_does_not_take_our_own_packets() -> None:
    encoder = MavlinkEncoder(system_id=1, component_id=196)
    to = decoder()
    assert hear(to, encoder.encode(Heartbeat(Status.OK))) == []
    assert to.counts["mavlink.own_component"] == 1
