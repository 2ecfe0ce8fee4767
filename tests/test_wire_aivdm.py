"""AIVDM and AIVDO sentences: recorded ones against pyais read as a whole, odd and mutated ones."""

import gzip
import math
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyais.encode import encode_dict
from pyais.stream import IterMessages

from companion.edges.sentences import read_sentences
from companion.errors import LogError
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Heard, Link, OwnPosition, Source, TargetKind, UtcTime
from companion.utc import UtcClock
from companion.wire.aivdm import AivdmDecoder

DANISH = "aivdm_danish_network_20100611_27s.nmea.gz"
STATIC = (
    b"!AIVDM,2,1,3,B,55P5TL01VIaAL@7WKO@mBplU@<PDhh000000001S;AJ::4A80?4i@E53,0*3E\r\n"
    b"!AIVDM,2,2,3,B,1@0000000000000,2*55\r\n"
)


def decode(data: bytes, decoder: AivdmDecoder | None = None) -> list[Heard]:
    return (decoder or AivdmDecoder(UtcClock())).decode(Frame(instant(1.0), Link.AIVDM, data))


def sentence(talker: str = "AIVDM", **fields: Any) -> bytes:
    values: dict[str, Any] = {
        "type": 1,
        "mmsi": 230000001,
        "lat": 59.7,
        "lon": 24.7,
        "speed": 10.0,
        "course": 90.0,
        "heading": 91,
        "status": 0,
        "turn": 0,
        "accuracy": 1,
        "second": 60,
    }
    lines = encode_dict({**values, **fields}, talker_id=talker[:2], sentence_type=talker[2:])
    return "".join(f"{line}\r\n" for line in lines).encode()


@pytest.fixture(scope="module")
def lines(shared_data: Path) -> list[bytes]:
    with gzip.open(shared_data / DANISH) as stream:
        return [line for line in stream.read().splitlines() if line.startswith(b"!")]


def test_the_recorded_network_gives_pyais_s_messages_and_no_error(lines: list[bytes]) -> None:
    decoder = AivdmDecoder(UtcClock())
    heard = decode(b"\r\n".join(lines) + b"\r\n", decoder)
    expected: Counter[int] = Counter()
    vessels: set[int] = set()
    total = 0
    for message in IterMessages(lines):
        field: dict[str, Any] = message.decode().asdict()
        total += 1
        if message.type == "VDO":
            continue
        expected[field["msg_type"]] += 1
        if field["msg_type"] in (1, 2, 3, 18, 19) and field["lat"] <= 90:
            vessels.add(int(field["mmsi"]))
    reports = [h for h in heard if isinstance(h, ContactReport)]
    wanted = sum(expected[kind] for kind in (1, 2, 3, 4, 5, 9, 18, 19, 21, 24))
    assert decoder.counts["aivdm.messages"] == total
    assert len(reports) == wanted
    assert not decoder.counts["aivdm.undecodable"] + decoder.counts["aivdm.bad_checksum"]
    placed = {r.mmsi for r in reports if r.latitude_deg is not None and r.kind is not TargetKind.UNKNOWN}
    assert placed == vessels


@given(st.lists(st.integers(0, 900), max_size=8))
@settings(max_examples=30)
def test_a_stream_may_be_cut_anywhere(cuts: list[int]) -> None:
    stream = sentence(lat=10.0) + STATIC + sentence(lat=11.0, mmsi=230000002) + sentence(type=18, lat=12.0)
    decoder, heard = AivdmDecoder(UtcClock()), []
    edges = [0, *sorted(c for c in cuts if c < len(stream)), len(stream)]
    for begin, end in pairwise(edges):
        heard += decode(stream[begin:end], decoder)
    assert heard == decode(stream)
    assert len(heard) == 4


def test_every_field_has_its_unit_and_nothing_is_invented() -> None:
    (full,) = decode(sentence(turn=10, second=60))
    assert isinstance(full, ContactReport)
    assert full.source is Source.AIVDM
    assert full.sog_mps == pytest.approx(5.1444, abs=1e-3)
    assert full.cog_rad == pytest.approx(math.pi / 2)
    assert full.heading_rad == pytest.approx(math.radians(91))
    assert full.turn_rate_radps == pytest.approx(math.radians(10 / 60), rel=0.1)
    assert full.accurate
    (bare,) = decode(sentence(lat=91, lon=181, speed=102.3, course=360, heading=511, turn=-128, status=15))
    assert isinstance(bare, ContactReport)
    said = (bare.latitude_deg, bare.sog_mps, bare.cog_rad, bare.heading_rad, bare.turn_rate_radps)
    assert said == (None,) * 5
    assert bare.navigational_status is None


