"""Single NMEA 2000 messages: what they say, what they leave out, their time, our own position."""

import math
import struct

import pytest
from nmea2000 import backend

from companion.instant import NS_PER_S, elapsed_s, instant
from companion.messages import (
    OwnPosition,
    Source,
    TargetKind,
    UtcTime,
)
from companion.utc import UtcClock
from companion.wire import n2k_ais
from companion.wire.ais_rules import UNSTAMPED_AGE_ERROR_S
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.bus_messages import (
    CLASS_A,
    DAYS,
    NOON,
    TIME,
    class_a,
    clock_at,
    gnss_time,
    hear,
    hear_contact,
    sides,
)

# ---------------------------------------------------------------- single messages


def test_the_known_class_a_vector_decodes_to_its_known_values() -> None:
    report = hear_contact(129038, CLASS_A)
    assert report.mmsi == 246_210_000
    assert report.source is Source.NMEA2000
    assert report.kind is TargetKind.CLASS_A
    assert report.latitude_deg == pytest.approx(53.3111666, abs=1e-9)
    assert report.longitude_deg == pytest.approx(5.07735, abs=1e-9)
    assert report.cog_rad == pytest.approx(4.7254)
    assert report.sog_mps == pytest.approx(2.77)
    assert report.heading_rad == pytest.approx(4.7289)
    assert report.turn_rate_radps == pytest.approx(-0.001625)
    assert report.navigational_status == 0
    assert report.accurate


def static(pgn_id: str, **fields: object) -> bytes:
    names = {"messageId": 24, "repeatIndicator": 0, "userId": 244_123_456}
    return bytes(backend.DATABASE.encode(pgn_id, {**names, **fields}))


def test_msc_fortunate_gets_her_275_by_40_metres_and_her_antenna() -> None:
    payload = static(
        "aisClassAStaticAndVoyageRelatedData",
        name="MSC FORTUNATE",
        typeOfShip=74,
        length=275.0,
        beam=40.0,
        positionReferenceFromStarboard=23.0,
        positionReferenceFromBow=181.0,
    )
    report = hear_contact(129794, payload)
    assert sides(report) == pytest.approx((181.0, 94.0, 17.0, 23.0))
    assert (report.name, report.ship_type) == ("MSC FORTUNATE", 74)
    assert report.latitude_deg is None


def test_a_class_b_extended_report_has_position_size_and_name() -> None:
    payload = static(
        "aisClassBExtendedPositionReport",
        longitude=24.5,
        latitude=59.5,
        timeStamp=60,
        cog=1.5,
        sog=3.0,
        trueHeading=1.4,
        typeOfShip=36,
        length=12.0,
        beam=4.0,
        positionReferenceFromStarboard=1.0,
        positionReferenceFromBow=5.0,
        name="WINDROSE",
    )
    report = hear_contact(129040, payload)
    assert report.latitude_deg == pytest.approx(59.5)
    assert report.longitude_deg == pytest.approx(24.5)
    assert report.cog_rad == pytest.approx(1.5)
    assert report.sog_mps == pytest.approx(3.0)
    assert report.heading_rad == pytest.approx(1.4)
    assert sides(report) == pytest.approx((5.0, 7.0, 3.0, 1.0))
    assert (report.name, report.ship_type, report.kind) == ("WINDROSE", 36, TargetKind.CLASS_B)


@pytest.mark.parametrize("length", [26, 27, 28])
def test_class_a_is_read_in_every_length_that_is_in_use(length: int) -> None:
    assert hear_contact(129038, CLASS_A[:length]) == hear_contact(129038, CLASS_A)


