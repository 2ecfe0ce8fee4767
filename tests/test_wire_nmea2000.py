"""Recorded buses through our decoder and through the `nmea2000` library, field by field."""

import math
import struct
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nmea2000 import _canboat, backend

from companion.edges.files import read_candump
from companion.instant import NS_PER_S, Instant, elapsed_s, instant
from companion.messages import (
    ContactReport,
    Frame,
    Heard,
    Link,
    OwnPosition,
    Source,
    TargetKind,
    UtcTime,
)
from companion.utc import UtcClock
from companion.wire import n2k_ais
from companion.wire.ais_rules import UNSTAMPED_AGE_ERROR_S
from companion.wire.fast_packet import FastPackets
from companion.wire.nmea2000 import Nmea2000Decoder

GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
IJSSELMEER = "n2k_ijsselmeer_20221130_native.candump.gz"
AIS_PGNS = (129038, 129039, 129040, 129794, 129809, 129810)
OTHER_PGNS = (129025, 129026, 127250, 129029)
NOON = 1_669_809_600  # 2022-11-30T12:00:00Z
CLASS_A = bytes.fromhex("03d0ddac0efcbd060372a3c61ff196b81501e04104b9b8ccffc0f8ff")


@dataclass(frozen=True)
class Recording:
    """A log, what we made of it, and the payloads an independent reassembler found."""

    frames: list[Frame]
    heard: list[Heard]
    counts: Counter[str]
    steps: int
    payloads: list[tuple[int, int, bytes]]  # PGN, talker, payload

    @property
    def contacts(self) -> list[ContactReport]:
        return [heard for heard in self.heard if isinstance(heard, ContactReport)]

    def of(self, *pgns: int) -> list[bytes]:
        return [payload for pgn, _, payload in self.payloads if pgn in pgns]


def recording(path: Path) -> Recording:
    frames = [Frame(Instant(f.unix_ns), Link.CAN, f.data, f.can_id) for f in read_candump(path)]
    utc = UtcClock()
    decoder = Nmea2000Decoder(utc)
    heard = []
    for frame in frames:
        for message in decoder.decode(frame):
            heard.append(message)
            if isinstance(message, UtcTime):
                utc.observe(message)
    reassembler = _canboat.Reassembler()
    payloads = []
    for frame in frames:
        pgn, talker = frame.can_id >> 8 & 0x3FFFF, frame.can_id & 0xFF
        if pgn in (*AIS_PGNS, 129029):
            payload = reassembler.push(pgn, frame.data, talker, 255, frame.can_id >> 26)
            if payload is not None:
                payloads.append((pgn, talker, bytes(payload)))
        elif pgn in OTHER_PGNS:
            payloads.append((pgn, talker, frame.data))
    return Recording(frames, heard, decoder.counts, utc.steps, payloads)


@pytest.fixture(scope="module")
def gulf(shared_data: Path) -> Recording:
    return recording(shared_data / GULF)


@pytest.fixture(scope="module")
def ijsselmeer(shared_data: Path) -> Recording:
    return recording(shared_data / IJSSELMEER)


def library(pgn: int, payload: bytes) -> dict[str, Any]:
    message = backend.decode(pgn, payload, 0, 255, 4)
    return {
        field.id: (field.raw_value if field.type.name == "LOOKUP" else field.value)
        for field in message.fields
    }


def packets(pgn: int, payload: bytes, sequence: int = 0, talker: int = 43) -> list[tuple[int, bytes]]:
    """CAN frames of one message, by the library."""
    can_id = _canboat.can_id_compose(4, pgn, talker, 255)
    return [(can_id, bytes(data)) for data in _canboat.fast_packet_fragment(sequence, payload)]


def hear(
    decoder: Nmea2000Decoder, pgn: int, payload: bytes, t_s: float = 0.0, talker: int = 43
) -> list[Heard]:
    frames = packets(pgn, payload, talker=talker) if len(payload) > 8 else [(pgn << 8 | talker, payload)]
    return [h for can_id, data in frames for h in decoder.decode(Frame(instant(t_s), Link.CAN, data, can_id))]


def hear_contact(pgn: int, payload: bytes, utc: UtcClock | None = None, t_s: float = 0.0) -> ContactReport:
    (report,) = hear(Nmea2000Decoder(utc or UtcClock()), pgn, payload, t_s)
    assert isinstance(report, ContactReport)
    return report


def class_a(**changes: int) -> bytes:
    """The test vector with some raw fields changed."""
    layout = {"mmsi": (1, "<I"), "lon": (5, "<i"), "lat": (9, "<i"), "flags": (13, "<B"), "cog": (14, "<H")}
    layout |= {"sog": (16, "<H"), "heading": (21, "<H"), "turn": (23, "<h"), "status": (25, "<B")}
    payload = bytearray(CLASS_A)
    for name, raw in changes.items():
        at, code = layout[name]
        struct.pack_into(code, payload, at, raw)
    return bytes(payload)


