"""Who makes room when the picture is full: the contact farthest from us, never a nearer one.

A flood of invented ships must not push out a near one, and memory must stay bounded.  The farthest
contacts are sought rarely and used up one by one, so that a flood costs little time either.
"""

import math
from collections.abc import Iterable

from companion.messages import ContactReport
from companion.picture.area import distance_m
from companion.picture.contact import Contact
from companion.picture.reports import has_position

_POOL = 250
Place = tuple[float, float]  # latitude, longitude, degrees


class Room:
    """Chooses whom to give up for a newcomer."""

    def __init__(self) -> None:
        self._farthest: list[tuple[float, int]] = []

    def made_by(self, newcomer: ContactReport, known: Iterable[Contact], here: Place | None) -> int | None:
        """The MMSI to give up for `newcomer`, or None when it is the newcomer that must stay out.

        Without a position of ours nobody is known to be far: the newcomer stays out.
        """
        if here is None or not has_position(newcomer):
            return None
        if not self._farthest:
            ranked = sorted(
                (_range_m(c.places.held[-1].report if c.places.held else None, here), c.mmsi) for c in known
            )
            self._farthest = ranked[-_POOL:]
        range_m, mmsi = self._farthest[-1]
        if range_m <= _range_m(newcomer, here):
            return None
        self._farthest.pop()
        return mmsi


def _range_m(report: ContactReport | None, here: Place) -> float:
    """A contact without position is farther than any other: it is in no track."""
    if report is None or report.latitude_deg is None or report.longitude_deg is None:
        return math.inf
    return distance_m(*here, report.latitude_deg, report.longitude_deg)
