"""Reports made fit to be believed: what is out of range becomes "not available"; time stays sane."""

import math
from collections import Counter
from dataclasses import replace

from companion.instant import Instant, after
from companion.messages import ContactReport

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
    if not ((lat is None and lon is None) or _on_the_globe(lat, lon)):
        counts["picture.bad_position"] += 1
        report = replace(report, latitude_deg=None, longitude_deg=None)
    if sog is not None and not 0.0 <= sog <= FASTEST_MPS:
        counts["picture.bad_speed"] += 1
        report = replace(report, sog_mps=None)
    cog, heading = _finite(report.cog_rad), _finite(report.heading_rad)
    if (cog, heading) != (report.cog_rad, report.heading_rad):
        counts["picture.bad_angle"] += 1
        report = replace(report, cog_rad=cog, heading_rad=heading)
    if report.hull is not None and not _is_hull(
        report.hull.bow_m, report.hull.stern_m, report.hull.port_m, report.hull.starboard_m
    ):
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
    assert known.latitude_deg is not None
    assert known.longitude_deg is not None
    assert report.latitude_deg is not None
    assert report.longitude_deg is not None
    within_s = min(SAME_MEASUREMENT_S + known.age_error_s + report.age_error_s, _LONGEST_S)
    return (
        abs(report.latitude_deg - known.latitude_deg) <= _SAME_PLACE_DEG
        and abs(report.longitude_deg - known.longitude_deg) <= _SAME_PLACE_DEG
        and Instant(known.measured_at) <= after(report.measured_at, within_s)
        and Instant(report.measured_at) <= after(known.measured_at, within_s)
    )


def _on_the_globe(latitude_deg: float | None, longitude_deg: float | None) -> bool:
    if latitude_deg is None or longitude_deg is None:
        return False
    return -90.0 <= latitude_deg <= 90.0 and -180.0 <= longitude_deg <= 180.0  # False for NaN


def _finite(angle_rad: float | None) -> float | None:
    return angle_rad if angle_rad is not None and math.isfinite(angle_rad) else None


def _is_hull(*extent_m: float) -> bool:
    return all(0.0 <= side <= LONGEST_SIDE_M for side in extent_m)