def near(ours: float | None, theirs: float | None) -> bool:
    if ours is None or theirs is None:
        return ours is None and theirs is None
    return math.isclose(ours, theirs, rel_tol=1e-12, abs_tol=1e-12)


# ---------------------------------------------------------------- recorded buses


def test_the_gulf_log_gives_the_counts_of_independent_decoders(gulf: Recording) -> None:
    by_pgn = Counter(pgn for pgn, _, _ in gulf.payloads)
    expected = {129038: 1981, 129039: 886, 129794: 186, 129809: 19, 129810: 22, 129025: 597}
    assert expected.items() <= by_pgn.items()
    kinds = Counter((report.kind, report.latitude_deg is not None) for report in gulf.contacts)
    assert kinds == {
        (TargetKind.CLASS_A, True): 1981,
        (TargetKind.CLASS_B, True): 886,
        (TargetKind.CLASS_A, False): 186,
        (TargetKind.CLASS_B, False): 19 + 22,
    }
    assert sum(isinstance(heard, OwnPosition) for heard in gulf.heard) == 597
    assert sum(isinstance(heard, UtcTime) for heard in gulf.heard) == 3 * 597
    assert set(gulf.counts) == {"n2k.messages"}


def test_the_ijsselmeer_log_gives_the_counts_of_independent_decoders(ijsselmeer: Recording) -> None:
    kinds = Counter(report.kind for report in ijsselmeer.contacts)
    assert kinds == {TargetKind.CLASS_A: 1500 + 43, TargetKind.CLASS_B: 228 + 20 + 18}
    gnss = Counter(talker for pgn, talker, _ in reassembled(ijsselmeer) if pgn == 129029)
    assert gnss.total() == 1052  # as canboatjs says
    without_129025 = sum(gnss[talker] - 1 for talker in (0, 4, 28))  # the first may have been late
    own = sum(isinstance(heard, OwnPosition) for heard in ijsselmeer.heard)
    missing = ijsselmeer.counts["n2k.no_position"]
    assert 4869 + without_129025 <= own + missing <= 4869 + without_129025 + 4


@pytest.mark.parametrize("log", ["gulf", "ijsselmeer"])
def test_every_field_of_every_report_equals_the_librarys(log: str, request: pytest.FixtureRequest) -> None:
    recorded: Recording = request.getfixturevalue(log)
    theirs = [(pgn, library(pgn, payload)) for pgn, _, payload in recorded.payloads if pgn in AIS_PGNS]
    assert len(theirs) == len(recorded.contacts)
    for ours, (pgn, fields) in zip(recorded.contacts, theirs, strict=True):
        assert ours.mmsi == fields["userId"]
        if pgn in (129038, 129039, 129040):
            assert_position_equals(ours, pgn, fields)
        if pgn in (129794, 129040, 129810):
            assert_size_equals(ours, fields)
        if pgn in (129794, 129809):
            assert (ours.name or "") == (fields["name"] or "").strip()


def assert_position_equals(ours: ContactReport, pgn: int, fields: dict[str, Any]) -> None:
    assert near(ours.latitude_deg, fields["latitude"])
    assert near(ours.longitude_deg, fields["longitude"])
    assert near(ours.cog_rad, fields["cog"])
    assert near(ours.sog_mps, fields["sog"])
    assert near(ours.heading_rad, fields["heading"])
    assert ours.accurate == (fields["positionAccuracy"] == 1 and fields["timeStamp"] <= 60)
    if pgn == 129038:
        turn = fields["rateOfTurn"]  # 126.6 and 127.5 degrees a minute: AIS's words for "no sensor"
        told = turn is None or not 126 < abs(math.degrees(turn)) * 60 < 128
        assert near(ours.turn_rate_radps, turn if told else None)
        status = fields["navStatus"]
        assert ours.navigational_status == (None if status == 15 else status)


def assert_size_equals(ours: ContactReport, fields: dict[str, Any]) -> None:
    length, beam = fields["length"], fields["beam"]
    if ours.hull is None:
        assert not length or not beam
        return
    bow, starboard = fields["positionReferenceFromBow"], fields["positionReferenceFromStarboard"]
    if bow == 0 and starboard == beam:  # the antenna may be anywhere
        bow, starboard, length, beam = length, beam, 2 * length, 2 * beam
    assert sides(ours) == pytest.approx((bow, length - bow, beam - starboard, starboard), abs=1e-9)


