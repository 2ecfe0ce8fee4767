from dataclasses import replace

import pytest

from companion.config import Autopilot
from companion.instant import instant
from companion.messages import OwnPosition, Source
from companion.own import Ownship
from tests.builders import heartbeat

LAT, LON = 59.7, 24.7
METRE_DEG = 1 / 111_400  # of latitude, near enough here


def position(at_s: float, north_m: float = 0.0, **fields: object) -> OwnPosition:
    values: dict[str, object] = {
        "stamp": instant(at_s),
        "source": Source.MAVLINK,
        "latitude_deg": LAT + north_m * METRE_DEG,
        "longitude_deg": LON,
        "depth_m": 3.0,
        "velocity_ned_mps": (1.0, 0.0, 0.0),
        "heading_rad": 0.5,
    }
    return OwnPosition(**{**values, **fields})  # type: ignore[arg-type]


def test_the_first_position_is_the_origin_for_good() -> None:
    own = Ownship(Autopilot())
    own.observe_position(position(0))
    frame = own.frame
    own.observe_position(position(10, north_m=20))
    assert own.frame is frame
    state = own.state()
    assert state is not None
    assert state.north_m == pytest.approx(20, abs=0.1)


@pytest.mark.parametrize(
    "said", [replace(position(0), depth_m=None), replace(position(0), velocity_ned_mps=None)]
)
def test_a_position_without_depth_or_velocity_does_not_steer(said: OwnPosition) -> None:
    own = Ownship(Autopilot())
    own.observe_position(said)
    assert own.state() is None


def test_a_heading_once_known_is_kept_and_an_older_position_is_not_taken() -> None:
    own = Ownship(Autopilot())
    own.observe_position(position(5, heading_rad=1.0))
    own.observe_position(position(6, heading_rad=None))
    own.observe_position(position(4, north_m=500))
    state = own.state()
    assert state is not None
    assert (state.heading_rad, state.stamp) == (1.0, instant(6))


def test_a_jump_is_told_for_a_while_and_ordinary_motion_is_not() -> None:
    own = Ownship(Autopilot())
    for t in range(10):
        own.observe_position(position(t, north_m=2.5 * t))
    assert own.doubts(instant(9)) == []
    own.observe_position(position(10, north_m=300))
    assert [reason.code for reason in own.doubts(instant(11))] == ["own.position_jumped"]
    assert own.doubts(instant(16)) == []
    assert own.jumps == 1


@pytest.mark.parametrize(
    ("at_s", "fields", "ready"),
    [
        (0.5, {}, True),
        (1.5, {}, False),  # position is old
        (0.5, {"armed": False}, False),
        (0.5, {"takes_setpoints": False}, False),
    ],
)
def test_ready_means_fresh_armed_and_in_the_right_mode(
    at_s: float, fields: dict[str, object], ready: bool
) -> None:
    own = Ownship(Autopilot())
    assert not own.is_ready(instant(0))
    own.observe_position(position(0))
    own.observe_heartbeat(heartbeat(0, **fields))
    assert own.is_ready(instant(at_s)) is ready
