"""What a recorded CAN log says about every ship, for all of its duration: the truth of a replay.

The whole log is decoded once by the `nmea2000` library, not by the companion's decoder, and with
the benefit of hindsight: positions are interpolated between the reports before and after.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from nmea2000.decoder import NMEA2000Decoder
from nmea2000.message import NMEA2000Message

from companion.edges.files import CandumpFrame, read_candump
from companion.errors import LogError
from companion.messages import FloatArray, Hull

_CLASS_A = 129038
_POSITION = frozenset({_CLASS_A, 129039, 129040})
_SIZE = frozenset({129040, 129794, 129810})
_NAME = frozenset({129040, 129794, 129809})
_TIME = frozenset({126992, 129029, 129033})
_OWN = 129025
_WANTED = sorted(_POSITION | _SIZE | _NAME | _TIME | {_OWN})

_OWN_WITHIN_M = 20.0  # median distance to the log's own position, of its own echo
_OWN_REPORTS = 5
_METRES_PER_DEG = 111_195.0
_SAME_REPORT_S = 0.5  # the same report again, by another way
_EARLY_S = 5.0  # a time stamp may be this much ahead of the log's clock before it counts as old

Values = dict[str, object]


@dataclass(frozen=True, slots=True)
class LoggedShip:
    """One ship's reports: seconds since the log's start when measured, rising; NaN where not said."""

    mmsi: int
    name: str
    class_a: bool
    hull: Hull | None
    t_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    sog_mps: FloatArray
    cog_rad: FloatArray
    heading_rad: FloatArray


@dataclass(frozen=True, slots=True)
class Logbook:
    """A log: its frames, its ships in MMSI order without the recording one, and that one by MMSI.

    `utc_ns_at_zero` is UTC at the first frame, from the GNSS receivers on the bus.
    """

    frames: tuple[CandumpFrame, ...]
    duration_s: float
    utc_ns_at_zero: int
    ships: tuple[LoggedShip, ...]
    own_mmsi: int | None
    own_deg: FloatArray  # (k, 3) seconds, latitude, longitude of the recording ship


@dataclass(slots=True)
class _Gathered:
    reports: dict[int, list[tuple[float, Values]]] = field(default_factory=lambda: defaultdict(list))
    class_a: set[int] = field(default_factory=set)
    hulls: dict[int, Hull] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    own: list[tuple[float, float, float]] = field(default_factory=list)
    utc_minus_log_s: dict[int, list[float]] = field(default_factory=lambda: defaultdict(list))


def read(path: Path) -> Logbook:
    """Decode a candump log; raises `LogError` when it cannot be read or holds no frames."""
    frames = tuple(sorted(read_candump(path), key=lambda frame: frame.unix_ns))
    if not frames:
        raise LogError(f"{path}: no CAN frames in it; give a candump log such as '(1.5) can0 09F80114#...'")
    zero = frames[0].unix_ns
    found = _gather(frames, zero)
    # a statement of UTC is late by its way over the bus, so its higher values are the better ones;
    # of several receivers (one may be wrong by seconds) the middle one
    per_receiver = [float(np.percentile(values, 90)) for values in found.utc_minus_log_s.values()]
    ahead_s = float(np.median(per_receiver)) if per_receiver else 0.0
    clock_s = zero * 1e-9 % 60.0 + ahead_s
    ships = [
        _ship(mmsi, rows, clock_s, found)
        for mmsi, rows in sorted(found.reports.items())
    ]  # fmt: skip
    own_deg = np.array(sorted(found.own)).reshape(-1, 3)
    own = _own_ship(ships, own_deg)
    return Logbook(
        frames=frames,
        duration_s=(frames[-1].unix_ns - zero) * 1e-9,
        utc_ns_at_zero=zero + round(ahead_s * 1e9),
        ships=tuple(ship for ship in ships if ship.mmsi != own),
        own_mmsi=own,
        own_deg=own_deg,
    )


def _gather(frames: tuple[CandumpFrame, ...], zero: int) -> _Gathered:
    found = _Gathered()
    decoder = NMEA2000Decoder(include_pgns=list(_WANTED), units="si")
    wanted = frozenset(_WANTED)
    for frame in frames:
        if _pgn(frame.can_id) not in wanted:
            continue
        message = _decoded(decoder, frame)
        if message is not None:
            _sort_in(found, message, (frame.unix_ns - zero) * 1e-9, frame.unix_ns)
    return found


def _sort_in(found: _Gathered, message: NMEA2000Message, t_s: float, unix_ns: int) -> None:
    values: Values = {part.id: part.raw_value for part in message.fields}
    pgn, mmsi = message.PGN, values.get("userId")
    if pgn in _TIME:
        days, seconds = values.get("date"), values.get("time")
        if isinstance(days, int | float) and isinstance(seconds, int | float):
            found.utc_minus_log_s[message.source].append(days * 86_400 + seconds - unix_ns * 1e-9)
    elif pgn == _OWN and (own := _position(values)) is not None:
        found.own.append((t_s, *own))
    if not isinstance(mmsi, int):
        return
    if pgn in _POSITION and _position(values) is not None:
        found.reports[mmsi].append((t_s, values))
        if pgn == _CLASS_A:
            found.class_a.add(mmsi)
    if pgn in _SIZE and (hull := _hull(values)) is not None:
        found.hulls[mmsi] = hull
    if pgn in _NAME and isinstance(name := values.get("name"), bytes):
        found.names[mmsi] = name.decode("ascii", "replace").rstrip("@ \0\ufffd")


def _pgn(can_id: int) -> int:
    pgn = can_id >> 8 & 0x3FFFF
    return pgn if pgn >> 8 & 0xFF >= 240 else pgn & 0x3FF00


def _decoded(decoder: NMEA2000Decoder, frame: CandumpFrame) -> NMEA2000Message | None:
    seconds, ns = divmod(frame.unix_ns, 1_000_000_000)
    line = f"({seconds}.{ns // 1000:06d}) can0 {frame.can_id:08X}#{frame.data.hex()}"
    try:
        return decoder.decode(line)
    except (ValueError, OverflowError):  # a damaged frame in somebody's log
        return None


def _position(values: Values) -> tuple[float, float] | None:
    latitude, longitude = values.get("latitude"), values.get("longitude")
    if not isinstance(latitude, int | float) or not isinstance(longitude, int | float):
        return None
    return (latitude, longitude) if abs(latitude) <= 90 and abs(longitude) <= 180 else None


def _hull(values: Values) -> Hull | None:
    sizes = [
        values.get(key)
        for key in ("length", "beam", "positionReferenceFromBow", "positionReferenceFromStarboard")
    ]
    length, beam, bow, starboard = (float(v) if isinstance(v, int | float) else 0.0 for v in sizes)
    if length <= 0.0 or beam <= 0.0:
        return None
    bow, starboard = min(bow, length), min(starboard, beam)
    return Hull(bow, length - bow, beam - starboard, starboard)


def _ship(mmsi: int, rows: list[tuple[float, Values]], clock_s: float, found: _Gathered) -> LoggedShip:
    table = sorted(
        (
            t_s - _age_s(t_s + clock_s, values.get("timeStamp")),
            *(_number(values.get(key)) for key in ("latitude", "longitude", "sog", "cog", "heading")),
        )
        for t_s, values in rows
    )
    distinct = table[:1]
    for row in table[1:]:
        if row[0] - distinct[-1][0] >= _SAME_REPORT_S:
            distinct.append(row)
    t, latitude, longitude, sog, cog, heading = np.array(distinct).T
    return LoggedShip(
        mmsi,
        found.names.get(mmsi, ""),
        mmsi in found.class_a,
        found.hulls.get(mmsi),
        t_s=t,
        latitude_deg=latitude,
        longitude_deg=longitude,
        sog_mps=sog,
        cog_rad=cog,
        heading_rad=heading,
    )


def _age_s(utc_s: float, stamp: object) -> float:
    """How long before `utc_s` the position was measured, from the report's second of the minute."""
    if not isinstance(stamp, int) or stamp >= 60:
        return 0.0
    age = (utc_s - stamp) % 60.0
    return 0.0 if age > 60.0 - _EARLY_S else age


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else np.nan


def _own_ship(ships: list[LoggedShip], own_deg: FloatArray) -> int | None:
    """The MMSI whose reports coincide with the bus's own position: the recording ship's echo."""
    if len(own_deg) == 0:
        return None
    best: tuple[float, int] | None = None
    for ship in ships:
        if len(ship.t_s) < _OWN_REPORTS:
            continue
        latitude = np.interp(ship.t_s, own_deg[:, 0], own_deg[:, 1])
        longitude = np.interp(ship.t_s, own_deg[:, 0], own_deg[:, 2])
        north = (ship.latitude_deg - latitude) * _METRES_PER_DEG
        east = (ship.longitude_deg - longitude) * _METRES_PER_DEG * np.cos(np.radians(latitude))
        distance = float(np.median(np.hypot(north, east)))
        if distance < _OWN_WITHIN_M and (best is None or distance < best[0]):
            best = distance, ship.mmsi
    return None if best is None else best[1]