def reassembled(recorded: Recording) -> list[tuple[int, int, bytes]]:
    packets = FastPackets()
    found = []
    for frame in recorded.frames:
        pgn = frame.can_id >> 8 & 0x3FFFF
        if pgn in (*AIS_PGNS, 129029):
            payload = packets.push(frame.stamp, frame.can_id, frame.data)
            if payload is not None:
                found.append((pgn, frame.can_id & 0xFF, payload))
    return found


def test_our_reassembly_finds_the_payloads_the_library_finds(ijsselmeer: Recording, gulf: Recording) -> None:
    for recorded in (gulf, ijsselmeer):
        ours = [entry for entry in reassembled(recorded) if entry[0] in AIS_PGNS]
        assert ours == [entry for entry in recorded.payloads if entry[0] in AIS_PGNS]


def test_own_positions_equal_the_librarys(ijsselmeer: Recording) -> None:
    positions = [library(129025, payload) for payload in ijsselmeer.of(129025)]
    theirs = [(p["latitude"], p["longitude"]) for p in positions if p["latitude"] is not None]
    decoder = Nmea2000Decoder(UtcClock())
    rapid = [frame for frame in ijsselmeer.frames if frame.can_id >> 8 & 0x3FFFF == 129025]
    heard = [own for frame in rapid for own in decoder.decode(frame) if isinstance(own, OwnPosition)]
    ours = [(own.latitude_deg, own.longitude_deg) for own in heard]
    assert ours == [pytest.approx(position, abs=1e-10) for position in theirs]
    assert len(ours) == 4869 - 192


def test_receivers_that_send_no_rapid_position_are_heard_by_their_gnss_position() -> None:
    payload = bytearray(gnss_time())
    struct.pack_into("<qq", payload, 7, 597_200_000_000_000_000, -247_400_000_000_000_000)
    fields = library(129029, bytes(payload))
    decoder = Nmea2000Decoder(UtcClock())
    assert len(hear(decoder, 129029, bytes(payload), 4.0)) == 1
    _, own = hear(decoder, 129029, bytes(payload), 5.0)
    assert isinstance(own, OwnPosition)
    assert (own.latitude_deg, own.longitude_deg) == (fields["latitude"], fields["longitude"])
    assert own.latitude_deg == pytest.approx(59.72)
    hear(decoder, 129025, struct.pack("<ii", 10, 10), 6.0)
    assert len(hear(decoder, 129029, bytes(payload), 7.0)) == 1
    assert len(hear(decoder, 129029, bytes(payload), 8.5)) == 2
    payload[31] = 0  # no fix
    assert hear(decoder, 129029, bytes(payload), 19.0) == []


def test_the_yacht_of_the_gulf_log_makes_6_7_knots_on_199_degrees(gulf: Recording) -> None:
    own = [heard for heard in gulf.heard if isinstance(heard, OwnPosition)][10:]
    speeds, courses, headings = [], [], []
    for position in own:
        assert position.velocity_ned_mps is not None
        assert position.heading_rad is not None
        north, east, down = position.velocity_ned_mps
        assert down == 0
        speeds.append(math.hypot(north, east))
        courses.append(math.degrees(math.atan2(east, north)) % 360)
        headings.append(math.degrees(position.heading_rad))
    assert sorted(speeds)[300] == pytest.approx(6.7 * 1852 / 3600, rel=0.1)
    assert sorted(courses)[300] == pytest.approx(199, abs=12)
    assert sorted(headings)[300] == pytest.approx(199, abs=5)


def test_ages_on_the_recorded_buses_are_seconds_and_doubtful_ones_say_so(
    gulf: Recording, ijsselmeer: Recording
) -> None:
    sound = []
    for report in (*gulf.contacts, *ijsselmeer.contacts):
        if report.latitude_deg is None:
            continue
        age_s = elapsed_s(report.measured_at, report.received_at)
        assert 0 <= age_s <= 57
        if report.age_error_s == n2k_ais.AGE_ERROR_S:
            sound.append(age_s)
        else:  # no stamp, or a clock that is off: the interval reaches the arrival
            assert report.age_error_s >= max(age_s, UNSTAMPED_AGE_ERROR_S)
    assert len(sound) > 0.9 * (2867 + 1704)
    assert sorted(sound)[int(0.99 * len(sound))] < 4.0


def test_the_echo_of_the_own_transponder_is_less_than_two_seconds_old(gulf: Recording) -> None:
    ages = [elapsed_s(r.measured_at, r.received_at) for r in gulf.contacts if r.mmsi == 230_035_780]
    assert len(ages) > 500
    assert max(ages) < n2k_ais.AGE_ERROR_S


def test_utc_of_both_buses_is_known_and_never_steps(gulf: Recording, ijsselmeer: Recording) -> None:
    for recorded in (gulf, ijsselmeer):
        said = [heard for heard in recorded.heard if isinstance(heard, UtcTime)]
        assert all(abs(heard.utc_ns - heard.stamp) < 2 * NS_PER_S for heard in said)
        assert recorded.steps == 0


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


