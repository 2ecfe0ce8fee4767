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

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from enum import Enum

from companion.instant import Instant, after, elapsed_s
from companion.messages import ContactReport, OwnPosition, Source
from companion.picture.area import distance_m

AGREE_M = 15.0  # two GNSS antennas on one hull, and a second's way between samples
APART_M = 60.0
AGREE_MPS = 1.0
RATE_REPORTS, RATE_S = 8, 10.0
WAY_REPORTS, WAY_M = 5, 100.0
DOUBT_S = 12.0
GENUINE = 3
REVOKE = 2
_SAMPLE_GAP_S = 0.2
_STALE_S = 2.0
_RESENT_S = 0.6  # gateways pass a report twice within 0.5 s
_SAMPLES = 400


class Likeness(Enum):
    """How a report compares with our own platforms."""

    AGREES = 1
    UNSURE = 0
    APART = -1


@dataclass(slots=True)
class Evidence:
    """What speaks for and against one MMSI being our own."""

    agreements: deque[Instant] = field(default_factory=lambda: deque(maxlen=RATE_REPORTS))
    in_a_row: int = 0
    measured_at: Instant = Instant(-(2**62))
    began_at: tuple[float, float] = (0.0, 0.0)
    apart: int = 0
    genuine: bool = False
    confirmed: bool = False
    doubted: bool = False
    hidden_until: Instant | None = None

    def hides(self, now: Instant) -> bool:
        """Whether the contact has no row at `now`."""
        return self.confirmed or (self.hidden_until is not None and now < self.hidden_until)


@dataclass(slots=True)
class _Trail:
    """Where one platform was: a bounded ring of samples, strictly later each."""

    stamps: list[Instant] = field(default_factory=list)
    samples: list[OwnPosition] = field(default_factory=list)

    def add(self, own: OwnPosition) -> None:
        if self.stamps and own.stamp < self.stamps[-1]:
            self.stamps.clear()  # the clock was set back: what went before means nothing now
            self.samples.clear()
        if self.stamps and elapsed_s(self.stamps[-1], own.stamp) < _SAMPLE_GAP_S:
            return
        self.stamps.append(own.stamp)
        self.samples.append(own)
        if len(self.stamps) > _SAMPLES:
            del self.stamps[: _SAMPLES // 2], self.samples[: _SAMPLES // 2]

    def at(self, t: Instant, error_s: float) -> tuple[float, float, float | None] | None:
        """Latitude, longitude and speed at `t`, or as near to it as the error of `t` allows.

        None when no sample is near in time.
        """
        if self.stamps:
            first, last = self.stamps[0], self.stamps[-1]
            t = max(t, min(first, after(t, error_s))) if t < first else min(t, max(last, after(t, -error_s)))
        i = bisect_left(self.stamps, t)
        near = [s for s in self.samples[max(i - 1, 0) : i + 1] if abs(elapsed_s(s.stamp, t)) <= _STALE_S]
        if not near:
            return None
        first, last = near[0], near[-1]
        span_s = elapsed_s(first.stamp, last.stamp)
        if span_s <= 0.0 or abs(last.longitude_deg - first.longitude_deg) > 180.0:
            return last.latitude_deg, last.longitude_deg, _speed_mps(last)
        part = elapsed_s(first.stamp, t) / span_s
        return (
            first.latitude_deg + part * (last.latitude_deg - first.latitude_deg),
            first.longitude_deg + part * (last.longitude_deg - first.longitude_deg),
            _speed_mps(last),
        )


class EchoWatch:
    """Knows where our platforms were, and weighs reports against it."""

    def __init__(self, own_mmsi: int) -> None:
        self._own_mmsi = own_mmsi
        self._trails: dict[Source, _Trail] = {}

    def observe_own(self, own: OwnPosition) -> None:
        """A position of one of our platforms."""
        if -90.0 <= own.latitude_deg <= 90.0 and -180.0 <= own.longitude_deg <= 180.0:
            self._trails.setdefault(own.source, _Trail()).add(own)

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
        elif not evidence.confirmed:
            evidence.in_a_row = 0
            evidence.agreements.clear()

    def _agrees(self, evidence: Evidence, report: ContactReport) -> None:
        evidence.apart = 0
        if evidence.confirmed or evidence.genuine:
            return
        seen = evidence.agreements
        if abs(elapsed_s(evidence.measured_at, report.measured_at)) < _RESENT_S:
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
        for distance, (_, _, own_mps) in zip(distances, known, strict=True):
            other_mps = report.sog_mps
            same_speed = own_mps is None or other_mps is None or abs(own_mps - other_mps) <= AGREE_MPS
            # a time so vague that it would excuse any distance is no evidence
            if distance <= AGREE_M + slack_m <= 2 * AGREE_M and same_speed:
                return Likeness.AGREES
        # a platform whose place at that time is not known may be the one that echoes
        if known and len(known) == len(places) and min(distances) > APART_M + slack_m:
            return Likeness.APART
        return Likeness.UNSURE


def _speed_mps(own: OwnPosition) -> float | None:
    if own.velocity_ned_mps is None:
        return None
    north, east, _ = own.velocity_ned_mps
    return float((north**2 + east**2) ** 0.5)