def test_a_message_that_ends_before_its_fields_is_dropped_and_counted() -> None:
    for pgn, layout in n2k_ais.LAYOUTS.items():
        decoder = Nmea2000Decoder(UtcClock())
        assert hear(decoder, pgn, CLASS_A[:5] + bytes(layout.shortest - 6)) == []
        assert decoder.counts["n2k.short_message"] == 1
        assert len(hear(decoder, pgn, CLASS_A[:5] + bytes(layout.shortest - 5))) == 1


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"cog": 0xFFFF}, "cog_rad"),
        ({"cog": 0xFFFE}, "cog_rad"),
        ({"cog": 62_832}, "cog_rad"),  # 360 degrees
        ({"sog": 0xFFFF}, "sog_mps"),
        ({"sog": 0xFFFE}, "sog_mps"),
        ({"sog": 5263}, "sog_mps"),  # 102.3 knots
        ({"heading": 0xFFFF}, "heading_rad"),
        ({"heading": 0xFFFE}, "heading_rad"),
        ({"turn": 0x7FFF}, "turn_rate_radps"),
        ({"turn": 0x7FFE}, "turn_rate_radps"),
        ({"turn": -0x8000}, "turn_rate_radps"),
        ({"turn": 1187}, "turn_rate_radps"),  # 127 of AIS, "no sensor", as degrees a minute
        ({"turn": -1178}, "turn_rate_radps"),
        ({"status": 15}, "navigational_status"),
        ({"lat": 0x7FFFFFFF}, "latitude_deg"),
        ({"lon": 0x7FFFFFFF}, "latitude_deg"),
        ({"lat": 0x7FFFFFFE}, "latitude_deg"),
        ({"lat": 910_000_000}, "latitude_deg"),
        ({"lon": 1_810_000_000}, "longitude_deg"),
        ({"lat": -900_000_001}, "longitude_deg"),
    ],
)
def test_what_is_not_available_is_none(changes: dict[str, int], field: str) -> None:
    assert getattr(hear_contact(129038, CLASS_A), field) is not None
    assert getattr(hear_contact(129038, class_a(**changes)), field) is None


def test_the_fastest_speed_there_is_stays() -> None:
    assert hear_contact(129038, class_a(sog=5258)).sog_mps == pytest.approx(52.58)


def test_latitude_and_longitude_go_together() -> None:
    report = hear_contact(129038, class_a(lat=910_000_000))
    assert (report.latitude_deg, report.longitude_deg) == (None, None)


@pytest.mark.parametrize("mmsi", [2**30, 0xFFFFFFFF])
def test_an_impossible_mmsi_is_dropped_and_counted(mmsi: int) -> None:
    decoder = Nmea2000Decoder(UtcClock())
    assert hear(decoder, 129038, class_a(mmsi=mmsi)) == []
    assert decoder.counts["n2k.bad_mmsi"] == 1


def test_an_eight_digit_mmsi_as_recorded_is_kept() -> None:
    assert hear_contact(129038, class_a(mmsi=27_653_800)).mmsi == 27_653_800


@pytest.mark.parametrize("second", [61, 62, 63])
def test_a_position_that_was_not_measured_is_not_accurate(second: int) -> None:
    assert hear_contact(129038, class_a(flags=second << 2 | 1)).accurate is False


@pytest.mark.parametrize(
    ("length", "beam", "starboard", "bow", "expected"),
    [
        (1000, 200, 50, 300, (30.0, 70.0, 15.0, 5.0)),
        (1000, 200, 0xFFFF, 0xFFFF, (100.0, 100.0, 20.0, 20.0)),  # antenna unknown
        (1000, 200, 200, 0, (100.0, 100.0, 20.0, 20.0)),  # both zero in AIS: unknown
        (1000, 200, 50, 1001, (100.0, 100.0, 20.0, 20.0)),  # antenna ahead of the bow
        (1000, 0xFFFF, 50, 300, None),
        (0xFFFF, 200, 50, 300, None),
        (0xFFFE, 200, 50, 300, None),
        (0, 0, 0, 0, None),
        (1000, 0, 0, 0, None),
    ],
)
def test_hulls_are_never_smaller_than_what_was_said(
    length: int, beam: int, starboard: int, bow: int, expected: tuple[float, ...] | None
) -> None:
    sizes = struct.pack("<HHHH", length, beam, starboard, bow)
    payload = CLASS_A[:5] + bytes(15) + sizes + bytes(6)
    report = hear_contact(129810, payload)
    if expected is None:
        assert report.hull is None
    else:
        assert sides(report) == pytest.approx(expected)


