"""Random ships and what they may really do: trajectories sampled from the models' own words.

Independent of `companion.reach`: positions are sums of small steps, hulls are four corners.  Points
are complex, north + i east.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.messages import Model, Tracks
from tests.builders import tracks

Points = NDArray[np.complex128]
STEPS = 6


def random_ships(rng: np.random.Generator, n: int, **fixed: Any) -> Tracks:
    """n ships over the stated domain and beyond: at rest, drifting astern, hulls of no size, no noise."""

    def some(*values: float) -> NDArray[np.float64]:
        return rng.choice(np.array(values), n)

    course = rng.uniform(0, 2 * np.pi, n)
    columns: dict[str, Any] = {
        "measured_at_ns": -np.round(rng.uniform(0, 600, n) * rng.integers(0, 2, n) * 1e9).astype(np.int64),
        "north_m": rng.uniform(-5e3, 5e3, n),
        "east_m": rng.uniform(-5e3, 5e3, n),
        "cog_rad": course,
        "sog_mps": rng.uniform(0, 12, n) * (rng.random(n) > 0.1),
        "heading_rad": np.where(rng.random(n) < 0.3, course, rng.uniform(0, 2 * np.pi, n)),
        "bow_m": rng.uniform(0, 380, n) * (rng.random(n) > 0.2),
        "stern_m": rng.uniform(0, 200, n) * (rng.random(n) > 0.2),
        "port_m": rng.uniform(0, 30, n) * (rng.random(n) > 0.2),
        "starboard_m": rng.uniform(0, 30, n) * (rng.random(n) > 0.2),
        "position_error_m": some(0, 10, 30),
        "speed_noise_mps": some(0, 0.05, 0.25, 0.5, 3),
        "course_noise_rad": some(0, 0.01, 0.05, 0.1, 0.7, 1.5),
        "heading_error_rad": some(0, 0.01, 0.1, 0.5, 1.2, np.pi / 2, 2, np.pi),
        "validity_s": np.full(n, np.inf),
    }
    return replace(tracks(*[{}] * n), **{**columns, **fixed})


def drive(rng: np.random.Generator, ship: Tracks, i: int, age_s: float, until_s: float, count: int) -> Points:
    """Points (count,) of ship i's hull at times between two ages of its report.

    Noise changes at `STEPS` random instants.  A third of the trajectories flip between the bounds, a
    third chase a random direction all the way (the far points), a third wander.
    """
    tau = np.where(
        rng.random(count) < 0.7, rng.choice([age_s, until_s], count), rng.uniform(age_s, until_s, count)
    )
    part = rng.dirichlet(np.ones(STEPS), count) * tau[:, None]
    towards = rng.uniform(-np.pi, np.pi, count)[:, None]
    style = rng.integers(0, 3, count)[:, None]
    flip = rng.choice([-1.0, 1.0], (2, count, STEPS))
    wander = rng.uniform(-1, 1, (2, count, STEPS))
    chase_course = clip_angle(towards - ship.cog_rad[i], ship.course_noise_rad[i])
    chase_speed = np.where(np.abs(wrapped(towards - ship.cog_rad[i] - chase_course)) < np.pi / 2, 1.0, -1.0)
    speed = ship.sog_mps[i] + ship.speed_noise_mps[i] * choose(style, flip[0], chase_speed, wander[0])
    noise = ship.course_noise_rad[i]
    course = ship.cog_rad[i] + choose(style, noise * flip[1], chase_course, noise * wander[1])
    run = (part * speed * np.exp(1j * course)).sum(axis=1)
    antenna = ship.north_m[i] + 1j * ship.east_m[i] + run
    return np.asarray(antenna + hull_points(rng, ship, i, count, towards[:, 0]))


def random_turns(rng: np.random.Generator, n: int, **fixed: Any) -> Tracks:
    """n ships that turn at up to about a degree a second."""
    rate = rng.choice([-1.0, 0.0, 1.0], n) * rng.choice([1e-4, 0.003, 0.01, 0.02], n)
    columns = {
        "model": np.full(n, int(Model.TURNING)),
        "turn_rate_radps": rate,
        "turn_rate_error_radps": rng.choice([0, 1e-4, 0.001, 0.005], n),
        "course_noise_rad": rng.choice([0, 0.01, 0.1], n),
        "heading_error_rad": rng.choice([0, 0.05, 0.5, np.pi], n),
    }
    return random_ships(rng, n, **{**columns, **fixed})


def swing(rng: np.random.Generator, ship: Tracks, i: int, age_s: float, until_s: float, count: int) -> Points:
    """As `drive`, for a turning ship: every segment has its own rate of turn, speed and course noise.

    Half of the ships keep one rate, at a bound or within; the displacement is the exact integral.
    """
    tau = np.where(
        rng.random(count) < 0.7, rng.choice([age_s, until_s], count), rng.uniform(age_s, until_s, count)
    )
    part = rng.dirichlet(np.ones(STEPS), count) * tau[:, None]
    bound = np.where(
        rng.random((3, count, 1)) < 0.6,
        rng.choice([-1.0, 1.0], (3, count, STEPS)),
        rng.uniform(-1, 1, (3, count, STEPS)),
    )
    bound[0] = np.where(rng.random((count, 1)) < 0.5, bound[0, :, :1], bound[0])
    rate = ship.turn_rate_radps[i] + ship.turn_rate_error_radps[i] * bound[0]
    speed = ship.sog_mps[i] + ship.speed_noise_mps[i] * bound[1]
    turned = np.cumsum(rate * part, axis=1)
    course = ship.cog_rad[i] + ship.course_noise_rad[i] * bound[2] + turned - rate * part
    # integral of exp(i (course + rate s)) over a segment: its length, times sinc, in the middle direction
    mean = np.sinc(rate * part / (2 * np.pi)) * np.exp(1j * (course + rate * part / 2))
    antenna = ship.north_m[i] + 1j * ship.east_m[i] + (part * speed * mean).sum(axis=1)
    return np.asarray(
        antenna + hull_points(rng, ship, i, count, 2 * np.pi * rng.random(count), turned[:, -1])
    )


def hull_points(
    rng: np.random.Generator,
    ship: Tracks,
    i: int,
    count: int,
    towards: NDArray[np.float64],
    turned: NDArray[np.float64] | float = 0.0,
) -> Points:
    """Corners of the turned hull, shifted by the report's position error."""
    heading = ship.heading_rad[i] + turned
    length = rng.choice(np.array([ship.bow_m[i], -ship.stern_m[i]]), count)
    beam = rng.choice(np.array([ship.starboard_m[i], -ship.port_m[i]]), count)
    corner = length + 1j * beam
    error = ship.heading_error_rad[i]
    chase = clip_angle(towards - heading - np.angle(corner), error)
    turn = np.where(rng.random(count) < 0.5, chase, error * rng.uniform(-1, 1, count))
    shift = ship.position_error_m[i] * np.exp(
        1j * np.where(rng.random(count) < 0.5, towards, 2 * np.pi * rng.random(count))
    )
    return np.asarray(corner * np.exp(1j * (heading + turn)) + shift)


def choose(style: NDArray[np.int64], *options: Any) -> NDArray[np.float64]:
    """The option of each trajectory's style."""
    return np.asarray(np.choose(style, np.broadcast_arrays(*options)), dtype=np.float64)


def wrapped(angle: Any) -> NDArray[np.float64]:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi, dtype=np.float64)


def clip_angle(angle: Any, bound: float) -> NDArray[np.float64]:
    return np.clip(wrapped(angle), -bound, bound)


def plane(points: Points) -> NDArray[np.float64]:
    """(m, 2) north, east."""
    return np.column_stack((points.real, points.imag))
