"""The vehicle's own position and UTC from NMEA 2000: payloads to numbers.

Every reader returns None for what is not available, out of range or too short.
"""

import math
import struct

from companion.wire import ais_rules

_POSITION = struct.Struct("<ii")  # 129025: latitude, longitude, 1e-7 degrees
_COURSE = struct.Struct("<BBHH")  # 129026: SID, reference, COG 1e-4 rad, SOG 0.01 m/s
_HEADING = struct.Struct("<BHhhB")  # 127250: SID, heading, deviation, variation, reference
_SYSTEM_TIME = struct.Struct("<BBHI")  # 126992: SID, source, days, 1e-4 s
_TIME_DATE = struct.Struct("<HI")  # 129033: days, 1e-4 s
_GNSS_TIME = struct.Struct("<BHI")  # 129029: SID, days, 1e-4 s
_GNSS_POSITION = struct.Struct("<qq")  # 129029 from byte 7: latitude, longitude, 1e-16 degrees
_GNSS_POSITION_AT = 7
_GNSS_METHOD = 31  # the byte with the type of fix in its high half
_U16_RESERVED = 0xFFFD
_I16_RESERVED = 0x7FFD
_TRUE, _MAGNETIC = 0, 1
_FULL_TURN = 62832
_DAY_UNITS = 86_401 * 10_000  # a leap second belongs to the day
_EARLIEST_DAY = 10_957  # 2000-01-01: clocks that were never set say 1970 or 1980
_LOCAL_CRYSTAL = 5


def position_deg(payload: bytes) -> tuple[float, float] | None:
    """Latitude and longitude of PGN 129025."""
    if len(payload) < _POSITION.size:
        return None
    raw_lat, raw_lon = _POSITION.unpack_from(payload)
    latitude, longitude = raw_lat * 1e-7, raw_lon * 1e-7
    return (latitude, longitude) if ais_rules.is_position(latitude, longitude) else None


def gnss_position_deg(payload: bytes) -> tuple[float, float] | None:
    """Latitude and longitude of PGN 129029, of a fix only."""
    if len(payload) <= _GNSS_METHOD or payload[_GNSS_METHOD] >> 4 == 0:
        return None
    raw_lat, raw_lon = _GNSS_POSITION.unpack_from(payload, _GNSS_POSITION_AT)
    latitude, longitude = raw_lat * 1e-16, raw_lon * 1e-16
    return (latitude, longitude) if ais_rules.is_position(latitude, longitude) else None


def velocity_mps(payload: bytes) -> tuple[float, float] | None:
    """North and east velocity over ground of PGN 129026, of a true course only."""
    if len(payload) < _COURSE.size:
        return None
    _, reference, cog, sog = _COURSE.unpack_from(payload)
    if reference & 0x03 != _TRUE or cog >= _FULL_TURN or sog >= _U16_RESERVED:
        return None
    return sog * 0.01 * math.cos(cog * 1e-4), sog * 0.01 * math.sin(cog * 1e-4)


def heading_rad(payload: bytes) -> float | None:
    """True heading of PGN 127250; a magnetic one needs its variation in the same message."""
    if len(payload) < _HEADING.size:
        return None
    _, heading, deviation, variation, reference = _HEADING.unpack_from(payload)
    if heading >= _FULL_TURN:
        return None
    if reference & 0x03 == _TRUE:
        return float(heading * 1e-4)
    if reference & 0x03 != _MAGNETIC or variation >= _I16_RESERVED:
        return None
    compass = heading + variation + (deviation if deviation < _I16_RESERVED else 0)
    return float(compass * 1e-4 % (2 * math.pi))


def utc_ns(pgn: int, payload: bytes) -> int | None:
    """UTC since 1970 of PGN 126992, 129033 or 129029, unless a free-running clock says it."""
    if pgn == 126992 and len(payload) >= _SYSTEM_TIME.size:
        _, source, days, time = _SYSTEM_TIME.unpack_from(payload)
        trusted = source & 0x0F != _LOCAL_CRYSTAL
    elif pgn == 129033 and len(payload) >= _TIME_DATE.size:
        days, time = _TIME_DATE.unpack_from(payload)
        trusted = True
    elif pgn == 129029 and len(payload) > _GNSS_METHOD:
        _, days, time = _GNSS_TIME.unpack_from(payload)
        trusted = payload[_GNSS_METHOD] >> 4 != 0  # no fix, no time
    else:
        return None
    if not trusted or not _EARLIEST_DAY <= days < _U16_RESERVED or time >= _DAY_UNITS:
        return None
    return int(days * 86_400 * 1_000_000_000 + time * 100_000)
