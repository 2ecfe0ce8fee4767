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


def clearing_until_age_s(
    tracks: Tracks,
    now: Instant,
    position_m: FloatArray,
    goal_m: FloatArray,
    max_speed_mps: float,
    field: Field,
    planner: Planner,
) -> FloatArray:
    """(n,) age up to which each ship's tube is taken; `position_m` and `goal_m` are (2,) or (n, 2)."""
    age = tracks.age_s(now)
    cos, sin = np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)

    def lateral(point: FloatArray) -> FloatArray:
        """Distance to starboard of each ship's course line."""
        side_m: FloatArray = (point[..., 1] - tracks.east_m) * cos - (point[..., 0] - tracks.north_m) * sin
        return side_m

    here, there = lateral(position_m), lateral(goal_m)
    reach_m = _half_width_m(tracks)
    spread_m = tracks.sog_mps * (age + SHORTEST_S) * np.sin(tracks.course_noise_rad)
    half_width = reach_m + spread_m + tracks.position_error_m + field.delta_m
    side = np.where(there >= 0, 1.0, -1.0)
    to_clear_m = np.maximum(half_width - side * here, 0.0)
    clear_s = planner.clearing_margin * to_clear_m / max_speed_mps
    return _within_validity(tracks, age, age + np.clip(clear_s, SHORTEST_S, field.horizon_s))


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
