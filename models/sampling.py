"""Contacts and vehicle positions to measure a model on: drawn over its whole domain, near the sets."""

import numpy as np

from companion import reach
from companion.instant import NS_PER_S, Instant
from companion.messages import FloatArray, Model, Tracks
from companion.planning.rows import COLUMNS, TURNING_COLUMNS, as_circles

Domain = dict[str, tuple[float, float]]
AGE, COURSE_NOISE, HEADING_ERROR = map(COLUMNS.index, ("age_s", "course_noise_rad", "heading_error_rad"))
AT_ONCE, PLACES = 4000, 10  # rows of turning ships, and places around each
NOW = Instant(10_000 * NS_PER_S)


def tracks_of(rows: FloatArray) -> Tracks:
    """Contacts (n, 15), or (n, 17) that turn, as tracks at `NOW`; the vehicle is at the origin."""
    n, turns = len(rows), rows.shape[1] == len(TURNING_COLUMNS)
    column = dict(zip(TURNING_COLUMNS if turns else COLUMNS, rows.T, strict=True))
    turning = {name: column[name] for name in TURNING_COLUMNS[len(COLUMNS) :]} if turns else {}
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
        model=np.full(n, int(Model.TURNING if turns else Model.STRAIGHT), dtype=np.int64),
        **turning,
    )


def exact(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance (n,) and direction (n, 2) from the exact tubes; of turning ships from their convex slabs."""
    sets = reach.tube(tracks_of(rows), NOW, rows[:, COLUMNS.index("until_age_s")])
    nearest = sets.nearest(np.zeros(2))
    return nearest.distance_m, nearest.away


def around(rng: np.random.Generator, n: int, domain: Domain, low_m: float, high_m: float) -> FloatArray:
    """(n, 15 or 17) ships of a domain with the vehicle `low_m` to `high_m` from their tubes.

    Several places around each ship that turns, whose set is expensive.
    """
    if tuple(domain) == COLUMNS:
        return place(rng, ships(rng, n, domain), low_m, high_m)
    parts = []
    for first in range(0, n, AT_ONCE):
        count = -(-min(AT_ONCE, n - first) // PLACES)
        rows = np.repeat(ships(rng, count, domain), PLACES, axis=0)
        parts.append(place(rng, rows, low_m, high_m))
    return np.concatenate(parts)[:n]


def ships(rng: np.random.Generator, n: int, domain: Domain) -> FloatArray:
    """(n, 15) uniform over the domain but for the position; ages whole nanoseconds.

    A fifth of the rows take each bound, one by one, at an end of its range; hulls are as often
    ferries as boats; headings lie near the course or anywhere, and a
    fifth are unknown.
    """
    columns = tuple(domain)
    low, high = (np.array([domain[name][side] for name in columns]) for side in (0, 1))
    unit = rng.uniform(size=(n, len(columns)))
    at_an_end = rng.uniform(size=unit.shape) < 0.2
    unit = np.where(at_an_end, np.round(unit), unit)
    rows: FloatArray = low + unit * (high - low)
    column = {name: i for i, name in enumerate(columns)}
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
    speed, noise, until = column["speed_mps"], column["speed_noise_mps"], column["until_age_s"]
    rows[:, noise] = np.minimum(rows[:, noise], rows[:, speed])
    age = column["age_s"]
    rows[:, age] = np.round(rows[:, age], 6)
    rows[:, until] = np.maximum(rows[:, until], rows[:, age])
    if columns == TURNING_COLUMNS:
        if low[until] < high[until]:
            _turn(rng, rows, high)
        return rows
    as_circles(rows)
    rows[:, hull.stop - 1] = np.minimum(rows[:, hull.stop - 1], high[hull.stop - 1])
    return rows


def _turn(rng: np.random.Generator, rows: FloatArray, high: FloatArray) -> None:
    """Tubes of any length up to the domain's, turns of any rate that keep all courses within half a turn."""
    n, until, rate = len(rows), COLUMNS.index("until_age_s"), len(COLUMNS)
    rows[:, HEADING_ERROR] *= rng.uniform(size=n) ** 3
    rows[:, AGE] *= rng.uniform(size=n) ** 2
    rows[:, AGE] = np.round(rows[:, AGE], 6)
    length = np.exp(rng.uniform(0.0, np.log(high[until]), n)) * (rng.uniform(size=n) < 0.95)
    rows[:, until] = np.minimum(rows[:, AGE] + length, high[until])
    rows[:, COURSE_NOISE] *= rng.uniform(size=n) ** 3
    room = (np.pi - 2 * rows[:, COURSE_NOISE]) / (np.ceil(rows[:, until]) + 1)
    share = rng.uniform(size=(n, 2)) ** 2 * (rng.uniform(size=(n, 2)) < 0.9)
    rows[:, rate] = (share[:, 0] * room).clip(0, high[rate])
    rows[:, rate + 1] = (share[:, 1] * (room - rows[:, rate]) / 2).clip(0, high[rate + 1])
    rows[:, rate] *= rng.choice([-1.0, 1.0], n)


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
    way = rows[:, 2] if rows.shape[1] == len(COLUMNS) else rows[:, 2] + rows[:, len(COLUMNS)] * until / 2
    cos, sin = np.cos(way), np.sin(way)
    rows[:, 0], rows[:, 1] = along * cos - across * sin, along * sin + across * cos
    distance, away = exact(rows)
    if logarithmic:
        wanted = np.exp(rng.uniform(np.log(low_m), np.log(high_m), n))
    else:
        wanted = rng.uniform(low_m, high_m, n)
    rows[:, :2] += (wanted - distance)[:, None] * away
    if rows.shape[1] == len(TURNING_COLUMNS):  # another slab may be nearer now
        distance, away = exact(rows)
        rows[:, :2] += (wanted - distance)[:, None] * away
    return rows


def crowded(
    rng: np.random.Generator,
    ship: FloatArray,
    places: int,
    low_m: float,
    high_m: float,
    *,
    logarithmic: bool = False,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Many places around one turning ship (17,): rows (places, 17), true distance and direction."""
    ship = ship.copy()
    ship[:2] = 0.0
    until = max(ship[AGE], ship[AGE + 1])
    sets = reach.tube(tracks_of(ship[None]), NOW, until)
    tau = rng.uniform(ship[AGE], until, places)
    way = ship[2] + ship[len(COLUMNS)] * tau / 2
    at = ship[3] * tau[:, None] * np.column_stack((np.cos(way), np.sin(way)))
    at += rng.normal(scale=rng.choice([50.0, 300.0]), size=at.shape)
    for _ in range(2):
        distance, away = sets.nearest_many(at)
        wanted = rng.uniform(low_m, high_m, places)
        if logarithmic:
            wanted = np.exp(rng.uniform(np.log(low_m), np.log(high_m), places))
        at += (wanted - distance[:, 0])[:, None] * away[:, 0]
    rows = np.repeat(ship[None], places, axis=0)
    rows[:, :2] = at
    distance, away = sets.nearest_many(at)
    return rows, distance[:, 0], away[:, 0]