def test_a_static_message_of_two_sentences_has_hull_type_and_name() -> None:
    (heard,) = decode(STATIC)
    assert isinstance(heard, ContactReport)
    assert heard.mmsi == 369190000
    assert heard.name == "MT.MITCHELL"
    assert heard.ship_type == 99
    assert heard.draught_m == 6.0
    assert heard.hull is not None
    assert heard.hull.bow_m + heard.hull.stern_m == 180.0


def test_parts_of_different_messages_are_never_glued() -> None:
    first, second = STATIC.splitlines(keepends=True)
    other = first.replace(b"!AIVDM,2,1,3,B", b"!AIVDM,2,1,4,B").replace(b"*3E", b"*39")
    decoder = AivdmDecoder(UtcClock())
    assert len(decode(first + other + second, decoder)) == 1
    assert decode(second, decoder) == []
    assert decoder.counts["aivdm.incomplete"] == 1
    late = AivdmDecoder(UtcClock())
    assert late.decode(Frame(instant(0.0), Link.AIVDM, first)) == []
    assert late.decode(Frame(instant(9.0), Link.AIVDM, second)) == []


def test_datagrams_without_line_ends_and_tag_blocks_are_read() -> None:
    decoder = AivdmDecoder(UtcClock())
    bare = sentence().strip()
    assert decode(bare, decoder) == []
    assert len(decode(rb"\s:x,c:1276256771*5E" + b"\\" + bare, decoder)) == 1
    assert len(decode(b"\n", decoder)) == 1


def test_our_own_transponder_is_an_own_position_and_a_virtual_aid_is_none() -> None:
    (own,) = decode(sentence("AIVDO"))
    assert isinstance(own, OwnPosition)
    assert own.source is Source.AIVDM
    assert own.velocity_ned_mps == pytest.approx((0.0, 5.1444, 0.0), abs=1e-3)
    assert decode(sentence("AIVDO", mmsi=993310001)) == []
    assert decode(sentence("BSVDO", type=4, mmsi=2190049)) == []


def test_the_time_stamp_gives_the_age_once_utc_is_known() -> None:
    utc = UtcClock()
    utc.observe(UtcTime(instant(0.0), Source.AIVDM, 600 * 10**9))
    (heard,) = AivdmDecoder(utc).decode(Frame(instant(33.0), Link.AIVDM, sentence(second=30)))
    assert isinstance(heard, ContactReport)
    assert heard.measured_at == instant(30.0)


@given(st.binary(max_size=200), st.integers(0, 2**32))
@settings(max_examples=200)
def test_mutated_bytes_never_raise(noise: bytes, seed: int) -> None:
    stream = bytearray(STATIC + sentence() + noise + sentence(type=18))
    for i in range(4):
        stream[(seed >> i * 7) % len(stream)] = (seed >> i) & 0xFF
    for heard in decode(bytes(stream) + b"\n"):
        assert isinstance(heard, ContactReport | OwnPosition)


def test_a_valid_checksum_over_nonsense_is_dropped_and_counted() -> None:
    decoder = AivdmDecoder(UtcClock())
    for payload in (b"", b"w" * 60, b"1", b"5" * 3, b"~~~~", b"H", b"K" * 28):
        body = b"AIVDM,1,1,,A," + payload + b",0"
        total = 0
        for byte in body:
            total ^= byte
        decode(b"!" + body + b"*%02X\r\n" % total, decoder)
    assert sum(decoder.counts.values()) >= 7


def test_a_line_that_never_ends_takes_no_memory() -> None:
    decoder = AivdmDecoder(UtcClock())
    for _ in range(100):
        decode(b"x" * 1000, decoder)
    assert len(decoder._rest) <= 2000
    assert decoder.counts["aivdm.bad_line"] > 10


def test_files_date_their_lines_by_tag_block_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "log.nmea"
    path.write_bytes(rb"\c:1276256771*5E\!AIVDM,1,1,,B,x,0*00" + b"\n!AIVDM,1,1,,B,y,0*00\n")
    first, second = read_sentences(path)
    assert first.at == second.at == Instant(1276256771 * 10**9)
    path.write_bytes(b"!AIVDM,1,1,,B,x,0*00\n!AIVDM,1,1,,B,y,0*00\n")
    assert [dated for _, _, dated in read_sentences(path)] == [False, False]
    with pytest.raises(LogError, match="AIVDM"):
        read_sentences(tmp_path / "missing")
