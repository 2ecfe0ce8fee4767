"""Tables of decoded AIS as authorities publish them, one report a row: MarineCadastre and the Danish one.

MarineCadastre has had two spellings of its columns (until 2023, and since) and leaves some out in some years;
the Danish Maritime Authority writes words where AIS has codes.  Columns are found by name, in any order.
"""

import csv
import io
import math
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from companion.errors import LogError
from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, Hull, Source, TargetKind
from companion.wire import ais_rules

_KNOT_MPS = 1852 / 3600
_LONGEST_M = 1022.0  # the most AIS can tell
_DEEPEST_M = 25.5
_FIRST_YEAR, _LAST_YEAR = 1990, 2200
_NAMES = {  # ours: theirs, in lower case and without spaces and underscores
    "mmsi": ("mmsi",),
    "time": ("basedatetime", "#timestamp", "timestamp"),
    "latitude": ("lat", "latitude"),
    "longitude": ("lon", "longitude"),
    "sog": ("sog",),
    "cog": ("cog",),
    "heading": ("heading",),
    "name": ("vesselname", "name"),
    "type": ("vesseltype", "shiptype"),
    "status": ("status", "navigationalstatus"),
    "length": ("length",),
    "width": ("width",),
    "draught": ("draft", "draught"),
    "class": ("transceiverclass", "transceiver", "typeofmobile"),
    "a": ("a",),
    "b": ("b",),
    "c": ("c",),
    "d": ("d",),
}
_NEEDED = ("mmsi", "time", "latitude", "longitude", "sog", "cog")
_KINDS = {
    "a": TargetKind.CLASS_A,
    "class a": TargetKind.CLASS_A,
    "b": TargetKind.CLASS_B,
    "class b": TargetKind.CLASS_B,
    "sar airborne": TargetKind.AIRCRAFT,
}
_STATUSES = {
    "under way using engine": 0,
    "at anchor": 1,
    "not under command": 2,
    "restricted maneuverability": 3,
    "constrained by her draught": 4,
    "moored": 5,
    "aground": 6,
    "engaged in fishing": 7,
    "under way sailing": 8,
}
_TYPES = {
    "wig": 20,
    "fishing": 30,
    "towing": 31,
    "towing long/wide": 32,
    "dredging": 33,
    "diving": 34,
    "military": 35,
    "sailing": 36,
    "pleasure": 37,
    "hsc": 40,
    "pilot": 50,
    "sar": 51,
    "tug": 52,
    "port tender": 53,
    "anti-pollution": 54,
    "law enforcement": 55,
    "medical": 58,
    "passenger": 60,
    "cargo": 70,
    "tanker": 80,
    "other": 90,
}


def is_table(head: bytes) -> bool:
    """Whether a file that begins so is one of these."""
    return "mmsi" in _plain(head.split(b"\n", 1)[0].decode("utf-8", "replace")).split(",")


def reports(path: Path, text: str, counts: Counter[str]) -> Iterator[ContactReport]:
    """The rows in order of time; what makes no sense is counted.  Raises `LogError` without the columns."""
    rows = _rows(text, counts)
    titles = [_plain(title) for title in next(rows, [])]
    at = {ours: i for ours, theirs in _NAMES.items() for i, title in enumerate(titles) if title in theirs}
    missing = [_NAMES[ours][0] for ours in _NEEDED if ours not in at]
    if missing:
        raise LogError(
            f"{path}: the table lacks the columns {', '.join(missing)}; "
            "columns are named as by MarineCadastre or the Danish Maritime Authority"
        )
    found = []
    for row in rows:
        report = _report({ours: row[i].strip() for ours, i in at.items() if i < len(row)})
        if report is None:
            counts["table.bad_row"] += 1
        else:
            found.append(report)
    return iter(sorted(found, key=lambda r: r.measured_at))


def _rows(text: str, counts: Counter[str]) -> Iterator[list[str]]:
    reader = csv.reader(io.StringIO(text))
    while True:
        try:
            yield next(reader)
        except StopIteration:
            return
        except csv.Error:  # a field without end
            counts["table.bad_row"] += 1


def _plain(title: str) -> str:
    return title.lower().replace(" ", "").replace("_", "").replace('"', "").lstrip("\ufeff").rstrip("\r")


def _report(row: dict[str, str]) -> ContactReport | None:
    try:
        mmsi, at = int(row["mmsi"]), _instant(row["time"])
        latitude, longitude = float(row["latitude"]), float(row["longitude"])
        sog, cog = _number(row, "sog"), _number(row, "cog")
        heading, draught = _number(row, "heading"), _number(row, "draught")
        hull = _hull(*(_number(row, key) for key in ("a", "b", "c", "d", "length", "width")))
        ship_type, status = _code(row.get("type", ""), _TYPES), _code(row.get("status", ""), _STATUSES)
    except (KeyError, ValueError, OverflowError):
        return None
    if not ais_rules.is_mmsi(mmsi) or not ais_rules.is_position(latitude, longitude):
        return None
    return ContactReport(
        mmsi=mmsi,
        source=Source.TABLE,
        received_at=at,
        measured_at=at,
        age_error_s=0.5,  # whole seconds
        kind=_KINDS.get(row.get("class", "").lower(), TargetKind.UNKNOWN),
        latitude_deg=latitude,
        longitude_deg=longitude,
        cog_rad=math.radians(cog) if 0.0 <= cog < 360.0 else None,
        sog_mps=sog * _KNOT_MPS if 0.0 <= sog < 102.3 else None,
        heading_rad=math.radians(heading) if 0.0 <= heading < 360.0 else None,
        navigational_status=status if status is not None and status < 15 else None,
        hull=hull,
        ship_type=ship_type or None,
        name=row.get("name") or None,
        draught_m=draught if 0.0 < draught <= _DEEPEST_M else None,
    )


def _number(row: dict[str, str], key: str) -> float:
    return float(row.get(key) or "nan")


def _code(text: str, words: dict[str, int]) -> int | None:
    """A code of AIS, written as a number or in words; None for words that say nothing."""
    try:
        return int(float(text))
    except ValueError:
        return words.get(text.lower())


def _hull(a: float, b: float, c: float, d: float, length: float, width: float) -> Hull | None:
    """From the antenna's distances; where only length and width are told, wherever the antenna may be.

    Which of C and D is port the publishers do not agree on, so both sides get the larger one.
    """
    if 0 < a + b <= _LONGEST_M and 0 < c + d <= _LONGEST_M:
        known = ais_rules.hull(a, b, c, d)
        side = max(known.port_m, known.starboard_m) if known else 0.0
        return Hull(known.bow_m, known.stern_m, side, side) if known else None
    told = 0 < length <= _LONGEST_M and 0 < width <= _LONGEST_M
    return Hull(length, length, width, width) if told else None


def _instant(text: str) -> Instant:
    """UTC: ISO 8601, or the day first with slashes.  Raises `ValueError`."""
    found = (
        datetime.strptime(text + "+0000", "%d/%m/%Y %H:%M:%S%z")
        if "/" in text
        else datetime.fromisoformat(text)
    )
    found = found.replace(tzinfo=UTC) if found.tzinfo is None else found
    if not _FIRST_YEAR <= found.year <= _LAST_YEAR:
        raise ValueError
    return Instant(round(found.timestamp() * NS_PER_S))
