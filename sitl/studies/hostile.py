"""Planners that mean harm, or none."""

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from companion import reach
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, OwnState, Tracks
from companion.planning.guard import Intended, Velocity
from sitl.studies.bad_vehicle import polar

WANDERS_S = 2.0  # from one intention to the next
PLANNERS: tuple["PlannerKind", ...] = ("random", "adversarial", "frozen", "bow", "nan", "silent")
PlannerKind = Literal["random", "adversarial", "frozen", "bow", "nan", "silent"]
Planner = Callable[[float, OwnState, Tracks, Instant], Velocity | None]


def hostile(kind: PlannerKind, rng: np.random.Generator, speed: float) -> Planner:
    """A planner that means harm, or none."""
    fixed = polar(speed, rng)
    held: dict[str, FloatArray] = {"v": fixed}

    def random(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        if rng.random() < 0.1:
            held["v"] = polar(speed * rng.choice((0.0, 0.5, 1.0, 4.0)), rng)
        return (float(held["v"][0]), float(held["v"][1]), 0.0)

    def adversarial(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        near = reach.at(tracks, now, 10.0).nearest(own.position_m)
        k = int(near.distance_m.argmin())
        return (float(-speed * near.away[k, 0]), float(-speed * near.away[k, 1]), 0.0)

    def bow(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        north, east = _meeting(own, tracks, now, speed)
        away = math.hypot(north - own.north_m, east - own.east_m) or 1.0
        return (speed * (north - own.north_m) / away, speed * (east - own.east_m) / away, 0.0)

    def broken(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity | None:
        wild = rng.choice((math.nan, math.inf, -math.inf))
        return (float(wild), 1.0, 0.0) if rng.random() < 0.7 else adversarial(t, own, tracks, now)

    def silent(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity | None:
        return adversarial(t, own, tracks, now) if t < 60.0 else None

    def frozen(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:
        if t < 1.0:
            held["v"] = np.array(bow(t, own, tracks, now)[:2])
        return (float(held["v"][0]), float(held["v"][1]), 0.0)

    return {
        "random": random,
        "adversarial": adversarial,
        "frozen": frozen,
        "bow": bow,
        "nan": broken,
        "silent": silent,
    }[kind]


def _meeting(own: OwnState, tracks: Tracks, now: Instant, speed: float) -> tuple[float, float]:
    """Where the nearest oncoming bow can be met."""
    age = tracks.age_s(now)
    ahead = age * tracks.sog_mps + tracks.bow_m
    north = tracks.north_m + ahead * np.cos(tracks.cog_rad) - own.north_m
    east = tracks.east_m + ahead * np.sin(tracks.cog_rad) - own.east_m
    v_north, v_east = tracks.sog_mps * np.cos(tracks.cog_rad), tracks.sog_mps * np.sin(tracks.cog_rad)
    t = np.arange(0.0, 240.0, 4.0)[:, None]
    late = np.hypot(north + v_north * t, east + v_east * t) - speed * t
    met = np.where(late < 0, t, np.inf).min(axis=0)
    k = int(met.argmin())
    at = float(met[k]) if math.isfinite(met[k]) else 60.0
    return own.north_m + float(north[k] + v_north[k] * at), own.east_m + float(east[k] + v_east[k] * at)


def intending(rng: np.random.Generator, speed: float) -> Callable[[Instant, OwnState], Intended]:
    """What such a planner says it intends: another wandering course every few seconds, now and then none."""
    said: list[Intended] = []

    def course(now: Instant, own: OwnState) -> Intended:
        if not said or elapsed_s(said[-1].begin, now) > WANDERS_S:
            legs = int(rng.integers(2, 12))
            t = np.concatenate((np.zeros(1), np.cumsum(rng.uniform(2.0, 60.0, legs))))
            angle = rng.uniform(-math.pi, math.pi) + np.cumsum(rng.uniform(-1.5, 1.5, legs + 1))
            v = rng.uniform(0.0, 1.3 * speed, legs + 1)
            velocity = v[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
            run = np.vstack((np.zeros((1, 2)), np.cumsum(velocity[:-1] * np.diff(t)[:, None], axis=0)))
            if rng.random() < 0.05:
                run[-1] = np.nan
            said[:] = [Intended(now, t, own.north_m + run[:, 0], own.east_m + run[:, 1], velocity)]
        return said[0]

    return course
