"""The paper's ship: its set contains everything that can happen, touches it, and is measured exactly."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import reach
from companion.instant import instant
from companion.messages import FloatArray, Tracks
from companion.reach import support_straight
from companion.reach.shapes import only
from tests.builders import T0, tracks
from tests.ships import drive, plane, random_ships

TOLERANCE_M = 1e-9


def worst_escape_m(rng: np.random.Generator, ships: Tracks, until_s: FloatArray, each: int) -> float:
    """The largest signed distance of sampled points to their own ship's tube; sound if <= 0."""
    age = ships.age_s(T0)
    worst = -np.inf
    for i in range(len(ships)):
        points = drive(rng, ships, i, age[i], max(age[i], until_s[i]), each)
        distance, _ = reach.tube(only(ships, np.array([i])), T0, until_s[i]).nearest_many(plane(points))
        worst = max(worst, float(distance.max()))
    return worst


def dense_hull(ship: Tracks, age_s: float, until_s: float) -> shapely.Polygon:
    """The same set put together by shapely from points alone (position error 0): inside the true set."""
    v, w = ship.sog_mps[0], ship.speed_noise_mps[0]
    course = ship.cog_rad[0] + ship.course_noise_rad[0] * np.linspace(-1, 1, 101)
    run = np.outer(
        [age_s * (v - w), until_s * (v - w), age_s * (v + w), until_s * (v + w)], np.exp(1j * course)
    )
    motion = shapely.MultiPoint(plane(run.ravel())).convex_hull
    turn = ship.heading_rad[0] + ship.heading_error_rad[0] * np.linspace(-1, 1, 41)
    corners = [
        b + 1j * s for b in (ship.bow_m[0], -ship.stern_m[0]) for s in (ship.starboard_m[0], -ship.port_m[0])
    ]
    hull = shapely.MultiPoint(plane(np.outer(corners, np.exp(1j * turn)).ravel())).convex_hull
    a, b = (shapely.get_coordinates(g) @ np.array([1, 1j]) for g in (motion, hull))
    whole = shapely.MultiPoint(
        plane((a[:, None] + b).ravel() + ship.north_m[0] + 1j * ship.east_m[0])
    ).convex_hull
    assert isinstance(whole, shapely.Polygon)
    return whole


def stated_domain(rng: np.random.Generator, n: int) -> Tracks:
    """Speed 0.5-12 m/s, noise 0-0.5 m/s and 0-0.1 rad, hulls to 400 m."""
    bow = rng.uniform(0, 400, n)
    return random_ships(
        rng,
        n,
        sog_mps=rng.uniform(0.5, 12, n),
        speed_noise_mps=rng.uniform(0, 0.5, n),
        course_noise_rad=rng.uniform(0, 0.1, n),
        heading_error_rad=rng.uniform(0, 0.2, n),
        bow_m=bow,
        stern_m=rng.uniform(0, 1, n) * (400 - bow),
        position_error_m=np.zeros(n),
    )


def test_no_sampled_ship_escapes_its_tube() -> None:
    rng = np.random.default_rng(1)
    ships = random_ships(rng, 100)
    until = rng.choice([0.0, 60.0, 600.0], 100)
    assert worst_escape_m(rng, ships, until, 3000) <= TOLERANCE_M


def test_no_sampled_ship_escapes_its_set_at_one_time() -> None:
    rng = np.random.default_rng(2)
    ships = random_ships(rng, 100)
    assert worst_escape_m(rng, ships, np.zeros(100), 1000) <= TOLERANCE_M


def test_sampled_ships_come_right_up_to_the_boundary() -> None:
    rng = np.random.default_rng(3)
    ships = stated_domain(rng, 30)
    assert worst_escape_m(rng, ships, np.full(30, 600.0), 3000) > -0.5


def test_the_set_is_within_a_fifth_of_a_metre_of_a_dense_hull_over_the_stated_domain() -> None:
    rng = np.random.default_rng(4)
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    for _ in range(25):
        ship = stated_domain(rng, 1)
        age = float(ship.age_s(T0)[0])
        ours = reach.tube(ship, T0, 600.0).support(normal)[0]
        dense = (shapely.get_coordinates(dense_hull(ship, age, max(age, 600.0))) @ normal.T).max(axis=0)
        assert (ours - dense).min() >= -TOLERANCE_M
        assert (ours - dense).max() <= 0.2


