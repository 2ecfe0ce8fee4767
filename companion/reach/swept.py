"""How far a turning ship's antenna can get in a direction: integrals of cosines, in closed form.

At age s the course is anywhere in an interval that widens and swings at constant rates.  With C(s)
the largest cosine between a direction b and those courses, and speeds from `slow` to `fast`,

    h_tau(b) = integral from 0 to tau of  slow C(s) + (fast - slow) max(C(s), 0)
"""

from typing import NamedTuple

import numpy as np

from companion.messages import FloatArray
from companion.reach.hull import wrap

APART_RAD = 0.01  # between neighbouring tangents, so that they cross well
ASTERN_RAD = 1e-6  # within this of astern a direction counts as astern, whatever rounding says
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


def tangents(turn: Turn, a: FloatArray, b: FloatArray) -> FloatArray:
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
    beside = every - middle
    beside -= 2 * np.pi * np.floor((beside + np.pi + ASTERN_RAD) / (2 * np.pi))  # astern is -pi, never pi
    beside = np.sort(np.clip(beside, -np.pi, np.pi - room), axis=0)
    shift = APART_RAD * np.arange(len(every))[:, None]
    apart = np.maximum.accumulate(beside - shift, axis=0)
    return np.asarray(middle + shift + apart, dtype=np.float64)
