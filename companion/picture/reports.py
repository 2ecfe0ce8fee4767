"""Reports made fit to be believed: what is out of range becomes "not available"; time stays sane."""

import math
from collections import Counter

from msgspec.structs import replace

from companion.instant import NS_PER_S, after
from companion.messages import ContactReport, Hull

SAME_MEASUREMENT_S = 0.5
FASTEST_MPS = 53.0  # AIS ends at 102.2 knots, 52.6 m/s
LONGEST_SIDE_M = 1022.0  # and at 511 m to either end, though some senders give all of it one side
_LONGEST_S = 5.0  # whatever the stamps' errors: a ship at rest must be heard anew
_SAME_PLACE_DEG = 5e-7  # a third of AIS's step, several of the wire formats'


def cleaned(report: ContactReport, counts: Counter[str]) -> ContactReport:
    """`report` without impossible numbers, measured no later than it was received.

    A measurement later than its reception is a clock error: the reception bounds it.  All repairs
    are counted.
    """
    lat, lon, sog = report.latitude_deg, report.longitude_deg, report.sog_mps
    cog, heading, hull = report.cog_rad, report.heading_rad, report.hull
    if (lat is not None or lon is not None) and not _on_the_globe(lat, lon):
        counts["picture.bad_position"] += 1
        report = replace(report, latitude_deg=None, longitude_deg=None)
    if sog is not None and not 0.0 <= sog <= FASTEST_MPS:
        counts["picture.bad_speed"] += 1
        report = replace(report, sog_mps=None)
    if not ((cog is None or math.isfinite(cog)) and (heading is None or math.isfinite(heading))):
        counts["picture.bad_angle"] += 1
        report = replace(report, cog_rad=_finite(cog), heading_rad=_finite(heading))
    if hull is not None and not _is_hull(hull):
        counts["picture.bad_hull"] += 1
        report = replace(report, hull=None)
    if report.measured_at > report.received_at:
        if after(report.measured_at, -report.age_error_s) > report.received_at:
            counts["picture.measured_in_the_future"] += 1
        report = replace(report, measured_at=report.received_at)
    return report


def has_position(report: ContactReport) -> bool:
    """Whether the report can move a track; otherwise it is static data."""
    return report.latitude_deg is not None and report.longitude_deg is not None


def same_measurement(known: ContactReport, report: ContactReport) -> bool:
    """Whether `report` is `known` sent again: the same place at the same time, within the stamps' errors."""
    lat, known_lat = report.latitude_deg, known.latitude_deg
    if abs(lat - known_lat) > _SAME_PLACE_DEG:  # type: ignore[operator]  # reports with a position
        return False
    lon, known_lon = report.longitude_deg, known.longitude_deg
    if abs(lon - known_lon) > _SAME_PLACE_DEG:  # type: ignore[operator]
        return False
    within_s = min(SAME_MEASUREMENT_S + known.age_error_s + report.age_error_s, _LONGEST_S)
    return abs(report.measured_at - known.measured_at) <= round(within_s * NS_PER_S)


def _on_the_globe(latitude_deg: float | None, longitude_deg: float | None) -> bool:
    if latitude_deg is None or longitude_deg is None:
        return False
    return -90.0 <= latitude_deg <= 90.0 and -180.0 <= longitude_deg <= 180.0  # False for NaN


def _finite(angle_rad: float | None) -> float | None:
    return angle_rad if angle_rad is not None and math.isfinite(angle_rad) else None


def _is_hull(hull: Hull) -> bool:
    return (
        0.0 <= hull.bow_m <= LONGEST_SIDE_M
        and 0.0 <= hull.stern_m <= LONGEST_SIDE_M
        and 0.0 <= hull.port_m <= LONGEST_SIDE_M
        and 0.0 <= hull.starboard_m <= LONGEST_SIDE_M
    )
