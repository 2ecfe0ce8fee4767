"""The one place that turns a report into stated bounds.

A Kalman covariance is not a bound, so nothing of the filter comes in here: the set is anchored at
the newest believed report itself.  What is assumed, in the order of the code:

- the position is within `position_error_m` (flagged accurate) or `coarse_position_error_m` (not
  flagged), plus AIS's quantisation, plus the way the ship can make in the time stamp's error;
- a ship under way keeps course and speed within `course_noise_rad` and `speed_noise_mps`, free to
  vary at every instant, for `validity_s` after the report (the paper's ship);
- one whose sensor of turn reports `turning_above_radps` or more may go on turning at that rate, within
  `turn_rate_error_radps`, or end the turn at any moment;
- a ship slower than `slow_below_mps` keeps its speed within the same noise for the same time, but
  may go any way: a small growing disc, because a course at such speeds means nothing;
- without speed, or without course at speed, anything up to the top speed: a disc;
- from `validity_s` on anything up to the top speed, whatever was reported: every set then grows on
  all sides at that speed, and the hull may lie any way;
- with a bounds file, a ship under way strays from its straight prediction as far as recorded ships did
  (`learned.py`), for ten minutes; a ship at rest drifts as far as they did;
- a hull never reported is the configured one of its class with the antenna anywhere on it;
- a heading is within `heading_error_rad` and turns with the course; without one the hull may lie
  any way, as it may for everything that is a disc.  The course does not stand in for a heading.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from companion import config
from companion.messages import SPREAD_AGES_S, ContactReport, FloatArray, Hull, Model, TargetKind
from companion.picture.learned import LearnedBounds

# 1/10000 minute in latitude and longitude, half a step each: 0.0926 m times sqrt 2
QUANTISATION_M = 0.131


class Bounds(NamedTuple):
    """One row of `Tracks` but for the position; same names, units and meaning."""

    cog_rad: float
    sog_mps: float
    heading_rad: float
    bow_m: float
    stern_m: float
    port_m: float
    starboard_m: float
    position_error_m: float
    speed_noise_mps: float
    course_noise_rad: float
    heading_error_rad: float
    disc_speed_mps: float
    top_speed_mps: float
    validity_s: float
    model: float  # of `Model`; a float so that a row is one array
    turn_rate_radps: float = 0.0
    turn_rate_error_radps: float = 0.0


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What the configuration says of ships, turned into bounds."""

    contacts: config.Contacts
    learned: LearnedBounds | None = None

    def of(
        self, report: ContactReport, hull: Hull | None, kind: TargetKind, spread_m: FloatArray | None = None
    ) -> Bounds:
        """The bounds that `report` carries; `spread_m` (K, 3) are those learned, if any."""
        ship = self.contacts
        slow = self.is_slow(report)
        straight = not slow and report.sog_mps is not None and report.cog_rad is not None
        top_mps = self.top_speed_mps(report)
        kept_mps = (report.sog_mps or 0.0) + ship.speed_noise_mps if slow or straight else top_mps
        heading_error_rad = ship.heading_error_rad + ship.course_noise_rad
        extent = hull or self._assumed_hull(kind)
        bounds = Bounds(
            cog_rad=report.cog_rad or 0.0,
            sog_mps=report.sog_mps or 0.0,
            heading_rad=report.heading_rad or 0.0,
            bow_m=extent.bow_m,
            stern_m=extent.stern_m,
            port_m=extent.port_m,
            starboard_m=extent.starboard_m,
            position_error_m=self.position_error_m(report) + QUANTISATION_M + kept_mps * report.age_error_s,
            speed_noise_mps=ship.speed_noise_mps,
            course_noise_rad=ship.course_noise_rad,
            heading_error_rad=min(heading_error_rad, math.pi)
            if straight and report.heading_rad is not None
            else math.pi,
            disc_speed_mps=kept_mps,
            top_speed_mps=top_mps,
            # the report may be older than it says, and then its bounds end sooner
            validity_s=max(ship.validity_s - report.age_error_s, 0.0),
            model=float(Model.STRAIGHT if straight else Model.DISC),
        )
        if straight and self.is_turning(report):
            return self._as_turning(bounds, report)
        if self.learned is None:
            return bounds
        if spread_m is None or not (slow or straight):
            return bounds
        learned = self._as_learned(bounds, report, spread_m)
        # a ship at rest is where it is: its speed foretells nothing
        return learned._replace(sog_mps=0.0, cog_rad=0.0, model=float(Model.BOX)) if slow else learned

    def _as_learned(self, bounds: Bounds, report: ContactReport, spread_m: FloatArray) -> Bounds:
        """A learned row; its noise columns say what the spread at the first age amounts to."""
        assert self.learned is not None
        first_s = SPREAD_AGES_S[0]
        ahead_m, astern_m, abeam_m = (float(x) for x in spread_m[0])
        way_m = max(bounds.sog_mps * first_s, 1.0)
        return bounds._replace(
            speed_noise_mps=max(ahead_m, astern_m) / first_s,
            course_noise_rad=min(math.atan2(abeam_m, way_m), math.radians(89.0)),
            heading_error_rad=math.pi,
            validity_s=max(SPREAD_AGES_S[-1] - report.age_error_s, 0.0),
            model=float(self.learned.model),
        )

    def _as_turning(self, bounds: Bounds, report: ContactReport) -> Bounds:
        """A ship in a turn may go on turning at its rate, or end the turn at any moment.

        Believed for as long as that leaves half a circle of courses out.
        """
        assert report.turn_rate_radps is not None
        rate, error = report.turn_rate_radps, self.contacts.turn_rate_error_radps
        room_s = (math.pi - 2 * bounds.course_noise_rad) / (abs(rate) + 2 * error)
        return bounds._replace(
            validity_s=min(bounds.validity_s, math.floor(room_s)),
            model=float(Model.TURNING),
            turn_rate_radps=rate / 2,
            turn_rate_error_radps=abs(rate) / 2 + error,
        )

    def is_turning(self, report: ContactReport) -> bool:
        """Whether its sensor of turn says so; without one the report has no rate."""
        least = self.contacts.turning_above_radps
        return 0 < least <= abs(report.turn_rate_radps or 0.0)

    def is_slow(self, report: ContactReport) -> bool:
        """Too slow for its course to mean anything (and never slower than the noise can reverse)."""
        ship = self.contacts
        return report.sog_mps is not None and report.sog_mps < max(ship.slow_below_mps, ship.speed_noise_mps)

    def position_error_m(self, report: ContactReport) -> float:
        """What the sender's accuracy flag is worth."""
        return self.contacts.position_error_m if report.accurate else self.contacts.coarse_position_error_m

    def top_speed_mps(self, report: ContactReport) -> float:
        """The most this ship is ever taken to do."""
        ship = self.contacts
        return max(ship.top_speed_mps, (report.sog_mps or 0.0) + ship.speed_noise_mps)

    def _assumed_hull(self, kind: TargetKind) -> Hull:
        ship = self.contacts
        small = kind is TargetKind.CLASS_B
        length_m = ship.default_class_b_length_m if small else ship.default_length_m
        beam_m = ship.default_class_b_beam_m if small else ship.default_beam_m
        return Hull(length_m, length_m, beam_m, beam_m)
