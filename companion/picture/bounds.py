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
- so does a ship that tells its speed but no course: a disc that grows at its speed and the noise;
- one as slow that says it is anchored, moored or aground gets no farther than `anchored_m` or `moored_m`
  (or the way it makes in a minute);
- without speed anything up to the top speed: a disc;
- from `validity_s` on anything up to the top speed, whatever was reported: every set then grows on
  all sides at that speed, and the hull may lie any way;
- with a bounds file, a ship under way strays from its straight prediction as far as recorded ships did
  (`learned.py`), for ten minutes; a ship at rest drifts as far as they did; one without a course may do
  its top speed, for the recorded ones say nothing of it;
- a hull never reported is the configured one of its class with the antenna anywhere on it;
- a heading is within `heading_error_rad` and turns with the course; without one the hull may lie
  any way, as it may for everything that is a disc.  The course does not stand in for a heading.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from companion import config
from companion.messages import SPREAD_AGES_S, BoolArray, ContactReport, FloatArray, Hull, Model, TargetKind
from companion.picture.learned import LearnedBounds
from companion.picture.said import Said

# 1/10000 minute in latitude and longitude, half a step each: 0.0926 m times sqrt 2
QUANTISATION_M = 0.131
_ANCHORED, _MOORED, _AGROUND = 1, 5, 6  # navigational status
_AGES_S = np.array(SPREAD_AGES_S)
_NEXT_AGES_S = np.append(_AGES_S[1:], _AGES_S[-1])
_STEEPEST_RAD = math.radians(89.0)


