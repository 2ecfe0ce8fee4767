"""The AIS messages of NMEA 2000: reassembled payloads to contact reports.

Little endian.  Only what was announced is read: a payload may end early (older devices), and is
usable when it reaches the last field we need.
"""

import struct
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, Hull, Source, TargetKind
from companion.utc import UtcClock
from companion.wire import ais_rules

# One second each for the stamp's resolution and for UTC, on which the talkers of one recorded bus
# differ by 1.3 s.
AGE_ERROR_S = 2.0
# The oldest recorded report of a sound transponder had 4.9 s.  Beyond: a late report, or a clock
# that is off (24 s and, GPS time for UTC, 42 s were recorded).
PLAUSIBLE_AGE_S = 5.0
AHEAD_S = 3.0  # a stamp this much ahead of our UTC is a fresh report, not one 57 s old

_PREFIX = struct.Struct("<BIiiBHH")  # message id, MMSI, longitude, latitude, flags, COG, SOG
_HEADER = struct.Struct("<BI")  # message id, MMSI
_U16 = struct.Struct("<H")
_I16 = struct.Struct("<h")
_SIZES = struct.Struct("<HHHH")  # length, beam, antenna from starboard, antenna from the bow
_U16_RESERVED = 0xFFFD  # and above: reserved, error, not available
_I32_RESERVED = 0x7FFFFFFD
_FULL_TURN = 62832  # 360 degrees in 1e-4 rad: "not available" in AIS
_SOG_LIMIT = 5260  # in 0.01 m/s: 1022 of AIS ("102.2 knots or more") is 5258, 1023 ("none") 5263
_TURN_LIMIT = 6702  # 720 degrees a minute in 3.125e-5 rad/s; AIS ends at 708
_DRAUGHT_AT = 51  # of 129794, 0.01 m
_NOT_MEASURED = 60  # time stamps from here on: none, manual, dead reckoning, inoperative


class Layout(NamedTuple):
    """How to read one PGN: the fewest bytes that will do, and the reader."""

    shortest: int
    read: Callable[[bytes, Instant, UtcClock, Counter[str]], ContactReport]


def measured(received: Instant, second: int, utc: UtcClock) -> tuple[Instant, float]:
    """When a position with AIS time stamp `second` was measured, and the error bound, seconds.

    The stamp counts the seconds of a UTC minute, so an age of more than a minute cannot be told.
    An age that is no longer plausible keeps an error as large as itself: it may be all wrong.
    """
    now_ns = utc.utc_ns(received)
    if second >= _NOT_MEASURED or now_ns is None:
        return received, ais_rules.UNSTAMPED_AGE_ERROR_S
    age_ns = (now_ns - second * NS_PER_S) % (60 * NS_PER_S)
    if age_ns > (60 - AHEAD_S) * NS_PER_S:
        age_ns = 0
    age_s = age_ns / NS_PER_S
    return Instant(received - age_ns), AGE_ERROR_S if age_s <= PLAUSIBLE_AGE_S else age_s


def _angle(raw: int) -> float | None:
    return raw * 1e-4 if raw < _FULL_TURN else None


def _hull(payload: bytes, at: int) -> Hull | None:
    length, beam, starboard, bow = _SIZES.unpack_from(payload, at)
    if max(length, beam) >= _U16_RESERVED:
        return None
    if bow > length or starboard > beam:  # includes "not available": the antenna may be anywhere
        bow, starboard = 0, beam
    return ais_rules.hull(bow * 0.1, (length - bow) * 0.1, (beam - starboard) * 0.1, starboard * 0.1)


def _position(
    kind: TargetKind,
    payload: bytes,
    received: Instant,
    utc: UtcClock,
    counts: Counter[str],
    *,
    heading_rad: float | None = None,
    turn_rate_radps: float | None = None,
    navigational_status: int | None = None,
    hull: Hull | None = None,
    ship_type: int | None = None,
    name: str | None = None,
) -> ContactReport:
    _, mmsi, lon, lat, flags, cog, sog = _PREFIX.unpack_from(payload)
    latitude: float | None = None
    longitude: float | None = None
    if lat < _I32_RESERVED and lon < _I32_RESERVED:
        latitude, longitude = lat * 1e-7, lon * 1e-7
        if not ais_rules.is_position(latitude, longitude):
            counts["n2k.position_out_of_range"] += 1
            latitude = longitude = None
    second = flags >> 2
    measured_at, age_error_s = measured(received, second, utc)
    return ContactReport(
        mmsi=mmsi,
        source=Source.NMEA2000,
        received_at=received,
        measured_at=measured_at,
        age_error_s=age_error_s,
        kind=kind,
        latitude_deg=latitude,
        longitude_deg=longitude,
        accurate=bool(flags & 1) and second <= _NOT_MEASURED,
        cog_rad=_angle(cog),
        sog_mps=sog * 0.01 if sog < _SOG_LIMIT else None,
        heading_rad=heading_rad,
        turn_rate_radps=turn_rate_radps,
        navigational_status=navigational_status,
        hull=hull,
        ship_type=ship_type,
        name=name,
    )


