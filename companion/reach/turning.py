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
from typing import NamedTuple

import numpy as np

from companion.messages import FloatArray, IntArray, Tracks
from companion.reach.arc_sets import ArcSets
from companion.reach.arcs import Affine, Arcs, ComplexArray, Points
from companion.reach.hull import Corners, with_hull, wrap
from companion.reach.interface import Distances
from companion.reach.kernel import Kernel
from companion.reach.support import known_turn

SLAB_S = 10.0
MOST_SLABS = 40
APART_RAD = 0.01  # between neighbouring tangents, so that they cross well
ROUNDING_S = 1e-6  # an age this close to a whole second is that second
QUARTER = np.pi / 2


class Turn(NamedTuple):
    """One contact's numbers; a key, so that its slabs are computed once a second at most."""

    course: float
    speed: float
    speed_noise: float
    course_noise: float
    rate: float
    rate_error: float
    heading: float
    heading_error: float
    bow: float
    stern: float
    port: float
    starboard: float
    position_error: float

    def course_limits(self, s: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest course at s."""
        low = self.course - self.course_noise + (self.rate - self.rate_error) * np.asarray(s)
        return low, self.course + self.course_noise + (self.rate + self.rate_error) * np.asarray(s)


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

    Inside the union the distance is minus the depth in the deepest slab: at least the true depth's sign.
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


@dataclass(frozen=True, slots=True)
class PolygonMotion:
    """Convex polygons by their tangents: `angle` (K, n) ascending within one turn, `corner` (K, n)."""

    angle: FloatArray
    corner: ComplexArray

    @classmethod
    def of_tangents(cls, angle_rad: FloatArray, support: FloatArray) -> "PolygonMotion":
        """From the tangents' angles and supports, neighbours more than 0 and less than pi apart."""
        width = np.diff(angle_rad, axis=0, append=angle_rad[:1] + 2 * np.pi)
        along = (np.roll(support, -1, axis=0) - support * np.cos(width)) / np.sin(width)
        return cls(angle_rad, np.exp(1j * angle_rad) * (support + 1j * along))

    def breaks(self) -> FloatArray:
        """See `hull.Motion`."""
        return self.angle

    def part(self, angle_rad: FloatArray) -> IntArray:
        """See `hull.Motion`: the corner after the tangent before the angle."""
        past = np.remainder(angle_rad - self.angle[0], 2 * np.pi)
        return np.asarray((past[None] >= (self.angle - self.angle[0])[:, None]).sum(axis=0) - 1)

    def pieces(self, part: IntArray) -> tuple[Points, Affine]:
        """See `hull.Motion`."""
        centre = np.take_along_axis(self.corner, part, axis=0)
        still, flat = np.zeros(part.shape, dtype=np.complex128), np.zeros(part.shape)
        return (centre, still, still), (flat, flat, flat)


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
    angle = _tangents(turn, a, b)
    motion = PolygonMotion.of_tangents(angle, swept_support(turn, a, b, angle))
    ahead = np.array((turn.bow, -turn.stern, -turn.stern, turn.bow))
    right = np.array((turn.starboard, turn.starboard, -turn.port, -turn.port))
    azimuth = np.arctan2(right, ahead)[:, None] + turn.heading + turn.rate * 0.5 * (a + b)
    swing = turn.heading_error + turn.rate_error * b + abs(turn.rate) * 0.5 * (b - a)
    length = np.repeat(np.hypot(ahead, right)[:, None], count, axis=1)
    drift = max(turn.speed_noise - turn.speed, 0.0) * b  # astern any way: a disc
    rounding = (turn.speed + turn.speed_noise) * ROUNDING_S
    margin = turn.position_error + drift + rounding
    return with_hull(motion, Corners(length, azimuth, known_turn(swing)), margin)


def swept_support(turn: Turn, a: FloatArray, b: FloatArray, angle: FloatArray) -> FloatArray:
    """(K, S) support of the antenna's motion over each slab [a, b] in the directions `angle` (K, S)."""
    slow, fast = max(turn.speed - turn.speed_noise, 0.0), turn.speed + turn.speed_noise
    all_before, forward_before = _cosine_integrals(turn, np.zeros_like(a), a, angle)
    _, forward = _cosine_integrals(turn, a, b, angle)
    # a speed takes its bound by the sign of the cosine: slow * C + (fast - slow) * max(C, 0)
    return slow * all_before + (fast - slow) * forward_before + fast * forward


def _cosine_integrals(
    turn: Turn, start: FloatArray, end: FloatArray, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(K, S) integrals over [start, end] of C and of max(C, 0).

    C(s) is the largest cosine between the direction `angle` and the courses possible at s: 1 inside
    their range, else the cosine to its nearer end, which moves at a constant rate.  Between the times
    where C changes its form or sign the integral is elementary.
    """
    s0, s1 = start[:, None], end[:, None]
    beta = angle[..., None]
    times = [np.broadcast_to(s, (*angle.shape, 1)) for s in (s0, s1)]
    rates = (turn.rate - turn.rate_error, turn.rate + turn.rate_error)
    # once an end has gone round, any course counts as possible
    known_s = 2 * np.pi / max(abs(rates[0]), abs(rates[1]), 1e-12)
    times.append(np.broadcast_to(np.clip(known_s, s0, s1), times[0].shape))
    for limit, rate in zip(turn.course_limits(0.0), rates, strict=True):
        times.append(_crossings(limit - beta, rate, QUARTER, s0, 5))
    times.append(_crossings(turn.course - beta - np.pi, turn.rate, 2 * np.pi, s0, 2))
    cuts = np.sort(np.clip(np.concatenate(times, axis=-1), s0, s1), axis=-1)
    length = np.diff(cuts, axis=-1)
    s = cuts[..., :-1] + 0.5 * length
    beside = wrap(beta - turn.course - turn.rate * s)
    inside = (np.abs(beside) <= turn.course_noise + turn.rate_error * s) | (s >= known_s)
    low, high = turn.course_limits(s)
    cosine = np.where(inside, 1.0, np.cos(np.where(beside > 0, beta - high, low - beta)))
    # the mean of a cosine over an interval is its middle value times sinc of the half width
    swing = np.where(beside > 0, rates[1], rates[0]) * length
    part = length * np.where(inside, 1.0, cosine * np.sinc(swing / (2 * np.pi)))
    return part.sum(axis=-1), np.where(cosine > 0, part, 0.0).sum(axis=-1)


def _crossings(offset: FloatArray, rate: float, every: float, start: FloatArray, count: int) -> FloatArray:
    """(..., count) the first times after `start` where offset + rate s is a multiple of `every`."""
    if rate == 0:
        return np.broadcast_to(start, (*offset.shape[:-1], 1))
    at_start = (offset + rate * start) / every
    first = np.ceil(at_start) if rate > 0 else np.floor(at_start)
    steps = np.arange(count) * (1.0 if rate > 0 else -1.0)
    return np.asarray(((first + steps) * every - offset) / rate, dtype=np.float64)


def _tangents(turn: Turn, a: FloatArray, b: FloatArray) -> FloatArray:
    """(K, S) directions of the tangents: dense ahead and abeam of all courses the ship may have had."""
    low, high = turn.course_limits(b)
    first_low, first_high = turn.course_limits(0.0)
    lowest, highest = np.minimum(low, first_low), np.maximum(high, first_high)
    middle = 0.5 * (lowest + highest)
    ahead = np.linspace(lowest, highest, 20)
    starboard = np.concatenate((np.linspace(first_high + 0 * b, high, 8), turn.course_limits(a)[1][None]))
    port = np.concatenate((np.linspace(first_low + 0 * b, low, 8), turn.course_limits(a)[0][None]))
    astern = np.linspace(turn.course + 0 * b, turn.course + turn.rate * b, 4) + np.pi
    around = middle + np.arange(-4, 4)[:, None] * (np.pi / 4)
    every = np.concatenate((ahead, starboard + QUARTER, port - QUARTER, astern, around))
    room = APART_RAD * len(every)
    beside = np.sort(np.clip(wrap(every - middle), -np.pi, np.pi - room), axis=0)
    shift = APART_RAD * np.arange(len(every))[:, None]
    apart = np.maximum.accumulate(beside - shift, axis=0)
    return np.asarray(middle + shift + apart, dtype=np.float64)


def _still(arcs: Arcs, kernel: Kernel) -> ArcSets:
    nothing = np.zeros(len(arcs.column))
    return ArcSets(arcs, nothing, nothing, kernel)
