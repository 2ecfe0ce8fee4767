from dataclasses import replace

import numpy as np
import pytest

from companion import reach
from companion.instant import instant
from companion.messages import FloatArray, Model, Tracks
from companion.reach import Slices
from tests.builders import tracks
from tests.ships import random_ships

RNG = np.random.default_rng(5)


def ships(seed: int, n: int = 60) -> Tracks:
    """Straight ships, discs and learned sets, some past their validity at the ages asked for."""
    rng = np.random.default_rng(seed)
    kinds = (Model.STRAIGHT, Model.DISC, Model.KITE, Model.BOX)
    spread = np.cumsum(rng.uniform(0, 60, (n, 4, 3)), axis=1)
    ships = random_ships(
        rng,
        n,
        model=rng.choice(kinds, n, p=(0.5, 0.2, 0.15, 0.15)).astype(np.int64),
        validity_s=rng.choice((100.0, 400.0, 600.0), n),
        disc_speed_mps=rng.uniform(0, 16, n),
        measured_at_ns=np.zeros(n, dtype=np.int64),
    )
    return replace(ships, spread_m=spread)


def test_a_number_that_is_not_finite_is_refused() -> None:
    tracks = ships(6)
    tracks = replace(tracks, model=np.zeros_like(tracks.model))
    for column in ("north_m", "sog_mps", "top_speed_mps", "bow_m"):
        values = getattr(tracks, column).copy()
        values[3] = np.nan
        with pytest.raises(ValueError, match=r"^tracks have a value that is no finite number$"):
            Slices.of(replace(tracks, **{column: values}))


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("repeats", [1, 40])
def test_a_slice_is_the_set_that_reach_gives_for_that_instant(kernel: str, repeats: int) -> None:
    tracks = ships(1)
    slices = Slices.of(tracks, reach.choose_kernel(kernel))  # type: ignore[arg-type]
    for age in (0.0, 55.0, 250.0, 900.0):
        points = np.column_stack((tracks.north_m, tracks.east_m)) + RNG.normal(0, 2000, (len(tracks), 2))
        expected = reach.at(tracks, instant(age)).nearest(points)
        rows = np.repeat(np.arange(len(tracks)), repeats)
        ages = np.full(len(rows), age)
        distance, north, east = slices.distances(rows, ages, ages, points[rows, 0], points[rows, 1])
        assert distance == pytest.approx(expected.distance_m[rows], abs=1e-6)
        assert np.column_stack((north, east)) == pytest.approx(expected.away[rows], abs=1e-6)


def test_a_tube_is_the_tube_that_reach_gives() -> None:
    tracks = ships(2)
    until = np.linspace(60, 800, len(tracks))
    points = np.column_stack((tracks.north_m, tracks.east_m)) + RNG.normal(0, 3000, (len(tracks), 2))
    expected = reach.tube(tracks, instant(50.0), until).nearest(points)
    rows = np.arange(len(tracks))
    found = Slices.of(tracks).distances(rows, np.full(len(rows), 50.0), until, points[:, 0], points[:, 1])
    assert found[0] == pytest.approx(expected.distance_m, abs=1e-6)


@pytest.mark.parametrize("age_s", [30.0, 150.0, 500.0])
@pytest.mark.parametrize("later_s", [-5.0, -1.0, 1.0, 5.0])
def test_along_a_straight_run_the_distance_is_nowhere_below_its_tangent(age_s: float, later_s: float) -> None:
    tracks = ships(3, 300)
    slices, rows = Slices.of(tracks), np.arange(len(tracks))
    ages = np.full(len(rows), age_s)
    start = np.column_stack((tracks.north_m, tracks.east_m)) + RNG.normal(0, 1500, (len(rows), 2))
    velocity = RNG.normal(0, 2, (len(rows), 2))
    before = slices.distances(rows, ages, ages, start[:, 0], start[:, 1])
    slope = before[1] * velocity[:, 0] + before[2] * velocity[:, 1]
    advance = slices.advance_mps(rows, ages, before[1], before[2])
    slope = slope - (advance if later_s > 0 else slices.retreat_mps(rows, ages, advance))
    then, there = ages + later_s, start + later_s * velocity
    after = slices.distances(rows, then, then, there[:, 0], there[:, 1])
    same = (ages > tracks.validity_s) == (then > tracks.validity_s)
    assert same.sum() > 100
    assert (after[0] - before[0] - later_s * slope)[same].min() > -1e-6


def test_the_discs_around_hold_the_sets() -> None:
    tracks = ships(4)
    slices, rows = Slices.of(tracks), np.arange(len(tracks))
    for age in (0.0, 90.0, 300.0):
        ages = np.minimum(np.full(len(rows), age), tracks.validity_s)
        sets = reach.at(tracks, instant(age))
        centre = np.column_stack((tracks.north_m, tracks.east_m)) + slices.drift_mps * ages[:, None]
        radius = slices.spread_mps * ages + slices.size_m + slices.grown_m(rows, np.full(len(rows), age))
        angle = np.linspace(0, 2 * np.pi, 33)
        directions = np.column_stack((np.cos(angle), np.sin(angle)))
        assert (sets.support(directions) <= centre @ directions.T + radius[:, None] + 1e-6).all()


