"""Recorded traffic of any kind to what was heard: tables (CSV), NMEA 2000 candumps, AIVDM streams."""

import gzip
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from companion.edges.files import read_candump
from companion.edges.sentences import read_sentences
from companion.edges.tables import is_table, reports
from companion.errors import LogError
from companion.instant import Instant
from companion.messages import Frame, Heard, Link, Source, UtcTime
from companion.utc import UtcClock
from companion.wire.aivdm import AivdmDecoder
from companion.wire.nmea2000 import Nmea2000Decoder


def read(path: Path, counts: Counter[str]) -> Iterator[Heard]:
    """What a file holds, told by its contents; raises `LogError` when it is none of the kinds."""
    try:
        raw = path.read_bytes()
        text = gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw
    except (OSError, EOFError, gzip.BadGzipFile) as error:
        raise LogError(
            f"{path}: {getattr(error, 'strerror', None) or error}; give recorded traffic"
        ) from None
    head = text[:4096]
    if is_table(head):
        return reports(path, text.decode("utf-8", "replace"), counts)
    if any(line.startswith(b"(") and b"#" in line for line in head.splitlines()[:20]):
        return _bus(path, counts)
    if any(b"!" in line and b"VD" in line for line in head.splitlines()[:20]):
        return _sentences(path, counts)
    raise LogError(
        f"{path}: neither a table of AIS (CSV), nor a candump log, nor AIVDM sentences; "
        "give a table as of MarineCadastre or the Danish Maritime Authority, candump or AIVDM, plain or .gz"
    )


def _bus(path: Path, counts: Counter[str]) -> Iterator[Heard]:
    utc = UtcClock()
    decoder = Nmea2000Decoder(utc)
    for frame in read_candump(path, counts):
        for heard in decoder.decode(Frame(Instant(frame.unix_ns), Link.CAN, frame.data, frame.can_id)):
            if isinstance(heard, UtcTime):
                utc.observe(heard)
            yield heard
    counts.update(decoder.counts)


def _sentences(path: Path, counts: Counter[str]) -> Iterator[Heard]:
    utc = UtcClock()
    decoder = AivdmDecoder(utc)
    for at, line, dated in read_sentences(path):
        if dated:
            utc.observe(UtcTime(at, Source.AIVDM, at))  # the file's times are UTC
        yield from decoder.decode(Frame(at, Link.AIVDM, line + b"\n"))
    counts.update(decoder.counts)
