"""New reports against what the old ones foretold: the argument that an old way out stays clear.

A ship whose report was foretold is in its old set and in its new one, so what was clear of the old set
stays clear of the ship.  A ship never heard before, one that is larger than it was thought to be, or one
that left its declared bounds was not foretold, and nothing follows from its old set.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from companion.instant import Instant
from companion.messages import BoolArray, FloatArray, IntArray, Model, Tracks
from companion.reach import at
from companion.reach.shapes import only

ROUNDING_M = 1e-6
HULL = ("bow_m", "stern_m", "port_m", "starboard_m")


@dataclass(frozen=True, slots=True)
class Foretold:
    """`holds`: every ship of the new picture is also where the old one said."""

    holds: bool
    strays: IntArray  # (k,) MMSI of ships that left their declared bounds


def foretold(before: Tracks, after: Tracks) -> Foretold:
    """The new picture held against the old one."""
    _, old, new = np.intersect1d(_single(before), _single(after), return_indices=True)
    old, new = _rows(before)[old], _rows(after)[new]
    same = _same(before, old, after, new)
    renewed = ~same & (after.measured_at_ns[new] > before.measured_at_ns[old])
    old_renewed, new_renewed = old[renewed], new[renewed]
    known = len(new) == len(after) and bool((same | renewed).all())
    if not len(new_renewed):
        return Foretold(known, np.zeros(0, dtype=np.int64))
    elapsed_s = (after.measured_at_ns[new_renewed] - before.measured_at_ns[old_renewed]) * 1e-9
    believed = elapsed_s <= before.validity_s[old_renewed]
    strays = believed & _strays(before, old_renewed, after, new_renewed)
    grown = ~_equal(before.draught_m[old_renewed], after.draught_m[new_renewed])
    for side in HULL:
        grown |= getattr(after, side)[new_renewed] > getattr(before, side)[old_renewed] + ROUNDING_M
    holds = known and bool((believed & ~strays & ~grown).all())
    return Foretold(holds, after.mmsi[new_renewed[strays]])


def _strays(before: Tracks, old: IntArray, after: Tracks, new: IntArray) -> BoolArray:
    """(m,) whether the new report lies outside the old bounds, both reports' errors granted."""
    out = _is_outside(before, old, after, new)
    moves = before.model[old] == Model.STRAIGHT
    speed = np.abs(after.sog_mps[new] - before.sog_mps[old])
    out |= moves & (speed > before.speed_noise_mps[old] + after.speed_noise_mps[new])
    moves &= after.model[new] == Model.STRAIGHT
    course = before.course_noise_rad[old] + after.course_noise_rad[new]
    out |= moves & (_between(after.cog_rad[new], before.cog_rad[old]) > course)
    heading = before.heading_error_rad[old] + after.heading_error_rad[new]
    out |= moves & (_between(after.heading_rad[new], before.heading_rad[old]) > heading)
    return out


def _is_outside(before: Tracks, old: IntArray, after: Tracks, new: IntArray) -> BoolArray:
    """(m,) whether the antenna is where the old report's set, without the hull, does not reach."""
    elapsed_s = (after.measured_at_ns[new] - before.measured_at_ns[old]) * 1e-9
    error_m = before.position_error_m[old] + after.position_error_m[new]
    run_m = np.where(before.model[old] == Model.DISC, 0.0, before.sog_mps[old] * elapsed_s)
    north = after.north_m[new] - before.north_m[old] - run_m * np.cos(before.cog_rad[old])
    east = after.east_m[new] - before.east_m[old] - run_m * np.sin(before.cog_rad[old])
    # the straight prediction is in every model's set but a turning ship's: near it nothing need be asked
    near = (np.hypot(north, east) <= error_m) & (before.model[old] != Model.TURNING)
    outside = np.zeros(len(old), dtype=np.bool_)
    far = np.flatnonzero(~near)
    if not len(far):
        return outside
    none = np.zeros(len(far))
    points = replace(
        only(before, old[far]),
        bow_m=none,
        stern_m=none,
        port_m=none,
        starboard_m=none,
        position_error_m=error_m[far],
        # each ship has its own instant: the old report is moved to it, and asked for at time zero
        measured_at_ns=before.measured_at_ns[old[far]] - after.measured_at_ns[new[far]],
    )
    place = np.column_stack((after.north_m[new[far]], after.east_m[new[far]]))
    outside[far] = at(points, Instant(0)).nearest(place).distance_m > ROUNDING_M
    return outside


def _equal(a: FloatArray, b: FloatArray) -> BoolArray:
    """(m,) the same, or both not known."""
    return np.asarray((a == b) | ((a != a) & (b != b)))  # noqa: PLR0124 - not a number is not itself


def _between(a_rad: FloatArray, b_rad: FloatArray) -> FloatArray:
    """Angle between directions, 0 to pi."""
    return np.abs(np.remainder(a_rad - b_rad + np.pi, 2 * np.pi) - np.pi)


def _rows(tracks: Tracks) -> IntArray:
    """Rows of ships with one place; one MMSI in two places foretells nothing."""
    _, first, count = np.unique(tracks.mmsi, return_index=True, return_counts=True)
    rows: IntArray = first[count == 1]
    return rows


def _single(tracks: Tracks) -> IntArray:
    return tracks.mmsi[_rows(tracks)]


def _same(before: Tracks, old: IntArray, after: Tracks, new: IntArray) -> BoolArray:
    """(m,) whether nothing of a row has changed."""
    same = np.ones(len(old), dtype=np.bool_)
    for column in fields(Tracks):
        a, b = getattr(before, column.name), getattr(after, column.name)
        if column.name in ("revision", "names", "mmsi"):
            continue
        if column.name == "spread_m":
            if a.shape[1] != b.shape[1]:
                same &= (after.model[new] < Model.KITE) & (before.model[old] < Model.KITE)
            else:
                same &= (a[old] == b[new]).all(axis=(1, 2))
            continue
        same &= _equal(a[old], b[new])
    return same
