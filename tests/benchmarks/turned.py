"""What a turning ship can really reach, by simulating ships that try to get far in many directions."""

import numpy as np
import shapely
from numpy.typing import NDArray

from companion import reach
from companion.messages import FloatArray, Tracks
from tests.builders import T0
from tests.ships import clip_angle, plane, random_turns, wrapped

DIRECTIONS = 60
SWITCHES = 16
STEP_S = 1.0


def example(rate: float, error: float, age_s: float) -> Tracks:
    """A ship of no size at 8 m/s, course noise 0.05 rad, speed noise 0.25 m/s."""
    no_size = ("bow_m", "stern_m", "port_m", "starboard_m", "position_error_m", "north_m", "east_m")
    values = {
        "sog_mps": 8.0,
        "speed_noise_mps": 0.25,
        "course_noise_rad": 0.05,
        "cog_rad": 0.3,
        "turn_rate_radps": rate,
        "turn_rate_error_radps": error,
    }
    columns = {name: np.array([value]) for name, value in {**values, **dict.fromkeys(no_size, 0.0)}.items()}
    measured = np.array([-int(age_s * 1e9)])
    return random_turns(np.random.default_rng(0), 1, measured_at_ns=measured, **columns)


def reached(ship: Tracks, until_s: float) -> list[NDArray[np.complex128]]:
    """Positions, second by second, of ships that chase a direction or switch their rate of turn once."""
    low = ship.turn_rate_radps[0] - ship.turn_rate_error_radps[0]
    high = ship.turn_rate_radps[0] + ship.turn_rate_error_radps[0]
    noise, speed, swing = ship.course_noise_rad[0], ship.sog_mps[0], ship.speed_noise_mps[0]
    towards = np.linspace(-np.pi, np.pi, DIRECTIONS, endpoint=False) - ship.cog_rad[0]
    switch = np.linspace(0, until_s, SWITCHES)[:, None]
    turned = np.zeros((1 + 2 * SWITCHES, DIRECTIONS))
    position = np.zeros(turned.shape, dtype=np.complex128)
    positions = [position.ravel()]
    for second in range(round(until_s / STEP_S)):
        off = wrapped(towards - turned[:1])
        chase = np.clip(np.sign(off) * np.maximum(np.abs(off) - noise, 0) / STEP_S, low, high)
        early = np.broadcast_to(second * STEP_S < switch, (SWITCHES, DIRECTIONS))
        rate = np.concatenate((chase, np.where(early, low, high), np.where(early, high, low)))
        middle = turned + rate * STEP_S / 2
        course = middle + clip_angle(towards - middle, noise)
        forward = np.abs(wrapped(towards - course)) < np.pi / 2
        run = STEP_S * (speed + np.where(forward, swing, -swing)) * np.sinc(rate * STEP_S / (2 * np.pi))
        position = position + run * np.exp(1j * (ship.cog_rad[0] + course))
        turned = turned + rate * STEP_S
        positions.append(position.ravel())
    return positions


def looseness(ship: Tracks, until_s: float) -> tuple[float, FloatArray]:
    """Area of our tube over that of the hulls reached, and gaps (m,) along our boundary, metres."""
    first = int(ship.age_s(T0)[0])
    hulls = [shapely.MultiPoint(plane(p)).convex_hull for p in reached(ship, until_s)[first:]]
    real = shapely.union_all([h.buffer(1e-3) for h in hulls])
    outlines = reach.tube(ship, T0, until_s).outlines(0)
    ours = shapely.union_all([shapely.Polygon(o).buffer(0) for o in outlines])
    along = shapely.get_coordinates(shapely.segmentize(ours.boundary, 5.0))
    return float(ours.area / real.area), shapely.distance(real, shapely.points(along))
