"""What a class A transponder puts on the air, and when (ITU-R M.1371, messages 1 and 5).

Values are in SI units but already on the message's own grid: 1/10,000 minute of position, 0.1
knot, 0.1 degree of course, 1 degree of heading, 1 m of hull.  The time stamp is the UTC second
of the position fix, which receivers take once a second on the second.
"""

import math
from dataclasses import dataclass

from companion.messages import Hull

KNOT_MPS = 1852.0 / 3600.0
STATIC_INTERVAL_S = 360.0
_POSITION_STEP_DEG = 1.0 / 600_000.0
_COURSE_STEP_RAD = math.radians(0.1)
_HEADING_STEP_RAD = math.radians(1.0)
_SPEED_STEP_MPS = 0.1 * KNOT_MPS


@dataclass(frozen=True, slots=True)
class AisPosition:
    """Message 1: courses and headings true, `utc_second` 0..59."""

    mmsi: int
    latitude_deg: float
    longitude_deg: float
    utc_second: int
    cog_rad: float
    sog_mps: float
    heading_rad: float
    accurate: bool = True
    navigational_status: int = 0


@dataclass(frozen=True, slots=True)
class AisStatic:
    """Message 5."""

    mmsi: int
    name: str
    callsign: str
    imo: int
    ship_type: int
    hull: Hull
    draught_m: float


AisReport = AisPosition | AisStatic


def position_report(
    mmsi: int,
    position_deg: tuple[float, float],
    *,
    utc_second: int,
    cog_rad: float,
    sog_mps: float,
    heading_rad: float,
) -> AisPosition:
    """A position report with every value put on the message's grid."""
    return AisPosition(
        mmsi=mmsi,
        latitude_deg=_on_grid(position_deg[0], _POSITION_STEP_DEG),
        longitude_deg=_on_grid(position_deg[1], _POSITION_STEP_DEG),
        utc_second=utc_second,
        cog_rad=_on_grid(cog_rad % math.tau, _COURSE_STEP_RAD) % math.tau,
        sog_mps=representable_speed_mps(sog_mps),
        heading_rad=_on_grid(heading_rad % math.tau, _HEADING_STEP_RAD) % math.tau,
    )


def representable_speed_mps(speed_mps: float) -> float:
    """The nearest speed that a report can state."""
    return _on_grid(speed_mps, _SPEED_STEP_MPS)


def reporting_interval_s(speed_mps: float) -> float:
    """How often a class A ship on a steady course reports: 10, 6 or 2 s; 3 min at anchor or moored."""
    knots = speed_mps / KNOT_MPS
    if knots < 0.5:
        return 180.0
    if knots <= 14.0:
        return 10.0
    return 6.0 if knots <= 23.0 else 2.0


def _on_grid(value: float, step: float) -> float:
    return round(value / step) * step
