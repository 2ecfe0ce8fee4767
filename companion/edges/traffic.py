"""Recorded traffic of any kind to what was heard: tables (CSV), NMEA 2000 candumps, AIVDM streams."""

import calendar
import csv
import gzip
import io
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from companion.edges.files import read_candump
from companion.edges.sentences import read_sentences
from companion.errors import LogError
from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, Frame, Heard, Hull, Link, Source, TargetKind, UtcTime
from companion.utc import UtcClock
from companion.wire import ais_rules
from companion.wire.aivdm import AivdmDecoder
from companion.wire.nmea2000 import Nmea2000Decoder

_KNOT_MPS = 1852 / 3600
_NEEDED = ("MMSI", "BaseDateTime", "LAT", "LON", "SOG", "COG")


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
    if b"MMSI" in head.split(b"\n", 1)[0]:
        return _table(path, text.decode("utf-8", "replace"), counts)
    if any(line.startswith(b"(") and b"#" in line for line in head.splitlines()[:20]):
        return _bus(path, counts)
    if any(b"!" in line and b"VD" in line for line in head.splitlines()[:20]):
        return _sentences(path, counts)
    raise LogError(
        f"{path}: neither a table with {', '.join(_NEEDED)}, nor a candump log, nor AIVDM sentences; "
        "give MarineCadastre CSV, candump or AIVDM, plain or .gz"
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


def _table(path: Path, text: str, counts: Counter[str]) -> Iterator[Heard]:
    """MarineCadastre's columns; those it has dropped in some years are optional."""
    rows = csv.DictReader(io.StringIO(text))
    missing = [name for name in _NEEDED if name not in (rows.fieldnames or ())]
    if missing:
        raise LogError(f"{path}: the table lacks the columns {', '.join(missing)}")
    reports = []
    for row in rows:
        report = _row(row)
        if report is None:
            counts["table.bad_row"] += 1
        else:
            reports.append(report)
    return iter(sorted(reports, key=lambda r: r.measured_at))


def _row(row: dict[str, str]) -> ContactReport | None:
    try:
        mmsi = int(row["MMSI"])
        at = _instant(row["BaseDateTime"])
        latitude, longitude = float(row["LAT"]), float(row["LON"])
        sog, cog = float(row["SOG"] or "nan"), float(row["COG"] or "nan")
        heading = float(row.get("Heading") or 511.0)
        ship_type = int(float(row.get("VesselType") or 0))
        length, width = float(row.get("Length") or 0.0), float(row.get("Width") or 0.0)
    except (ValueError, TypeError):
        return None
    if not ais_rules.is_mmsi(mmsi) or not ais_rules.is_position(latitude, longitude):
        return None
    kinds = {"A": TargetKind.CLASS_A, "B": TargetKind.CLASS_B}
    return ContactReport(
        mmsi=mmsi,
        source=Source.TABLE,
        received_at=at,
        measured_at=at,
        age_error_s=0.5,
        kind=kinds.get(row.get("TransceiverClass") or "", TargetKind.UNKNOWN),
        latitude_deg=latitude,
        longitude_deg=longitude,
        cog_rad=math.radians(cog) if 0.0 <= cog < 360.0 else None,
        sog_mps=sog * _KNOT_MPS if 0.0 <= sog < 102.3 else None,
        heading_rad=math.radians(heading) if 0.0 <= heading < 360.0 else None,
        hull=Hull(length, length, width, width) if length > 0 and width > 0 else None,
        ship_type=ship_type or None,
        name=row.get("VesselName") or None,
    )


def _instant(text: str) -> Instant:
    day, _, clock = text.partition("T")
    year, month, date = (int(part) for part in day.split("-"))
    hour, minute, second = (int(part) for part in clock.split(":"))
    return Instant(calendar.timegm((year, month, date, hour, minute, second)) * NS_PER_S)