class Bounds(NamedTuple):
    """n rows of `Tracks` but for place and spread, (n,) each; same names, units and meaning."""

    cog_rad: FloatArray
    sog_mps: FloatArray
    heading_rad: FloatArray
    bow_m: FloatArray
    stern_m: FloatArray
    port_m: FloatArray
    starboard_m: FloatArray
    position_error_m: FloatArray
    speed_noise_mps: FloatArray
    course_noise_rad: FloatArray
    heading_error_rad: FloatArray
    disc_speed_mps: FloatArray
    top_speed_mps: FloatArray
    validity_s: FloatArray
    model: FloatArray  # of `Model`; floats so that all columns are one array
    turn_rate_radps: FloatArray
    turn_rate_error_radps: FloatArray


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What the configuration says of ships, turned into bounds."""

    contacts: config.Contacts
    learned: LearnedBounds | None = None

    def of(
        self, said: Said, extent_m: FloatArray, spread_m: FloatArray | None = None
    ) -> tuple[Bounds, FloatArray]:
        """The bounds that n reports of ships of these extents carry, and their spread (n, K, 3).

        `extent_m` (n, 4) is bow, stern, port, starboard.  `spread_m` (n, K, 3) are those learned, NaN where
        none is known, None without a bounds file.  In the spread returned rows of other models are 0.
        """
        ship = self.contacts
        cog, sog, heading, turn = said.cog_rad, said.sog_mps, said.heading_rad, said.turn_rate_radps
        age_error_s = said.age_error_s
        has_speed, has_course = np.isfinite(sog), np.isfinite(cog)
        slow = sog < self.slow_below_mps
        straight = ~slow & has_speed & has_course
        keeps = has_speed if self.learned is None else slow | straight
        cog, sog = np.where(has_course, cog, 0.0), np.where(has_speed, sog, 0.0)
        top = self.top_speeds_mps(sog)
        kept = np.where(keeps, sog + ship.speed_noise_mps, top)
        error_m = np.where(said.accurate > 0, ship.position_error_m, ship.coarse_position_error_m)
        one = np.ones(len(sog))
        bounds = Bounds(
            cog_rad=cog,
            sog_mps=sog,
            heading_rad=np.where(np.isfinite(heading), heading, 0.0),
            bow_m=extent_m[:, 0],
            stern_m=extent_m[:, 1],
            port_m=extent_m[:, 2],
            starboard_m=extent_m[:, 3],
            position_error_m=error_m + QUANTISATION_M + kept * age_error_s,
            speed_noise_mps=ship.speed_noise_mps * one,
            course_noise_rad=ship.course_noise_rad * one,
            heading_error_rad=np.where(straight & np.isfinite(heading), self._heading_error_rad, math.pi),
            disc_speed_mps=kept,
            top_speed_mps=top,
            # the report may be older than it says, and then its bounds end sooner
            validity_s=np.maximum(ship.validity_s - age_error_s, 0.0),
            model=np.where(straight, float(Model.STRAIGHT), float(Model.DISC)),
            turn_rate_radps=0.0 * one,
            turn_rate_error_radps=0.0 * one,
        )
        turns = straight & (abs(turn) >= ship.turning_above_radps) & (ship.turning_above_radps > 0)
        bounds = self._as_turning(bounds, turns, np.where(turns, turn, 0.0))
        if spread_m is None:
            return self._held_fast(bounds, slow, said.navigational_status)
        return self._as_learned(bounds, age_error_s, slow, straight & ~turns, spread_m)

    def _as_turning(self, bounds: Bounds, turns: BoolArray, rate: FloatArray) -> Bounds:
        """A ship in a turn may go on turning at its rate, or end the turn at any moment.

        Believed for as long as that leaves half a circle of courses out.
        """
        error = self.contacts.turn_rate_error_radps
        room_s = (math.pi - 2 * bounds.course_noise_rad) / np.maximum(abs(rate) + 2 * error, 1e-9)
        return bounds._replace(
            validity_s=np.where(turns, np.minimum(bounds.validity_s, np.floor(room_s)), bounds.validity_s),
            model=np.where(turns, float(Model.TURNING), bounds.model),
            turn_rate_radps=np.where(turns, rate / 2, 0.0),
            turn_rate_error_radps=np.where(turns, abs(rate) / 2 + error, 0.0),
        )

    def _held_fast(self, bounds: Bounds, slow: BoolArray, status: FloatArray) -> tuple[Bounds, FloatArray]:
        """Ships at anchor or berth: squares that stop growing."""
        ship = self.contacts
        moored = slow & ((status == _MOORED) | (status == _AGROUND))
        held = moored | (slow & (status == _ANCHORED))
        if not held.any():
            return bounds, np.zeros((len(slow), 0, 3))
        speed = bounds.disc_speed_mps[:, None]
        most = np.maximum(np.where(moored, ship.moored_m, ship.anchored_m)[:, None], speed * _AGES_S[0])
        # linear between the ages: from the age on after which it would be passed, all of it
        half = np.where(speed * _NEXT_AGES_S <= most, speed * _AGES_S, most) * held[:, None]
        until_s = np.where(held, np.minimum(bounds.validity_s, _AGES_S[-1]), bounds.validity_s)
        return self._at_rest(bounds._replace(validity_s=until_s), held), np.repeat(
            half[:, :, None], 3, axis=2
        )

    def _as_learned(
        self,
        bounds: Bounds,
        age_error_s: FloatArray,
        slow: BoolArray,
        straight: BoolArray,
        spread_m: FloatArray,
    ) -> tuple[Bounds, FloatArray]:
        """Learned rows; the noise columns say what the spread at the first age amounts to."""
        assert self.learned is not None
        told = np.isfinite(spread_m[:, 0, 0]) & (slow | straight)
        spread = np.where(told[:, None, None], spread_m, 0.0)
        first_s = SPREAD_AGES_S[0]
        ahead, astern, abeam = spread[:, 0].T
        sideways = np.arctan2(abeam, np.maximum(bounds.sog_mps * first_s, 1.0))
        rows = bounds._replace(
            speed_noise_mps=np.where(told, np.maximum(ahead, astern) / first_s, bounds.speed_noise_mps),
            course_noise_rad=np.where(told, np.minimum(sideways, _STEEPEST_RAD), bounds.course_noise_rad),
            heading_error_rad=np.where(told, math.pi, bounds.heading_error_rad),
            validity_s=np.where(told, np.maximum(SPREAD_AGES_S[-1] - age_error_s, 0.0), bounds.validity_s),
            model=np.where(told, float(self.learned.model), bounds.model),
        )
        return self._at_rest(rows, told & slow), spread

    @staticmethod
    def _at_rest(bounds: Bounds, rows: BoolArray) -> Bounds:
        """A ship at rest is where it is: its speed foretells nothing."""
        return bounds._replace(
            sog_mps=np.where(rows, 0.0, bounds.sog_mps),
            cog_rad=np.where(rows, 0.0, bounds.cog_rad),
            model=np.where(rows, float(Model.BOX), bounds.model),
        )

    @property
    def slow_below_mps(self) -> float:
        """Below this a course means nothing (and never slower than the noise can reverse)."""
        return max(self.contacts.slow_below_mps, self.contacts.speed_noise_mps)

    @property
    def _heading_error_rad(self) -> float:
        return min(self.contacts.heading_error_rad + self.contacts.course_noise_rad, math.pi)

    def position_error_m(self, report: ContactReport) -> float:
        """What the sender's accuracy flag is worth."""
        return self.contacts.position_error_m if report.accurate else self.contacts.coarse_position_error_m

    def top_speed_mps(self, report: ContactReport) -> float:
        """The most this ship is ever taken to do."""
        ship = self.contacts
        return max(ship.top_speed_mps, (report.sog_mps or 0.0) + ship.speed_noise_mps)

    def top_speeds_mps(self, sog_mps: FloatArray) -> FloatArray:
        """The same of many, NaN where no speed was told."""
        ship = self.contacts
        return np.maximum(
            ship.top_speed_mps, np.where(np.isfinite(sog_mps), sog_mps, 0.0) + ship.speed_noise_mps
        )

    def extent(self, hull: Hull | None, kind: TargetKind) -> Hull:
        """The hull reported, or the configured one of its class, the antenna anywhere on it."""
        if hull is not None:
            return hull
        ship = self.contacts
        small = kind is TargetKind.CLASS_B
        length_m = ship.default_class_b_length_m if small else ship.default_length_m
        beam_m = ship.default_class_b_beam_m if small else ship.default_beam_m
        return Hull(length_m, length_m, beam_m, beam_m)
