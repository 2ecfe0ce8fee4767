"""A ship that turns: course and hull swing at a bounded rate, constant or varying.  Outer approximation.

    course(s) = th + w_th(s) + psi(s),   psi' in [w0 - dw, w0 + dw],   |w_th| <= course noise
    speed(s)  = v + w_v(s),              |w_v| <= speed noise
    heading(s) = heading + psi(s), known within the heading error

Relaxed: psi(s) may be anywhere in [(w0 - dw) s, (w0 + dw) s], whatever it was before.  Then the
velocities at s are a sector V(s), and the antenna's displacement at tau is the Aumann integral of
conv V(s) up to tau: convex, with the support, in closed form,

    h_tau(b) = integral over s of  max over V(s) of velocity . (cos b, sin b)

The tube is a union over time and not convex.  It is cut into slabs [a, b], each a convex set with
support  h_a + integral from a to b of the positive part,  which no point of the slab exceeds.  The
motion becomes a polygon of tangents in directions dense where it is round; the hull, which swings
with the course, is added exactly (`hull.with_hull`).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from companion.messages import FloatArray, Tracks
from companion.reach.arc_sets import ArcSets
from companion.reach.arcs import Arcs
from companion.reach.hull import Corners, with_hull
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel
from companion.reach.polygon import PolygonMotion
from companion.reach.support import known_turn
from companion.reach.swept import Turn, swept_support, tangents

SLAB_S = 10.0
MOST_SLABS = 40
ROUNDING_S = 1e-6  # an age this close to a whole second is that second


@dataclass(frozen=True, slots=True)
class TurningShapes:
    """The turning contacts; everything else depends on time."""

    turns: tuple[Turn, ...]
    kernel: Kernel

    def between(self, age_s: FloatArray, until_s: FloatArray) -> "TurningSets":
        """The tubes, from the whole second before `age_s` to the one after `until_s`."""
        start, end = np.floor(age_s + ROUNDING_S), np.ceil(until_s - ROUNDING_S)
        arcs = [slabs(*x) for x in zip(self.turns, start.tolist(), end.tolist(), strict=True)]
        return TurningSets(tuple(_still(a, self.kernel) for a in arcs))


@dataclass(frozen=True, slots=True)
class TurningSets:
    """Each contact's set as a union of convex slabs.  See `interface.Sets`.

    Inside, the distance is minus the depth in the deepest slab; the union may be deeper still.
    """

    slabs: tuple[ArcSets, ...]

    def distances(self, north_m: FloatArray, east_m: FloatArray, contact: int | None = None) -> Distances:
        """One point per contact (n,), or many points (m,) for one contact."""
        if contact is not None:
            one = self.slabs[contact]
            found = np.array([one.distances(north_m, east_m, k) for k in range(len(one.r1_m))])
            least = found[:, 0].argmin(axis=0)
            points = np.arange(len(north_m))
            return found[least, 0, points], found[least, 1, points], found[least, 2, points]
        out = np.empty((3, len(self.slabs)))
        for i, sets in enumerate(self.slabs):
            many = np.zeros(len(sets.r1_m))
            distance, away_north, away_east = sets.distances(many + north_m[i], many + east_m[i])
            k = int(distance.argmin())
            out[:, i] = distance[k], away_north[k], away_east[k]
        return out[0], out[1], out[2]

    def support(self, angle_rad: FloatArray, contact: int | None = None) -> FloatArray:
        """(n, k) support of the hulls of the unions; for one contact (p, k), slab by slab."""
        if contact is not None:
            return self.slabs[contact].support(angle_rad)
        return np.array([sets.support(angle_rad).max(axis=0) for sets in self.slabs])


def turning_shapes(tracks: Tracks, kernel: Kernel) -> TurningShapes:
    """What a turning contact's report says about its set."""
    columns = (
        tracks.cog_rad,
        tracks.sog_mps,
        tracks.speed_noise_mps,
        tracks.course_noise_rad,
        tracks.turn_rate_radps,
        tracks.turn_rate_error_radps,
        tracks.heading_rad,
        tracks.heading_error_rad,
        tracks.bow_m,
        tracks.stern_m,
        tracks.port_m,
        tracks.starboard_m,
        tracks.position_error_m,
    )
    return TurningShapes(tuple(Turn(*row) for row in np.column_stack(columns).tolist()), kernel)


@lru_cache(maxsize=512)
def slabs(turn: Turn, start_s: float, end_s: float) -> Arcs:
    """The tube from `start_s` to `end_s`, one convex set per slab; remembered, which no result shows."""
    count = int(np.clip(np.ceil((end_s - start_s) / SLAB_S), 1, MOST_SLABS))
    bounds = np.linspace(start_s, end_s, count + 1)
    a, b = bounds[:-1], bounds[1:]
    angle = tangents(turn, a, b)
    motion = PolygonMotion.of_tangents(angle, swept_support(turn, a, b, angle))
    ahead = np.array((turn.bow, -turn.stern, -turn.stern, turn.bow))
    right = np.array((turn.starboard, turn.starboard, -turn.port, -turn.port))
    azimuth = np.arctan2(right, ahead)[:, None] + turn.heading + turn.rate * 0.5 * (a + b)
    swing = turn.heading_error + turn.rate_error * b + abs(turn.rate) * 0.5 * (b - a)
    length = np.repeat(np.hypot(ahead, right)[:, None], count, axis=1)
    drift = max(turn.speed_noise - turn.speed, 0.0) * b  # astern any way: a disc
    turning = (abs(turn.rate) + turn.rate_error) * length.max()
    rounding = (turn.speed + turn.speed_noise + turning) * ROUNDING_S
    margin = turn.position_error + drift + rounding
    return with_hull(motion, Corners(length, azimuth, known_turn(swing)), margin)


def _still(arcs: Arcs, kernel: Kernel) -> ArcSets:
    nothing = np.zeros(len(arcs.column))
    return ArcSets(arcs, nothing, nothing, kernel)
