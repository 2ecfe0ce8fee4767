from dataclasses import replace

import numpy as np
import pytest

from companion import reach
from companion.instant import Instant, after, instant
from companion.messages import Model, Tracks
from companion.planning.guard.beginning import Beginning
from companion.planning.guard.clearance import Clearance, Paths
from companion.planning.guard.margins import Margins
from companion.planning.guard.rollout import Motion
from companion.planning.guard.search import Search
from companion.planning.guard.way_out import WayOut
from companion.reach import Slices
from tests.builders import T0, config, tracks
from tests.ships import random_ships

MARGINS = Margins(5.0, 2.0, 0.01, 3.0, 100.0)
GRID = np.concatenate((np.arange(0, 10, 1.0), np.arange(10, 60, 4.0)))


def scene(seed: int) -> tuple[Tracks, Paths]:
    rng = np.random.default_rng(seed)
    n = 12
    spread = np.cumsum(rng.uniform(0, 60, (n, 4, 3)), axis=1)
    ships = random_ships(
        rng,
        n,
        north_m=rng.uniform(-400, 400, n),
        east_m=rng.uniform(-400, 400, n),
        bow_m=rng.uniform(0, 60, n),
        stern_m=rng.uniform(0, 60, n),
        measured_at_ns=(-1e9 * rng.uniform(0, 60, n)).astype(np.int64),
        validity_s=rng.choice((70.0, 90.0, 1e4), n),
        model=rng.choice(list(Model), n, p=(0.6, 0.1, 0.1, 0.1, 0.1)).astype(np.int64),
        turn_rate_radps=rng.uniform(-0.005, 0.005, n),
        disc_speed_mps=rng.uniform(0, 3, n),
        top_speed_mps=np.full(n, 16.0),
    )
    ships = replace(ships, spread_m=spread)
    turn = np.cumsum(rng.normal(0, 0.1, (5, len(GRID) - 1)), axis=1) + rng.uniform(-3, 3, (5, 1))
    step = np.diff(GRID) * rng.uniform(0, 2.5, (5, 1))
    zero = np.zeros((5, 1))
    north = np.hstack((zero, np.cumsum(step * np.cos(turn), axis=1)))
    east = np.hstack((zero, np.cumsum(step * np.sin(turn), axis=1)))
    return ships, Paths(GRID, north, east)


def clearance_of(ships: Tracks) -> Clearance:
    return Clearance(Slices.of(ships), T0, MARGINS, 2.5, 20.0, np.full(2, 1e6))


@pytest.mark.parametrize("seed", range(8))
def test_a_path_has_no_room_wherever_a_dense_look_at_every_instant_finds_none(seed: int) -> None:
    ships, paths = scene(seed)
    room = clearance_of(ships).room(paths)
    until = np.maximum(np.minimum(ships.validity_s, ships.age_s(T0) + 3600), ships.age_s(T0) + 20)
    cells = np.concatenate(([0.0], 0.5 * (GRID[1:] + GRID[:-1]), [GRID[-1]]))
    slack = []
    for c in range(len(paths)):
        for k in range(len(GRID)):
            least = np.inf
            for t in np.linspace(cells[k], cells[k + 1], 9):
                here = np.array((np.interp(t, GRID, paths.north_m[c]), np.interp(t, GRID, paths.east_m[c])))
                now = after(T0, float(t))
                distance = reach.at(ships, now).nearest(here).distance_m
                known = ships.age_s(now) <= until
                least = min(least, float((distance[known] - MARGINS.at(t)).min(initial=np.inf)))
            assert least > 0 or room[c, k] <= least + 1e-6
            if least < 50 and room[c, k] < 50:
                slack.append(least - room[c, k])
    if (ships.model != Model.TURNING).all():  # whose sets are taken between round ages
        assert np.median(slack) < 1.0  # nor is it timid


@pytest.mark.parametrize("seed", range(5))
def test_a_place_to_stay_is_clear_of_the_tube_until_the_information_ends(seed: int) -> None:
    ships, _ = scene(seed)
    rng = np.random.default_rng(seed)
    places, since = rng.uniform(-900, 900, (40, 2)), rng.uniform(0, 100, 40)
    clearance = clearance_of(ships)
    room = clearance.room_to_stay(since, places[:, 0], places[:, 1])
    for k in range(40):
        start = after(T0, float(since[k]))
        sets = reach.tube(ships, start, clearance.until_s).nearest(places[k])
        counts = ships.age_s(start) < clearance.until_s
        margin = MARGINS.tracking_m + MARGINS.localised(clearance.until_s - ships.age_s(T0))
        expected = (sets.distance_m - margin)[counts].min(initial=np.inf)
        assert room[k] <= expected + 1e-6 or (room[k] > 0 and expected > 0)
        if (ships.model != Model.TURNING).all():  # whose tubes are taken between round ages
            assert room[k] == pytest.approx(expected, abs=1e-6) or room[k] > 0


def test_a_ship_about_to_expire_counts_for_the_lookahead_beyond() -> None:
    ship = tracks({"measured_at_s": -590.0, "validity_s": 600.0})
    clearance = clearance_of(ship)
    assert clearance.until_s == pytest.approx(610.0)
    assert not clearance.unknown.any()


def test_a_ship_that_expires_over_the_vehicle_is_unknown_and_counts_while_its_bounds_hold() -> None:
    ship = tracks({"measured_at_s": -590.0, "validity_s": 600.0})
    here = reach.at(ship, T0).support(np.array(((1.0, 0.0),)))[0, 0] + 100.0
    clearance = Clearance(Slices.of(ship), T0, MARGINS, 2.5, 20.0, np.array((here, 0.0)))
    assert clearance.unknown.all()
    assert clearance.until_s == pytest.approx(600.0)


def test_a_candidate_that_fails_the_last_look_gives_way_to_the_next_best() -> None:
    class Doubting(Search):
        refused = 0

        def is_clear(self, way_out: WayOut, now: Instant, clearance: Clearance) -> bool:
            self.refused += 1
            return self.refused > 1 and super().is_clear(way_out, now, clearance)

    vehicle, empty = config().vehicle, np.zeros(0)
    first = Beginning(empty, empty, empty, 0.0, Motion(0.0, 0.0, 0.0, 0.0))
    search = Doubting(vehicle, 2.3, 300.0)
    ship = clearance_of(tracks({"north_m": 3000.0, "validity_s": 1500.0}))
    found, best = search.best(T0, first, (2.0, 0.0), ship)
    assert search.refused == 2
    assert found is best
    assert best.verified


def test_margins_grow_under_water_and_with_the_time_flown() -> None:
    assert MARGINS.localised(0.0) == pytest.approx(5 + 2 + 0.01 * 100)
    assert MARGINS.localised(50.0) == pytest.approx(5 + 2 + 0.01 * 150)
    assert MARGINS.at(3.0) - MARGINS.at(0.0) == pytest.approx(3.0 + 0.03)
    assert MARGINS.at(10.0) - MARGINS.at(5.0) == pytest.approx(0.05)


def test_paths_far_from_every_ship_have_all_the_room() -> None:
    ship = tracks({"north_m": 9e4})
    _, paths = scene(0)
    assert np.isinf(clearance_of(ship).room(paths)).all()
    assert instant(0.0) == T0