def sides(report: ContactReport) -> tuple[float, float, float, float]:
    """Bow, stern, port, starboard."""
    assert report.hull is not None
    return report.hull.bow_m, report.hull.stern_m, report.hull.port_m, report.hull.starboard_m


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


def clock_at(second: float) -> UtcClock:
    """UTC is `second` past noon at the source's 1000 s."""
    utc = UtcClock()
    utc.observe(UtcTime(instant(1000.0), Source.NMEA2000, NOON * NS_PER_S + round(second * NS_PER_S)))
    return utc


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


DAYS = NOON // 86_400
TIME = 12 * 3600 * 10_000 + 5  # noon and half a millisecond


def gnss_time(days: int = DAYS, time: int = TIME, method: int = 1) -> bytes:
    return struct.pack("<BHI", 0, days, time) + bytes(24) + bytes((method << 4,)) + bytes(11)


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


# ---------------------------------------------------------------- bad input


WANTED_IDS = st.sampled_from([pgn << 8 | 7 for pgn in (*AIS_PGNS, *OTHER_PGNS, 126992, 129033)])


def assert_sane(heard: Heard) -> None:
    if isinstance(heard, ContactReport):
        assert 0 < heard.mmsi <= 999_999_999
        assert heard.measured_at <= heard.received_at
        for value, low, high in (
            (heard.latitude_deg, -90, 90),
            (heard.longitude_deg, -180, 180),
            (heard.cog_rad, 0, 2 * math.pi),
            (heard.heading_rad, 0, 2 * math.pi),
            (heard.sog_mps, 0, 52.6),
            (heard.turn_rate_radps, -0.21, 0.21),
        ):
            assert value is None or low <= value <= high
        if heard.hull is not None:
            assert min(sides(heard)) >= 0
    if isinstance(heard, OwnPosition):
        assert abs(heard.latitude_deg) <= 90
        assert abs(heard.longitude_deg) <= 180


@given(st.lists(st.tuples(WANTED_IDS | st.integers(0, 2**29 - 1), st.binary(max_size=8)), max_size=100))
def test_random_frames_never_raise_and_never_leave_the_ranges(frames: list[tuple[int, bytes]]) -> None:
    decoder = Nmea2000Decoder(UtcClock())
    for k, (can_id, data) in enumerate(frames):
        for heard in decoder.decode(Frame(instant(0.01 * k), Link.CAN, data, can_id)):
            assert_sane(heard)


@given(st.sampled_from(AIS_PGNS), st.binary(min_size=9, max_size=100), st.integers(0, 10**9))
def test_random_payloads_never_raise_and_never_leave_the_ranges(pgn: int, payload: bytes, t_s: int) -> None:
    for heard in hear(Nmea2000Decoder(clock_at(12.0)), pgn, payload, float(t_s)):
        assert_sane(heard)


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.sampled_from(["flip", "cut", "drop", "swap"]))
def test_a_recorded_bus_with_errors_never_raises(gulf: Recording, seed: int, error: str) -> None:
    random = Random(seed)
    start = random.randrange(len(gulf.frames) - 2000)
    decoder = Nmea2000Decoder(UtcClock())
    heard: list[Heard] = []
    frames = [mutated(frame, random, error) for frame in gulf.frames[start : start + 2000]]
    if error == "swap":
        for _ in range(100):
            k = random.randrange(len(frames) - 1)
            frames[k], frames[k + 1] = frames[k + 1], frames[k]
    for frame in frames:
        if error != "drop" or random.random() > 0.05:
            heard += decoder.decode(frame)
    assert heard
    for message in heard:
        assert_sane(message)


def mutated(frame: Frame, random: Random, error: str) -> Frame:
    data = bytearray(frame.data)
    if random.random() < 0.05 and data:
        if error == "flip":
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)
        if error == "cut":
            del data[random.randrange(len(data)) :]
    return Frame(frame.stamp, frame.link, bytes(data), frame.can_id)


def test_other_messages_are_ignored() -> None:
    decoder = Nmea2000Decoder(UtcClock())
    for pgn in (60416, 60160, 59904, 128259, 130306, 129041, 129793):
        assert decoder.decode(Frame(instant(0.0), Link.CAN, bytes(8), pgn << 8 | 7)) == []
    assert not decoder.counts


def test_the_same_frames_give_the_same_messages(gulf: Recording) -> None:
    def run() -> list[Heard]:
        decoder = Nmea2000Decoder(UtcClock())
        return [heard for frame in gulf.frames[:5000] for heard in decoder.decode(frame)]

    assert run() == run()
