"""What we send, parsed by pymavlink."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.instant import Instant
from companion.messages import (
    Command,
    Heartbeat,
    Outgoing,
    Setpoint,
    Status,
    StatusText,
)
from companion.wire.mavlink import MavlinkEncoder
from tests.mavlink_talker import (
    decoder,
    hear,
)


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
