"""MAVLink written by pymavlink and read by us: whom to follow, heartbeats, positions, time."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geodesy import LocalFrame
from companion.instant import instant
from companion.messages import (
    AutopilotHeartbeat,
    CommandAck,
    OwnPosition,
    Source,
    UtcTime,
)
from companion.wire.mavlink import MavlinkDecoder
from tests.mavlink_talker import (
    ARDUPILOT,
    PX4,
    SUB,
    Talker,
    attitude,
    decoder,
    global_position,
    hear,
    hear_position,
    heartbeat,
    local_position,
    near,
    origin,
    vessel,
)

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
