"""How far ahead each ship's reachable tube is taken.

`paper`: [t, t0 + T] for every ship, T the configured horizon.
`clearing`: [t, t + margin * time to clear the ship's corridor at full speed].  The corridor is the
strip the ship sweeps along its course, as wide as its hull and its course noise make it by then.
A ship is only dangerous until the vehicle has crossed its strip; looking further makes a wall of
endless traffic that nobody can pass.
"""

import numpy as np

from companion.config import Field, Planner
from companion.instant import Instant
from companion.messages import FloatArray, Tracks

SHORTEST_S = 10.0  # a ship beside the vehicle still gets this much foresight


def paper_until_age_s(tracks: Tracks, field: Field) -> FloatArray:
    """(n,) T for every ship: the tube ends at the report's time plus T."""
    return np.full(len(tracks), field.horizon_s)


class Corridors:
    """Of ships on their courses; what only a new report changes is kept."""

    def __init__(self) -> None:
        self._tracks: Tracks | None = None

    def clearing_until_age_s(
        self,
        tracks: Tracks,
        now: Instant,
        position_m: FloatArray,
        goal_m: FloatArray,
        max_speed_mps: float,
        field: Field,
        planner: Planner,
    ) -> FloatArray:
        """(n,) age up to which each ship's tube is taken; `position_m` and `goal_m` are (2,) or (n, 2)."""
        self._keep(tracks)
        age = tracks.age_s(now)
        here, there = self._lateral(position_m), self._lateral(goal_m)
        spread_m = tracks.sog_mps * (age + SHORTEST_S) * self._sin_noise
        half_width = self._half_width_m + spread_m + tracks.position_error_m + field.delta_m
        side = np.where(there >= 0, 1.0, -1.0)
        to_clear_m = np.maximum(half_width - side * here, 0.0)
        clear_s = planner.clearing_margin * to_clear_m / max_speed_mps
        return _within_validity(tracks, age, age + np.clip(clear_s, SHORTEST_S, field.horizon_s))

    def courses(self, tracks: Tracks) -> FloatArray:
        """(n, 2) unit vectors."""
        self._keep(tracks)
        return self._course

    def _lateral(self, point: FloatArray) -> FloatArray:
        """Distance to starboard of each ship's course line."""
        assert self._tracks is not None
        north, east = point[..., 0] - self._tracks.north_m, point[..., 1] - self._tracks.east_m
        side_m: FloatArray = east * self._cos - north * self._sin
        return side_m

    def _keep(self, tracks: Tracks) -> None:
        if tracks is not self._tracks:
            self._tracks = tracks
            self._cos, self._sin = np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)
            self._course = np.column_stack((self._cos, self._sin))
            self._half_width_m = _half_width_m(tracks)
            self._sin_noise = np.sin(tracks.course_noise_rad)


def _half_width_m(tracks: Tracks) -> FloatArray:
    """(n,) how far each hull reaches to the side of its course, turned by its heading error at most."""
    off = np.abs(np.remainder(tracks.heading_rad - tracks.cog_rad + np.pi, 2 * np.pi) - np.pi)
    along = np.maximum(tracks.bow_m, tracks.stern_m)
    across = np.maximum(tracks.port_m, tracks.starboard_m)
    turned = np.minimum(np.minimum(off, np.pi - off) + tracks.heading_error_rad, np.pi / 2)
    half_width: FloatArray = np.hypot(along, across) * np.sin(
        np.minimum(turned + np.arctan2(across, along), np.pi / 2)
    )
    return half_width


def _within_validity(tracks: Tracks, age: FloatArray, until: FloatArray) -> FloatArray:
    """No farther than the bounds are believed: beyond that a set is everywhere, and says nothing."""
    capped: FloatArray = np.minimum(until, np.maximum(age, tracks.validity_s))
    return capped
