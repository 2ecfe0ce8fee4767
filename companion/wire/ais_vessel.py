"""MAVLink AIS_VESSEL (#301) to a contact report.

The definition has changed over the years and senders lag behind it, so flags are trusted first,
"not available" values second, ranges third.  `AisQuirk` names the senders that need more.
"""

import math
import struct
from collections import Counter
from enum import StrEnum
from functools import lru_cache

from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, Hull, Source
from companion.wire import ais_rules

AIS_VESSEL = 301
# MMSI, latitude, longitude, course, heading, speed, bow, stern, tslc, flags, turn rate, status, type, port,
# starboard, callsign, name: the order on the wire
LAYOUT = struct.Struct("<IiiHHHHHHHbBBBB7s20s")
AGE_ERROR_S = ais_rules.UNSTAMPED_AGE_ERROR_S  # `tslc` counts from the reception, in whole seconds

POSITION_ACCURACY = 1
VALID_COG = 2
VALID_VELOCITY = 4
VALID_TURN_RATE = 16
TURN_RATE_SIGN_ONLY = 32
VALID_DIMENSIONS = 64
LARGE_BOW, LARGE_STERN = 128, 256
LARGE_PORT, LARGE_STARBOARD = 512, 1024
VALID_NAME = 4096
_LARGE = LARGE_BOW | LARGE_STERN | LARGE_PORT | LARGE_STARBOARD

_DEGREES = math.pi / 180
_FULL_TURN_CDEG = 36_000
_EARLY_SPEED = 0.1 * 1852 / 3600  # 0.1 knots
_NO_LENGTH, _NO_WIDTH = 65_535, 255
_LARGE_LENGTH_M, _LARGE_WIDTH_M = 511.0, 63.0  # where AIS ends: "this or more"; no ship is larger
_ZERO_HEADING_AGREES_CDEG = 4_500
_FASTEST_TURN_RADPS = 12 * _DEGREES  # AIS ends at 708 degrees a minute


class AisQuirk(StrEnum):
    """Whose AIS_VESSEL it is.

    `STANDARD`: as defined since August 2025.  `ARDUPILOT_2025`: the turn rate is still in cdeg/s.
    `ARDUPILOT_EARLY` (before June 2025): the speed is in 0.1 knots, and the sign of the turn is lost.
    """

    STANDARD = "standard"
    ARDUPILOT_2025 = "ardupilot-2025"
    ARDUPILOT_EARLY = "ardupilot-early"


_HIGHEST_MMSI, _FASTEST_MPS = ais_rules.HIGHEST_MMSI, ais_rules.FASTEST_MPS
_NO_STATUS = ais_rules.NAVIGATIONAL_STATUS_UNKNOWN
_text = ais_rules.text
_STANDARD, _EARLY = AisQuirk.STANDARD, AisQuirk.ARDUPILOT_EARLY
_SOURCE = Source.AIS_VESSEL


def read(payload: bytes, received: Instant, quirk: AisQuirk, counts: Counter[str]) -> ContactReport | None:
    """The report in the payload of an AIS_VESSEL; None (counted) for an impossible MMSI.

    The hottest message of the link, so it is unpacked here and not by the dialect's definition.
    """
    (
        mmsi,
        lat,
        lon,
        cog,
        heading,
        velocity,
        bow,
        stern,
        tslc,
        flags,
        turn,
        status,
        kind,
        port,
        starboard,
        _,
        name,
    ) = LAYOUT.unpack(
        payload if len(payload) == LAYOUT.size else payload[: LAYOUT.size].ljust(LAYOUT.size, b"\0")
    )
    if not 0 < mmsi <= _HIGHEST_MMSI:
        counts["ais_vessel.bad_mmsi"] += 1
        return None
    latitude: float | None = lat * 1e-7
    longitude: float | None = lon * 1e-7
    # INT32_MAX is "not available"; of zeros ArduPilot knows the vessel by static data alone
    if not (-900_000_000 <= lat <= 900_000_000 and -1_800_000_000 <= lon <= 1_800_000_000 and (lat or lon)):
        counts["ais_vessel.no_position"] += 1
        latitude = longitude = None
    cog_cdeg = cog if flags & VALID_COG and cog < _FULL_TURN_CDEG else None
    speed = velocity * (_EARLY_SPEED if quirk is _EARLY else 0.01)
    return ContactReport(
        mmsi=mmsi,
        source=_SOURCE,
        received_at=received,
        measured_at=Instant(received - tslc * NS_PER_S),
        age_error_s=AGE_ERROR_S,
        latitude_deg=latitude,
        longitude_deg=longitude,
        accurate=bool(flags & POSITION_ACCURACY),
        cog_rad=None if cog_cdeg is None else cog_cdeg * 0.01 * _DEGREES,
        sog_mps=speed if flags & VALID_VELOCITY and speed <= _FASTEST_MPS else None,
        heading_rad=heading * 0.01 * _DEGREES
        if 0 < heading < _FULL_TURN_CDEG
        else _no_heading(heading, cog_cdeg),
        turn_rate_radps=_turn_rate(turn, flags, quirk) if flags & VALID_TURN_RATE else None,
        navigational_status=status if status < _NO_STATUS else None,
        hull=_hull(bow, stern, port, starboard, flags & _LARGE) if flags & VALID_DIMENSIONS else None,
        ship_type=kind or None,
        name=_text(name) if flags & VALID_NAME else None,
    )


def _no_heading(heading: int, cog_cdeg: int | None) -> float | None:
    """There is no flag; early senders mean 0 to say "none", so 0 needs a course that agrees.

    Not below a full turn are 65535, and 51100 for 511 degrees.
    """
    if heading or cog_cdeg is None:
        return None
    return 0.0 if min(cog_cdeg, _FULL_TURN_CDEG - cog_cdeg) <= _ZERO_HEADING_AGREES_CDEG else None


def _turn_rate(turn_rate: int, flags: int, quirk: AisQuirk) -> float | None:
    if flags & TURN_RATE_SIGN_ONLY or quirk is _EARLY:
        return None
    unit_radps = (0.1 if quirk is _STANDARD else 0.01) * _DEGREES
    rate = turn_rate * unit_radps
    return rate if abs(turn_rate) < 127 and abs(rate) <= _FASTEST_TURN_RADPS else None


@lru_cache(maxsize=4096)
def _hull(bow: int, stern: int, port: int, starboard: int, large: int) -> Hull | None:
    """A ship says the same of itself each time."""
    if _NO_LENGTH in (bow, stern) or _NO_WIDTH in (port, starboard):
        return None
    return ais_rules.hull(
        max(float(bow), _LARGE_LENGTH_M if large & LARGE_BOW else 0.0),
        max(float(stern), _LARGE_LENGTH_M if large & LARGE_STERN else 0.0),
        max(float(port), _LARGE_WIDTH_M if large & LARGE_PORT else 0.0),
        max(float(starboard), _LARGE_WIDTH_M if large & LARGE_STARBOARD else 0.0),
    )