def test_distance_and_nearest_point_agree_with_shapely() -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        ship = stated_domain(rng, 1)
        age = float(ship.age_s(T0)[0])
        hull = dense_hull(ship, age, max(age, 600.0))
        sets = reach.tube(ship, T0, 600.0)
        corner = shapely.get_coordinates(hull)[rng.integers(0, 50)]
        positions = corner + rng.normal(0, 300, (200, 2))
        points = shapely.points(positions)
        inside = shapely.contains(hull, points)
        expected = np.where(inside, -1, 1) * shapely.distance(shapely.boundary(hull), points)
        distance, away = sets.nearest_many(positions)
        assert distance[:, 0] == pytest.approx(expected, abs=0.05)
        nearest = positions - distance * away[:, 0]
        assert shapely.distance(shapely.boundary(hull), shapely.points(nearest)).max() < 0.05


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_distance_is_the_largest_gap_to_any_tangent_and_is_attained(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ships = random_ships(rng, 40)
    sets = reach.tube(ships, T0, rng.choice([0.0, 60.0, 600.0], 40))
    around = rng.choice([1.0, 30.0, 300.0, 6000.0], (40, 1))
    position = np.column_stack((ships.north_m, ships.east_m)) + rng.normal(0, 1, (40, 2)) * around
    nearest = sets.nearest(position)
    angle = rng.uniform(0, 2 * np.pi, 200)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    gap = position @ normal.T - sets.support(normal)
    assert (nearest.distance_m - gap.max(axis=1)).min() >= -TOLERANCE_M
    attained = (position * nearest.away).sum(axis=1) - np.diag(sets.support(nearest.away))
    assert attained == pytest.approx(nearest.distance_m, abs=TOLERANCE_M)
    assert np.hypot(*nearest.away.T) == pytest.approx(1.0, abs=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_sets_support_is_the_closed_form(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = random_ships(rng, 20)
    until = rng.uniform(0, 900, 20)
    angle = rng.uniform(-10, 10, 50)
    course = t.cog_rad
    closed = support_straight(
        t.sog_mps,
        t.age_s(T0),
        until,
        speed_noise_mps=t.speed_noise_mps,
        course_noise_rad=t.course_noise_rad,
        bow_m=t.bow_m,
        stern_m=t.stern_m,
        port_m=t.port_m,
        starboard_m=t.starboard_m,
        heading_offset_rad=t.heading_rad - course,
        heading_error_rad=t.heading_error_rad,
        position_error_m=t.position_error_m,
        directions_rad=angle - course[:, None],
    )
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    origin = np.column_stack((t.north_m, t.east_m)) @ normal.T
    assert reach.tube(t, T0, until).support(normal) == pytest.approx(origin + closed, abs=TOLERANCE_M)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_gradient_is_the_slope_of_the_distance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ships = random_ships(rng, 20)
    sets = reach.tube(ships, T0, 600.0)
    position, step = rng.normal(0, 8000, 2), 1e-4
    here = sets.nearest(position)
    slopes = [
        (sets.nearest(position + d).distance_m - sets.nearest(position - d).distance_m) / (2 * step)
        for d in (np.array((step, 0.0)), np.array((0.0, step)))
    ]
    smooth = here.distance_m > 1.0  # inside, the distance has creases
    assert np.abs(np.column_stack(slopes) - here.away)[smooth].max(initial=0) < 1e-3


def test_a_set_at_one_time_lies_in_every_tube_over_that_time() -> None:
    ships = random_ships(np.random.default_rng(6), 200)
    angle = np.linspace(0, 2 * np.pi, 90)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    whole = reach.tube(ships, T0, ships.age_s(T0) + 300.0).support(normal)
    for ahead in (0.0, 1.0, 150.0, 300.0):
        assert (reach.at(ships, T0, ahead).support(normal) - whole).max() <= TOLERANCE_M


def test_a_tube_whose_horizon_has_passed_is_the_set_now() -> None:
    ships = random_ships(np.random.default_rng(7), 50)
    now, position = instant(700.0), np.zeros(2)
    expired, present = reach.tube(ships, now, 600.0).nearest(position), reach.at(ships, now).nearest(position)
    assert expired.distance_m == pytest.approx(present.distance_m, abs=0)


def test_the_papers_ship_is_a_box_of_sixty_metres_after_ten_minutes() -> None:
    ship = tracks({"bow_m": 0, "stern_m": 0, "port_m": 0, "starboard_m": 0})
    normal = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], dtype=np.float64)
    front, rear, right, left = reach.at(ship, instant(600.0)).support(normal)[0]
    assert front + rear == pytest.approx(60.15, abs=0.01)
    assert right + left == pytest.approx(60.60, abs=0.01)


def test_at_age_zero_the_set_is_the_hull_alone() -> None:
    ship = tracks(
        {"bow_m": 60.0, "stern_m": 15.0, "port_m": 5.0, "starboard_m": 20.0, "heading_error_rad": 0.0}
    )
    box = reach.at(ship, T0)
    position = np.array([[100.0, 0.0], [-20.0, 0.0], [0.0, 30.0], [0.0, -10.0], [63.0, 24.0], [50.0, 0.0]])
    distance, _ = box.nearest_many(position)
    assert distance[:, 0] == pytest.approx([40.0, 5.0, 10.0, 5.0, 5.0, -5.0], abs=1e-9)


def test_a_hull_of_unknown_heading_is_its_circumscribed_circle() -> None:
    ship = tracks(
        {"bow_m": 60.0, "stern_m": 15.0, "port_m": 5.0, "starboard_m": 20.0, "heading_error_rad": np.pi}
    )
    angle = np.linspace(0, 2 * np.pi, 60)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    assert reach.at(ship, T0).support(normal)[0] == pytest.approx(np.hypot(60.0, 20.0), abs=1e-9)


def test_a_ship_slower_than_its_noise_may_drift_astern() -> None:
    ship = tracks(
        {"sog_mps": 0.1, "speed_noise_mps": 0.5, "bow_m": 0, "stern_m": 0, "port_m": 0, "starboard_m": 0}
    )
    distance, _ = reach.at(ship, instant(100.0)).nearest_many(
        np.array([[60.0, 0.0], [-40.0, 0.0], [-41.0, 0.0]])
    )
    assert distance[:, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_the_outline_follows_the_set() -> None:
    for seed in range(5):
        ship = stated_domain(np.random.default_rng(seed), 1)
        outline = reach.tube(ship, T0, 600.0).outline(0)
        drawn, dense = shapely.Polygon(outline), dense_hull(ship, float(ship.age_s(T0)[0]), 600.0)
        assert drawn.is_valid
        assert drawn.symmetric_difference(dense).area < 0.001 * dense.area


def test_the_outline_of_a_ship_that_is_a_point_is_that_point() -> None:
    nothing = dict.fromkeys(("bow_m", "stern_m", "port_m", "starboard_m"), 0.0)
    outline = reach.at(tracks({"north_m": 3.0, "east_m": -4.0, **nothing}), T0).outline(0)
    assert outline == pytest.approx(np.array([[3.0, -4.0]] * 2), abs=1e-4)


def test_a_narrow_ship_with_its_antenna_on_one_side_is_measured_exactly_too() -> None:
    """Two corners' arcs then end a rounding apart: such a piece must not be taken for the nearest."""
    rng = np.random.default_rng(7)
    n, bow = 200, np.array((5.0, 100.0, 300.0))
    angle = np.linspace(0, 2 * np.pi, 3600, endpoint=False)
    normal = np.exp(1j * angle)
    for _ in range(10):
        ships = random_ships(
            rng,
            n,
            bow_m=rng.choice(bow, n),
            stern_m=rng.choice([0.0, 0.02, 5.0], n),
            port_m=10 ** rng.uniform(-3, 1, n),
            starboard_m=np.zeros(n),
            heading_error_rad=rng.choice([1e-4, 0.02, 0.3, 1.57], n),
        )
        tube = reach.tube(ships, T0, 600.0)
        support = tube.support(plane(normal))
        k = rng.integers(len(angle), size=n)
        touching = np.roll(support, -1, axis=1) - np.roll(support, 1, axis=1)
        beside = touching[np.arange(n), k] / (2 * np.sin(angle[1])) + rng.uniform(-3, 3, n)
        position = plane((support[np.arange(n), k] + 1.0 + 1j * beside) * normal[k])
        gap = (position @ plane(normal).T - support).max(axis=1)  # no more than the distance
        assert (tube.nearest(position).distance_m - gap).min() > -1e-6