def _static(
    kind: TargetKind,
    payload: bytes,
    received: Instant,
    *,
    hull: Hull | None = None,
    ship_type: int | None = None,
    name: str | None = None,
    draught_m: float | None = None,
) -> ContactReport:
    return ContactReport(
        mmsi=_HEADER.unpack_from(payload)[1],
        source=Source.NMEA2000,
        received_at=received,
        measured_at=received,
        age_error_s=ais_rules.UNSTAMPED_AGE_ERROR_S,
        kind=kind,
        hull=hull,
        ship_type=ship_type or None,
        name=name,
        draught_m=draught_m,
    )


def _class_a(p: bytes, t: Instant, utc: UtcClock, counts: Counter[str]) -> ContactReport:
    turn = _I16.unpack_from(p, 23)[0]
    status = p[25] & 0x0F
    return _position(
        TargetKind.CLASS_A,
        p,
        t,
        utc,
        counts,
        heading_rad=_angle(_U16.unpack_from(p, 21)[0]),
        turn_rate_radps=turn * 3.125e-5 if abs(turn) < _TURN_LIMIT else None,
        navigational_status=None if status == ais_rules.NAVIGATIONAL_STATUS_UNKNOWN else status,
    )


def _class_b(p: bytes, t: Instant, utc: UtcClock, counts: Counter[str]) -> ContactReport:
    return _position(TargetKind.CLASS_B, p, t, utc, counts, heading_rad=_angle(_U16.unpack_from(p, 21)[0]))


def _class_b_extended(p: bytes, t: Instant, utc: UtcClock, counts: Counter[str]) -> ContactReport:
    return _position(
        TargetKind.CLASS_B,
        p,
        t,
        utc,
        counts,
        heading_rad=_angle(_U16.unpack_from(p, 21)[0]),
        hull=_hull(p, 24),
        ship_type=p[20] or None,
        name=ais_rules.text(p[32:52]),
    )


def _class_a_static(p: bytes, t: Instant, _utc: UtcClock, _counts: Counter[str]) -> ContactReport:
    return _static(
        TargetKind.CLASS_A,
        p,
        t,
        hull=_hull(p, 37),
        ship_type=p[36],
        name=ais_rules.text(p[16:36]),
        draught_m=_draught_m(p),
    )


def _draught_m(payload: bytes) -> float | None:
    """AIS says 0 for "not available"; a short form ends before it."""
    if len(payload) < _DRAUGHT_AT + 2:
        return None
    raw = _U16.unpack_from(payload, _DRAUGHT_AT)[0]
    return raw * 0.01 if 0 < raw < _U16_RESERVED else None


def _class_b_static_a(p: bytes, t: Instant, _utc: UtcClock, _counts: Counter[str]) -> ContactReport:
    return _static(TargetKind.CLASS_B, p, t, name=ais_rules.text(p[5:25]))


def _class_b_static_b(p: bytes, t: Instant, _utc: UtcClock, _counts: Counter[str]) -> ContactReport:
    # a craft of a mother ship sends that ship's MMSI in place of its own size
    of_mothership = _HEADER.unpack_from(p)[1] // 10_000_000 == ais_rules.CRAFT_OF_MOTHERSHIP
    return _static(TargetKind.CLASS_B, p, t, hull=None if of_mothership else _hull(p, 20), ship_type=p[5])


LAYOUTS = {
    129038: Layout(26, _class_a),
    129039: Layout(23, _class_b),
    129040: Layout(52, _class_b_extended),
    129794: Layout(45, _class_a_static),
    129809: Layout(25, _class_b_static_a),
    129810: Layout(28, _class_b_static_b),
}


def read(
    pgn: int, payload: bytes, received: Instant, utc: UtcClock, counts: Counter[str]
) -> ContactReport | None:
    """The report in a payload of one of `LAYOUTS`' PGNs; None (counted) when it is unusable."""
    shortest, reader = LAYOUTS[pgn]
    if len(payload) < shortest:
        counts["n2k.short_message"] += 1
        return None
    if not ais_rules.is_mmsi(_HEADER.unpack_from(payload)[1]):
        counts["n2k.bad_mmsi"] += 1
        return None
    return reader(payload, received, utc, counts)
