"""Our own ship in the AIS stream: recognised by its number or by its motion, never a contact.

A transponder passes its own reports to the bus, and the vehicle must not flee from itself.  The
platforms whose own positions are known are the autopilot's vehicle and whatever the bus belongs to
(in a replay the two are different ships); a report that agrees with either, at its measurement
time, speaks for an echo, and that is proved in one of two ways:

- *rate*: `RATE_REPORTS` agreeing reports inside `RATE_S`.  Own reports come once a second; over the
  air no ship lying still reports more often than every 3 1/3 s (ITU-R M.1371, table 1);
- *way*: `WAY_REPORTS` agreeing reports in a row while the platform went `WAY_M`.

A neighbour alongside can agree by chance, so an agreement alone hides a contact for `DOUBT_S` only
and once only; whoever was clearly elsewhere `GENUINE` times is never an echo by motion; and an echo
that is clearly elsewhere twice in a row is a contact again.
"""

from collections import deque
from dataclasses import dataclass, field
from enum import Enum

from companion.instant import Instant, after, elapsed_s
from companion.messages import ContactReport, OwnPosition, Source
from companion.picture.area import distance_m
from companion.picture.trail import Trail

AGREE_M = 15.0  # two GNSS antennas on one hull, and a second's way between samples
APART_M = 60.0
AGREE_MPS = 1.0
RATE_REPORTS, RATE_S = 8, 10.0
WAY_REPORTS, WAY_M = 5, 100.0
DOUBT_S = 12.0
GENUINE = 3
REVOKE = 2
_RESENT_S = 0.6  # gateways pass a report twice within 0.5 s


class Likeness(Enum):
    """How a report compares with our own platforms."""

    AGREES = "agrees"
    NEAR = "near, but not the same"
    APART = "apart"
    UNKNOWN = "cannot be compared"


@dataclass(slots=True)
class Evidence:
    """What speaks for and against one MMSI being our own."""

    agreements: deque[Instant] = field(default_factory=lambda: deque(maxlen=RATE_REPORTS))
    in_a_row: int = 0
    measured_at: Instant | None = None
    began_at: tuple[float, float] = (0.0, 0.0)
    apart: int = 0
    genuine: bool = False
    confirmed: bool = False
    doubted: bool = False
    hidden_until: Instant | None = None

    def hides(self, now: Instant) -> bool:
        """Whether the contact has no row at `now`."""
        return self.confirmed or (self.hidden_until is not None and now < self.hidden_until)


class EchoWatch:
    """Knows where our platforms were, and weighs reports against it."""

    def __init__(self, own_mmsi: int) -> None:
        self._own_mmsi = own_mmsi
        self._trails: dict[Source, Trail] = {}

    def observe_own(self, own: OwnPosition) -> None:
        """A position of one of our platforms."""
        if -90.0 <= own.latitude_deg <= 90.0 and -180.0 <= own.longitude_deg <= 180.0:
            self._trails.setdefault(own.source, Trail()).add(own)

    def newest_place(self) -> tuple[float, float] | None:
        """Where we are, as far as known: the autopilot's position first."""
        for source in (Source.MAVLINK, Source.NMEA2000):
            trail = self._trails.get(source)
            if trail and trail.samples:
                return trail.samples[-1].latitude_deg, trail.samples[-1].longitude_deg
        return None

    def weigh(self, evidence: Evidence, report: ContactReport) -> None:
        """Take one report (with a position) into the evidence about its MMSI."""
        if self._own_mmsi and report.mmsi == self._own_mmsi:
            evidence.confirmed = True
            return
        # genuine is for good: nothing that it says now can make it our echo
        if evidence.genuine or not self._trails:
            return
        likeness = self._compare(report)
        if likeness is Likeness.AGREES:
            self._agrees(evidence, report)
        elif likeness is Likeness.APART:
            evidence.in_a_row = 0
            evidence.agreements.clear()
            evidence.apart += 1
            evidence.hidden_until = None
            evidence.genuine |= evidence.apart >= GENUINE
            evidence.confirmed &= evidence.apart < REVOKE
        elif likeness is Likeness.NEAR and not evidence.confirmed:
            evidence.in_a_row = 0
            evidence.agreements.clear()

    def _agrees(self, evidence: Evidence, report: ContactReport) -> None:
        evidence.apart = 0
        if evidence.confirmed or evidence.genuine:
            return
        seen = evidence.agreements
        last = evidence.measured_at
        if last is not None and abs(elapsed_s(last, report.measured_at)) < _RESENT_S:
            return  # the same report sent again proves nothing
        evidence.measured_at = report.measured_at
        assert report.latitude_deg is not None
        assert report.longitude_deg is not None
        here = report.latitude_deg, report.longitude_deg
        if evidence.in_a_row == 0:
            evidence.began_at = here
        if not evidence.doubted:
            evidence.doubted = True
            evidence.hidden_until = after(report.received_at, DOUBT_S)
        seen.append(report.received_at)
        evidence.in_a_row += 1
        by_rate = len(seen) == RATE_REPORTS and elapsed_s(seen[0], seen[-1]) <= RATE_S
        by_way = evidence.in_a_row >= WAY_REPORTS and distance_m(*evidence.began_at, *here) >= WAY_M
        evidence.confirmed = by_rate or by_way

    def _compare(self, report: ContactReport) -> Likeness:
        assert report.latitude_deg is not None
        assert report.longitude_deg is not None
        places = [trail.at(report.measured_at, report.age_error_s) for trail in self._trails.values()]
        known = [p for p in places if p is not None]
        slack_m = (report.sog_mps or 0.0) * report.age_error_s
        distances = [distance_m(p[0], p[1], report.latitude_deg, report.longitude_deg) for p in known]
        vague = slack_m > AGREE_M  # would excuse any distance
        for distance, (_, _, own_mps) in zip(distances, known, strict=True):
            other_mps = report.sog_mps
            same_speed = own_mps is None or other_mps is None or abs(own_mps - other_mps) <= AGREE_MPS
            if distance <= AGREE_M + slack_m and same_speed and not vague:
                return Likeness.AGREES
        # a platform whose place at that time is not known may be the one that echoes
        if known and len(known) == len(places) and min(distances) > APART_M + slack_m:
            return Likeness.APART
        return Likeness.UNKNOWN if vague or not known else Likeness.NEAR
