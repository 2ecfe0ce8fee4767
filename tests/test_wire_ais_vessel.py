"""AIS_VESSEL written by pymavlink and read by us: flags, sentinels, quirks of senders, any value."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.instant import elapsed_s, instant
from companion.messages import (
    ContactReport,
    Hull,
    Source,
)
from companion.wire import ais_vessel
from companion.wire.ais_rules import UNSTAMPED_AGE_ERROR_S
from companion.wire.ais_vessel import AisQuirk
from companion.wire.mavlink_frames import MavlinkFrames
from tests.mavlink_talker import (
    Talker,
    decoder,
    hear,
    hear_vessel,
    near,
    vessel,
)


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
