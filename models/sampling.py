"""Contacts and vehicle positions to measure a model on: drawn over its whole domain, near the sets."""

import numpy as np

from companion import reach
from companion.instant import NS_PER_S, Instant
from companion.messages import FloatArray, Model, Tracks
from companion.planning.rows import COLUMNS, as_circles

NOW = Instant(10_000 * NS_PER_S)


def tracks_of(rows: FloatArray) -> Tracks:
    """Contacts (n, 15) as tracks at `NOW`, antennas placed so that the vehicle is at the origin."""
    column = dict(zip(COLUMNS, rows.T, strict=True))
    n = len(rows)
    return Tracks(
        revision=1,
        mmsi=np.arange(1, n + 1, dtype=np.int64),
        measured_at_ns=NOW - np.round(column["age_s"] * NS_PER_S).astype(np.int64),
        north_m=-column["north_m"],
        east_m=-column["east_m"],
        cog_rad=column["course_rad"],
        sog_mps=column["speed_mps"],
        heading_rad=column["heading_rad"],
        bow_m=column["bow_m"],
        stern_m=column["stern_m"],
        port_m=column["port_m"],
        starboard_m=column["starboard_m"],
        position_error_m=column["position_error_m"],
        speed_noise_mps=column["speed_noise_mps"],
        course_noise_rad=column["course_noise_rad"],
        heading_error_rad=column["heading_error_rad"],
        disc_speed_mps=np.full(n, 30.0),
        top_speed_mps=np.full(n, 30.0),
        validity_s=np.full(n, np.inf),
        model=np.full(n, int(Model.STRAIGHT), dtype=np.int64),
    )


def exact(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance (n,) and direction (n, 2) from the exact tubes."""
    sets = reach.tube(tracks_of(rows), NOW, rows[:, COLUMNS.index("until_age_s")])
    nearest = sets.nearest(np.zeros(2))
    return nearest.distance_m, nearest.away


def ships(rng: np.random.Generator, n: int, domain: dict[str, tuple[float, float]]) -> FloatArray:
    """(n, 15) uniform over the domain but for the position; ages whole nanoseconds.

    A fifth of the rows take each bound, one by one, at an end of its range; hulls are as often
    ferries as boats; headings lie near the course or anywhere, and a
    fifth are unknown.
    """
    low, high = (np.array([domain[name][side] for name in COLUMNS]) for side in (0, 1))
    unit = rng.uniform(size=(n, len(COLUMNS)))
    at_an_end = rng.uniform(size=unit.shape) < 0.2
    unit = np.where(at_an_end, np.round(unit), unit)
    rows: FloatArray = low + unit * (high - low)
    column = {name: i for i, name in enumerate(COLUMNS)}
    heading, error = column["heading_rad"], column["heading_error_rad"]
    hull = slice(column["bow_m"], column["position_error_m"] + 1)
    if low[error] == high[error]:  # one heading error: the paper's ships, which head as they go
        rows[:, heading] = rows[:, column["course_rad"]]
    else:
        near_course = rows[:, column["course_rad"]] + rng.normal(scale=0.1, size=n)
        is_near = rng.uniform(size=n) < 0.7
        rows[:, heading] = np.where(is_near, near_course, rows[:, heading]).clip(low[heading], high[heading])
        rows[:, error] = np.where(rng.uniform(size=n) < 0.8, rows[:, error], np.pi)
    small = np.where(rng.uniform(size=n) < 0.7, 0.3, 1.0)[:, None]
    rows[:, hull] = low[hull] + small * (rows[:, hull] - low[hull])
    speed, noise = column["speed_mps"], column["speed_noise_mps"]
    rows[:, noise] = np.minimum(rows[:, noise], rows[:, speed])
    age, until = column["age_s"], column["until_age_s"]
    rows[:, age] = np.round(rows[:, age], 6)
    rows[:, until] = np.maximum(rows[:, until], rows[:, age])
    as_circles(rows)
    rows[:, hull.stop - 1] = np.minimum(rows[:, hull.stop - 1], high[hull.stop - 1])
    return rows


def place(
    rng: np.random.Generator, rows: FloatArray, low_m: float, high_m: float, *, logarithmic: bool = False
) -> FloatArray:
    """The same ships with the vehicle put `low_m` to `high_m` from the tube, everywhere around it."""
    rows = rows.copy()
    n = len(rows)
    until = np.maximum(rows[:, 4], rows[:, 5])
    far = until * (rows[:, 3] + rows[:, 6])
    along = rng.uniform(-0.05, 1.05, n) * far + rng.normal(scale=200.0, size=n)
    across = rng.normal(size=n) * (300.0 + np.abs(along) * rows[:, 7])
    cos, sin = np.cos(rows[:, 2]), np.sin(rows[:, 2])
    rows[:, 0], rows[:, 1] = along * cos - across * sin, along * sin + across * cos
    distance, away = exact(rows)
    if logarithmic:
        wanted = np.exp(rng.uniform(np.log(low_m), np.log(high_m), n))
    else:
        wanted = rng.uniform(low_m, high_m, n)
    step = wanted - distance
    rows[:, :2] += step[:, None] * away
    return rows