def test_a_turning_ship_counts_as_its_tube_over_the_round_seconds_around() -> None:
    n = 6
    turning: dict[str, FloatArray] = {
        "turn_rate_radps": np.full(n, 0.002),
        "turn_rate_error_radps": np.full(n, 0.001),
    }
    tracks = random_ships(
        np.random.default_rng(7),
        n,
        model=np.full(n, Model.TURNING, dtype=np.int64),
        measured_at_ns=np.zeros(n, dtype=np.int64),
        **turning,
    )
    slices, rows = Slices.of(tracks), np.arange(n)
    points = np.column_stack((tracks.north_m, tracks.east_m)) + RNG.normal(0, 1500, (n, 2))
    for age in (3.0, 47.0, 119.0):
        ages = np.full(n, age)
        now = reach.at(tracks, instant(age)).nearest(points).distance_m
        found = slices.distances(rows, ages, ages, points[:, 0], points[:, 1])
        assert (found[0] <= now + 1e-6).all()
        # and what moves meanwhile is bounded by the ship's greatest speed
        advance = slices.advance_mps(rows, ages, found[1], found[2])
        for later, slope in ((-2.0, -slices.retreat_mps(rows, ages, advance)), (2.0, advance)):
            then = reach.at(tracks, instant(age + later)).nearest(points).distance_m
            assert (then >= found[0] - 2.0 * slope - 1e-6).all()


def test_the_discs_are_the_smallest_that_the_words_of_each_model_give() -> None:
    rows = [
        {"sog_mps": 5.0, "cog_rad": 0.6, "speed_noise_mps": 0.2, "course_noise_rad": 0.3, "model": k}
        for k in (0, 1, 2)
    ]
    hull = {"bow_m": 30.0, "stern_m": 10.0, "port_m": 40.0, "starboard_m": 5.0, "position_error_m": 7.0}
    three = replace(
        tracks(*({**row, **hull} for row in rows)),
        disc_speed_mps=np.full(3, 3.0),
        turn_rate_radps=np.full(3, -0.01),
        turn_rate_error_radps=np.full(3, 0.002),
    )
    slices = Slices.of(three)
    drift = (5.0 * np.cos(0.6), 5.0 * np.sin(0.6))
    assert slices.drift_mps == pytest.approx(np.array((drift, (0.0, 0.0), (0.0, 0.0))))
    assert slices.spread_mps == pytest.approx((0.2 + 2 * 5.2 * np.sin(0.15), 3.0, 5.2 + 0.012 * 50.0))
    assert slices.size_m == pytest.approx(np.full(3, 50.0 + 7.0))  # the corner farthest from the antenna
    none = np.zeros(3)
    points = replace(three, bow_m=none, stern_m=none, port_m=none, starboard_m=none)
    assert Slices.of(points).size_m == pytest.approx(np.full(3, 7.0))
    assert len(Slices.of(Tracks.empty())) == 0


def test_beyond_the_validity_it_grows_at_once() -> None:
    slices, row = Slices.of(tracks({"validity_s": 600.0, "top_speed_mps": 16.0})), np.zeros(1, dtype=np.int64)
    grown = [float(slices.grown_m(row, np.array((age,)))[0]) for age in (599.0, 600.0, 600.5, 601.0)]
    assert grown[:2] == [0.0, 0.0]
    assert grown[2] == pytest.approx(float(slices.turned_m[0]) + 8.0)
    assert grown[3] - grown[2] == pytest.approx(8.0)


def test_the_edge_of_a_disc_retreats_as_fast_as_it_advances_and_a_turning_ships_may_have_come() -> None:
    rows = np.arange(3)
    three = tracks(*({"model": k, "disc_speed_mps": 3.0} for k in (0, 1, 2)))
    slices, advance, age = Slices.of(three), np.array((1.0, 2.0, 3.0)), np.full(3, 60.0)
    assert slices.retreat_mps(rows, age, advance) == pytest.approx((1.0, 2.0, -3.0))
    assert slices.retreat_mps(rows, np.full(3, 601.0), advance) == pytest.approx((1.0, 2.0, 3.0))


@pytest.mark.parametrize("age_s", [0.0, 0.9, 1.5, 5.0, 10.0, 10.9, 11.0, 19.0, 19.5, 60.0])
@pytest.mark.parametrize("lasts_s", [0.0, 4.0, 90.0])
def test_a_turning_ship_is_taken_between_round_ages(age_s: float, lasts_s: float) -> None:
    """From ten seconds to ten seconds, and a second more to either side: sets are rounded to seconds."""
    turns = {"model": int(Model.TURNING), "cog_rad": 0.4}
    ship = replace(tracks(turns), turn_rate_radps=np.full(1, 0.004), turn_rate_error_radps=np.full(1, 0.001))
    begin = 10.0 * np.floor(max(age_s - 1.0, 0.0) / 10.0)
    end = max(10.0 * np.ceil((age_s + lasts_s + 1.0) / 10.0), begin + 10.0)
    place = np.array((700.0, 900.0))
    expected = reach.tube(ship, instant(begin), end).nearest(place)
    found = Slices.of(ship).distances(
        np.zeros(1, dtype=np.int64), np.full(1, age_s), np.full(1, age_s + lasts_s), place[:1], place[1:]
    )
    assert found[0] == pytest.approx(expected.distance_m, abs=1e-6)
    assert np.column_stack(found[1:]) == pytest.approx(expected.away, abs=1e-6)
