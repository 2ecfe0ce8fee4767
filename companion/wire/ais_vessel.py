"""MAVLink AIS_VESSEL (#301) to a contact report.

The definition has changed over the years and senders lag behind it, so flags are trusted first,
"not available" values second, ranges third.  `AisQuirk` names the senders that need more.
"""

import math
from collections import Counter
from enum import StrEnum
from typing import Any

from companion.instant import Instant, after
from companion.messages import ContactReport, Hull, Source
from companion.wire import ais_rules

AIS_VESSEL = 301
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

_DEGREES = math.pi / 180
_FULL_TURN_CDEG = 36_000
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


def read(
    field: dict[str, Any], received: Instant, quirk: AisQuirk, counts: Counter[str]
) -> ContactReport | None:
    """The report in the fields of an AIS_VESSEL; None (counted) for an impossible MMSI."""
    mmsi: int = field["MMSI"]
    if not ais_rules.is_mmsi(mmsi):
        counts["ais_vessel.bad_mmsi"] += 1
        return None
    flags: int = field["flags"]
    latitude, longitude = _position(field["lat"], field["lon"], counts)
    cog_cdeg = field["COG"] if flags & VALID_COG and field["COG"] < _FULL_TURN_CDEG else None
    status: int = field["navigational_status"]
    return ContactReport(
        mmsi=mmsi,
        source=Source.AIS_VESSEL,
        received_at=received,
        measured_at=after(received, -field["tslc"]),
        age_error_s=AGE_ERROR_S,
        latitude_deg=latitude,
        longitude_deg=longitude,
        accurate=bool(flags & POSITION_ACCURACY),
        cog_rad=None if cog_cdeg is None else cog_cdeg * 0.01 * _DEGREES,
        sog_mps=_speed(field["velocity"], flags, quirk),
        heading_rad=_heading(field["heading"], cog_cdeg),
        turn_rate_radps=_turn_rate(field["turn_rate"], flags, quirk),
        navigational_status=status if status < ais_rules.NAVIGATIONAL_STATUS_UNKNOWN else None,
        hull=_hull(field, flags),
        ship_type=field["type"] or None,
        name=ais_rules.text(field["name"]) if flags & VALID_NAME else None,
    )


def _position(lat: int, lon: int, counts: Counter[str]) -> tuple[float | None, float | None]:
    latitude, longitude = lat * 1e-7, lon * 1e-7
    if not ais_rules.is_position(latitude, longitude):  # INT32_MAX too
        counts["ais_vessel.no_position"] += 1
        return None, None
    if lat == 0 and lon == 0:  # ArduPilot knows the vessel by static data alone
        counts["ais_vessel.no_position"] += 1
        return None, None
    return latitude, longitude


def _speed(velocity: int, flags: int, quirk: AisQuirk) -> float | None:
    unit_mps = 0.1 * 1852 / 3600 if quirk is AisQuirk.ARDUPILOT_EARLY else 0.01
    speed = velocity * unit_mps
    return speed if flags & VALID_VELOCITY and speed <= ais_rules.FASTEST_MPS else None


def _heading(heading: int, cog_cdeg: int | None) -> float | None:
    """There is no flag; early senders mean 0 to say "none", so 0 needs a course that agrees."""
    if heading >= _FULL_TURN_CDEG:  # 65535, and 51100 for 511 degrees
        return None
    if heading == 0:
        turned = None if cog_cdeg is None else min(cog_cdeg, _FULL_TURN_CDEG - cog_cdeg)
        if turned is None or turned > _ZERO_HEADING_AGREES_CDEG:
            return None
    return heading * 0.01 * _DEGREES


def _turn_rate(turn_rate: int, flags: int, quirk: AisQuirk) -> float | None:
    if not flags & VALID_TURN_RATE or flags & TURN_RATE_SIGN_ONLY or quirk is AisQuirk.ARDUPILOT_EARLY:
        return None
    unit_radps = (0.1 if quirk is AisQuirk.STANDARD else 0.01) * _DEGREES
    rate = turn_rate * unit_radps
    return rate if abs(turn_rate) < 127 and abs(rate) <= _FASTEST_TURN_RADPS else None


def _hull(field: dict[str, Any], flags: int) -> Hull | None:
    if not flags & VALID_DIMENSIONS:
        return None
    bow, stern = field["dimension_bow"], field["dimension_stern"]
    port, starboard = field["dimension_port"], field["dimension_starboard"]
    if _NO_LENGTH in (bow, stern) or _NO_WIDTH in (port, starboard):
        return None
    return ais_rules.hull(
        max(float(bow), _LARGE_LENGTH_M if flags & LARGE_BOW else 0.0),
        max(float(stern), _LARGE_LENGTH_M if flags & LARGE_STERN else 0.0),
        max(float(port), _LARGE_WIDTH_M if flags & LARGE_PORT else 0.0),
        max(float(starboard), _LARGE_WIDTH_M if flags & LARGE_STARBOARD else 0.0),
    )
