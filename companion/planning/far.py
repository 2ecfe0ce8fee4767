"""Ships too far away to steer anybody: a box with round corners answers for each in the network's place.

The box holds the ship's tube, so its distance is nowhere longer than the true one.  It answers where the push
it implies is below `FAINT` of the attraction; the network would say even less.  With a network that costs a
microsecond a row this is most of a crossing's arithmetic saved, and most of a crowded sea's.
"""

import numpy as np

from companion.config import Field
from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, IntArray, Model, Nearest, Tracks

FAINT = 1e-3  # of K_p: ten such ships on one side turn the wanted velocity by less than 0.6 degrees


def far_m(field: Field) -> float:
    """The distance from which a push is below `FAINT` K_p, from eq. (10)."""
    return float(field.delta_m + (field.k_r / (FAINT * field.k_p)) ** (1 / 3))


class Boxes:
    """Boxes around the tubes of ships that hold their course; what only a new report changes is kept."""

    def __init__(self) -> None:
        self._tracks: Tracks | None = None

    def nearest(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray | float, position_m: FloatArray
    ) -> Nearest:
        """Of the boxes around the tubes [age, `until_age_s`]; for STRAIGHT tracks within their validity.

        A position (2,), or one for each ship (n, 2); in a box the distance says no more than that.  Course
        noise below a right angle and no ship slower than its speed noise: the network's ranges.
        """
        if tracks is not self._tracks:
            self._keep(tracks)
        age = tracks.age_s(now)
        until = np.maximum(until_age_s, age)
        north, east = position_m[..., 0] - tracks.north_m, position_m[..., 1] - tracks.east_m
        along = north * self._cos + east * self._sin
        aside = east * self._cos - north * self._sin
        along -= np.clip(along, age * self._slow_mps, until * self._fast_mps)
        wide = until * self._aside_mps
        aside -= np.clip(aside, -wide, wide)
        length = np.sqrt(along * along + aside * aside)
        scale = 1.0 / np.maximum(length, 1e-9)
        away = np.empty((len(tracks), 2))
        away[:, 0] = (along * self._cos - aside * self._sin) * scale
        away[:, 1] = (along * self._sin + aside * self._cos) * scale
        return Nearest(length - self._round_m, away)

    def _keep(self, tracks: Tracks) -> None:
        self._tracks = tracks
        self._cos, self._sin = np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)
        self._slow_mps = (tracks.sog_mps - tracks.speed_noise_mps) * np.cos(tracks.course_noise_rad)
        self._fast_mps = tracks.sog_mps + tracks.speed_noise_mps
        self._aside_mps = self._fast_mps * np.sin(tracks.course_noise_rad)
        hull_m = np.hypot(
            np.maximum(tracks.bow_m, tracks.stern_m), np.maximum(tracks.port_m, tracks.starboard_m)
        )
        self._round_m = hull_m + tracks.position_error_m


def playable(tracks: Tracks, age_s: FloatArray, near: BoolArray) -> IntArray:
    """Rows of ships to play forward: those near on a straight course, and all with learned bounds.

    Not those whose sets are expensive (turning), nor those whose bounds have ended.
    """
    learned = (tracks.model == Model.KITE) | (tracks.model == Model.BOX)
    matters = ((tracks.model == Model.STRAIGHT) & near) | learned
    return np.flatnonzero(matters & (age_s < tracks.validity_s))