def test_the_craft_of_a_mother_ship_has_no_size_of_its_own() -> None:
    payload = (
        struct.pack("<BI", 24, 982_441_234) + bytes(15) + struct.pack("<HHHH", 120, 40, 10, 50) + bytes(6)
    )
    assert hear_contact(129810, payload).hull is None


@pytest.mark.parametrize(
    ("raw", "name"),
    [
        (b"ANNA@@@@@@@@@@@@@@@@", "ANNA"),
        (b"ANNA                ", "ANNA"),
        (b"ANNA\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", "ANNA"),
        (b"ANNA".ljust(20, b"\xff"), "ANNA"),
        (b"AN\x1b[31mNA".ljust(20), "AN[31mNA"),
        (b"@" * 20, None),
        (b"\xff" * 20, None),
        (b" " * 20, None),
    ],
)
def test_names_lose_their_padding(raw: bytes, name: str | None) -> None:
    assert hear_contact(129809, CLASS_A[:5] + raw).name == name


# ---------------------------------------------------------------- time


@pytest.mark.parametrize(
    ("utc_second", "stamp", "age_s", "error_s"),
    [
        (30.25, 30, 0.25, n2k_ais.AGE_ERROR_S),
        (30.25, 27, 3.25, n2k_ais.AGE_ERROR_S),
        (1.5, 59, 2.5, n2k_ais.AGE_ERROR_S),  # over the minute
        (30.25, 31, 0.0, n2k_ais.AGE_ERROR_S),  # our UTC is a little late
        (59.0, 0, 0.0, n2k_ais.AGE_ERROR_S),
        (30.0, 10, 20.0, 20.0),  # doubtful: anything from 0 on
        (30.0, 48, 42.0, 42.0),  # a transponder on GPS time
        (30.0, 60, 0.0, UNSTAMPED_AGE_ERROR_S),
        (30.0, 62, 0.0, UNSTAMPED_AGE_ERROR_S),
    ],
)
def test_the_age_runs_from_the_time_stamp(
    utc_second: float, stamp: int, age_s: float, error_s: float
) -> None:
    report = hear_contact(129038, class_a(flags=stamp << 2), clock_at(utc_second), 1000.0)
    assert report.received_at == instant(1000.0)
    assert elapsed_s(report.measured_at, report.received_at) == pytest.approx(age_s)
    assert report.age_error_s == pytest.approx(error_s)


def test_without_utc_a_stamp_says_nothing() -> None:
    report = hear_contact(129038, class_a(flags=17 << 2), t_s=50.0)
    assert report.measured_at == report.received_at
    assert report.age_error_s == UNSTAMPED_AGE_ERROR_S


@pytest.mark.parametrize(
    ("pgn", "payload"),
    [
        (126992, struct.pack("<BBHI", 0, 0xF0, DAYS, TIME)),
        (129033, struct.pack("<HIh", DAYS, TIME, 60)),
        (129029, gnss_time()),
    ],
)
def test_each_statement_of_utc_is_understood(pgn: int, payload: bytes) -> None:
    said, *_ = hear(Nmea2000Decoder(UtcClock()), pgn, payload, 7.0)
    assert said == UtcTime(instant(7.0), Source.NMEA2000, NOON * NS_PER_S + 500_000)


