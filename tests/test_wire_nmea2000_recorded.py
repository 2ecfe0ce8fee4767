"""Recorded buses through our decoder and through the `nmea2000` library, field by field."""

import math
import struct
from collections import Counter
from typing import Any

import pytest

from companion.instant import NS_PER_S, elapsed_s
from companion.messages import (
    ContactReport,
    OwnPosition,
    TargetKind,
    UtcTime,
)
from companion.utc import UtcClock
from companion.wire import n2k_ais
from companion.wire.ais_rules import UNSTAMPED_AGE_ERROR_S
from companion.wire.fast_packet import FastPackets
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.bus_messages import (
    AIS_PGNS,
    Recording,
    gnss_time,
    hear,
    library,
    near,
    sides,
)


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
