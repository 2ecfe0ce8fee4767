"""The ships of many trials at once: what was reported of them, and where they truly are.

Rows are trial by trial, equally many ships in each, so that one table serves a whole batch.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.instant import Instant, elapsed_s, instant
from companion.messages import FloatArray, Model, Tracks
from sitl.sailing import Sailing
from sitl.studies.case import Crossing
from sitl.traffic import Noise
from sitl.truth import true_tracks

SPARE_M = 300.0  # of a stream, beyond what can come near the crossing line


@dataclass(frozen=True, slots=True)
class Ships:
    """Of m trials, n = m * k ships.  `reported` are the tracks as heard; `truth(t)` is where they are."""

    trials: int
    per_trial: int
    reported: Tracks
    sailing: Sailing
    since: Instant  # when the reports were true
    hulls: FloatArray  # (n, 4) bow, stern, port, starboard from the reported point

    def truth(self, t: Instant) -> Tracks:
        """All hulls at `t`, every bound zero."""
        since_s = elapsed_s(self.since, t)
        reported = self.reported
        start = np.column_stack((reported.north_m, reported.east_m))
        return true_tracks(
            t,
            mmsi=reported.mmsi,
            position_m=start + self.sailing.run_m(since_s),
            course_rad=self.sailing.course_rad(since_s),
            speed_mps=self.sailing.speed_mps(since_s),
            hulls=self.hulls,
            names=(),
        )


def draw(case: Crossing, seed: int, trials: range) -> Ships:
    """The ships of these trials; a trial's ships depend on `seed` and its number alone."""
    lanes = [_lane(case)] * 2
    east = np.concatenate([np.full(len(along), case.lanes_m[lane]) for lane, along in enumerate(lanes)])
    course = np.concatenate([np.full(len(along), case.lane_course_rad(i)) for i, along in enumerate(lanes)])
    sails = np.cos(course)  # +1 north, -1 south
    k = len(east)
    noise = Noise(case.readings.noise, case.speed_noise_mps, case.course_noise_rad)
    north, slow, turned, hold_s = [], [], [], math.inf
    for trial in trials:
        rng = np.random.default_rng((seed, trial))
        shift = np.repeat(rng.uniform(-case.spread_m, case.spread_m, 2), [len(a) for a in lanes])
        north.append(sails * (np.concatenate(lanes) + shift))
        hold_s, speed, angle = noise.draw(k, case.under_way_s + case.information_age_s, rng)
        slow.append(speed)
        turned.append(angle)
    m = len(trials)
    nominal = np.tile(course, m)
    sailing = Sailing(
        hold_s, case.ship_speed_mps + np.concatenate(slow), nominal[:, None] + np.concatenate(turned)
    )
    half = np.array((case.length_m, case.length_m, case.beam_m, case.beam_m)) / 2
    since = instant(case.information_s - case.information_age_s)
    whole = np.tile(half, (m * k, 1))
    modelled = whole if case.readings.obstacle == "hull" else np.zeros_like(whole)
    place = np.column_stack((np.concatenate(north), np.tile(east, m)))
    return Ships(m, k, _reported(case, place, nominal, modelled, since), sailing, since, whole)


def without_uncertainty(tracks: Tracks) -> Tracks:
    """The same reports, believed to the letter."""
    zero = np.zeros(len(tracks))
    return replace(tracks, speed_noise_mps=zero, course_noise_rad=zero, heading_error_rad=zero)


def _lane(case: Crossing) -> FloatArray:
    """Places along the lane's course when the reports were true, before the trial's shift."""
    v = case.ship_speed_mps
    meets_m = -v * (case.meets_s + case.information_age_s)
    if case.readings.ships == "convoy":
        return np.asarray(meets_m + ((case.per_lane - 1) / 2 - np.arange(case.per_lane)) * case.spacing_m)
    fast = v + case.speed_noise_mps
    last_m = -fast * (case.under_way_s + case.information_age_s) - SPARE_M - case.spread_m
    first_m = SPARE_M + case.spread_m - (v - case.speed_noise_mps) * case.information_age_s
    behind = math.ceil((meets_m - last_m) / case.spacing_m)
    ahead = math.ceil((first_m - meets_m) / case.spacing_m)
    return np.asarray(meets_m + np.arange(ahead, -behind - 1, -1) * case.spacing_m)


def _reported(
    case: Crossing, place: FloatArray, course: FloatArray, hulls: FloatArray, since: Instant
) -> Tracks:
    n = len(course)
    exact = true_tracks(
        since,
        mmsi=np.arange(n, dtype=np.int64) + 1,
        position_m=place,
        course_rad=course,
        speed_mps=np.full(n, case.ship_speed_mps),
        hulls=hulls,
        names=(),
    )
    return replace(
        exact,
        speed_noise_mps=np.full(n, case.speed_noise_mps),
        course_noise_rad=np.full(n, case.course_noise_rad),
        heading_error_rad=np.full(n, case.course_noise_rad),  # a hull points where it goes
        model=np.full(n, Model.STRAIGHT, dtype=np.int64),
    )
