"""Messages of an NMEA 2000 bus: recorded, and made by the `nmea2000` library."""

import math
import struct
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nmea2000 import _canboat, backend

from companion.edges.files import read_candump
from companion.instant import NS_PER_S, Instant, instant
from companion.messages import (
    ContactReport,
    Frame,
    Heard,
    Link,
    Source,
    UtcTime,
)
from companion.utc import UtcClock
from companion.wire.nmea2000 import Nmea2000Decoder

GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
IJSSELMEER = "n2k_ijsselmeer_20221130_native.candump.gz"
AIS_PGNS = (129038, 129039, 129040, 129794, 129809, 129810)
OTHER_PGNS = (129025, 129026, 127250, 129029)
NOON = 1_669_809_600  # 2022-11-30T12:00:00Z
DAYS = NOON // 86_400
TIME = 12 * 3600 * 10_000 + 5  # noon and half a millisecond
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


def sides(report: ContactReport) -> tuple[float, float, float, float]:
    """Bow, stern, port, starboard."""
    assert report.hull is not None
    return report.hull.bow_m, report.hull.stern_m, report.hull.port_m, report.hull.starboard_m


def clock_at(second: float) -> UtcClock:
    """UTC is `second` past noon at the source's 1000 s."""
    utc = UtcClock()
    utc.observe(UtcTime(instant(1000.0), Source.NMEA2000, NOON * NS_PER_S + round(second * NS_PER_S)))
    return utc


def gnss_time(days: int = DAYS, time: int = TIME, method: int = 1) -> bytes:
    return struct.pack("<BHI", 0, days, time) + bytes(24) + bytes((method << 4,)) + bytes(11)