@pytest.mark.parametrize(
    ("pgn", "payload"),
    [
        (126992, struct.pack("<BBHI", 0, 0xF5, DAYS, TIME)),  # a crystal
        (126992, struct.pack("<BBHI", 0, 0xF0, 0xFFFF, TIME)),
        (126992, struct.pack("<BBHI", 0, 0xF0, DAYS, 0xFFFFFFFF)),
        (126992, struct.pack("<BBHI", 0, 0xF0, 0, TIME)),  # 1970: never set
        (126992, struct.pack("<BBHI", 0, 0xF0, DAYS, TIME)[:7]),
        (129033, struct.pack("<HI", 0xFFFF, TIME)),
        (129029, gnss_time(method=0)),
        (129029, gnss_time(days=0xFFFF)),
    ],
)
def test_a_clock_that_does_not_know_says_nothing(pgn: int, payload: bytes) -> None:
    decoder = Nmea2000Decoder(UtcClock())
    assert not any(isinstance(heard, UtcTime) for heard in hear(decoder, pgn, payload))
    assert decoder.counts["n2k.no_utc"] == 1


# ---------------------------------------------------------------- own position


def test_course_and_heading_join_the_position_while_they_are_fresh() -> None:
    decoder = Nmea2000Decoder(UtcClock())
    here = struct.pack("<ii", 597_000_000, 247_000_000)
    (bare,) = hear(decoder, 129025, here, 0.0)
    assert isinstance(bare, OwnPosition)
    assert (bare.velocity_ned_mps, bare.heading_rad, bare.depth_m) == (None, None, None)
    hear(decoder, 129026, struct.pack("<BBHHH", 0, 0xFC, 31_416, 250, 0xFFFF), 1.0)
    hear(decoder, 127250, struct.pack("<BHhhB", 0, 30_000, 0x7FFF, 0x7FFF, 0xFC), 1.0)
    (full,) = hear(decoder, 129025, here, 2.0)
    assert isinstance(full, OwnPosition)
    assert full.velocity_ned_mps == pytest.approx((-2.5, 0.0, 0.0), abs=1e-4)
    assert full.heading_rad == pytest.approx(3.0)
    (other,) = hear(decoder, 129025, here, 2.0, talker=44)
    assert isinstance(other, OwnPosition)
    assert other.velocity_ned_mps is None  # that receiver said no course
    (stale,) = hear(decoder, 129025, here, 3.5)
    assert isinstance(stale, OwnPosition)
    assert (stale.velocity_ned_mps, stale.heading_rad) == (None, None)


@pytest.mark.parametrize(
    ("reference", "deviation", "variation", "expected"),
    [
        (0, 0x7FFF, 0x7FFF, 6.2),
        (1, 0x7FFF, 1000, 6.3 % (2 * math.pi)),
        (1, -2000, 1000, 6.1),
        (1, 0, 0x7FFF, None),  # magnetic, and nobody says the variation
        (2, 0, 0, None),
    ],
)
def test_a_magnetic_heading_counts_only_with_its_variation(
    reference: int, deviation: int, variation: int, expected: float | None
) -> None:
    decoder = Nmea2000Decoder(UtcClock())
    hear(decoder, 127250, struct.pack("<BHhhB", 0, 62_000, deviation, variation, 0xFC | reference))
    (own,) = hear(decoder, 129025, struct.pack("<ii", 10, 10))
    assert isinstance(own, OwnPosition)
    assert own.heading_rad == (None if expected is None else pytest.approx(expected))


def test_a_magnetic_course_is_no_velocity() -> None:
    decoder = Nmea2000Decoder(UtcClock())
    hear(decoder, 129026, struct.pack("<BBHHH", 0, 0xFD, 100, 250, 0xFFFF))
    (own,) = hear(decoder, 129025, struct.pack("<ii", 10, 10))
    assert isinstance(own, OwnPosition)
    assert own.velocity_ned_mps is None


def test_an_own_position_off_the_globe_is_dropped_and_counted() -> None:
    decoder = Nmea2000Decoder(UtcClock())
    assert hear(decoder, 129025, struct.pack("<ii", 0x7FFFFFFF, 0x7FFFFFFF)) == []
    assert hear(decoder, 129025, struct.pack("<ii", 910_000_000, 0)) == []
    assert decoder.counts["n2k.no_position"] == 2
