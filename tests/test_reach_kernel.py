"""The kernel: compiled or not it gives the same bits, and remembering changes nothing."""

import sys
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from companion import reach
from companion.errors import ConfigError
from companion.reach import choose_kernel, compiled
from companion.reach.arc_sets import ArcSets
from companion.reach.kernel import nearest
from tests.builders import T0, tracks
from tests.ships import random_ships


def random_question(seed: int) -> tuple[ArcSets, np.ndarray, np.ndarray]:
    """Sets of 80 ships and a point for each, inside or outside."""
    rng = np.random.default_rng(seed)
    ships = random_ships(rng, 80)
    _, sets = reach.tube(ships, T0, 600.0).parts[0]
    assert isinstance(sets, ArcSets)
    scale = rng.choice([10.0, 300.0, 5000.0], 80)
    return sets, rng.normal(0, 1, 80) * scale, rng.normal(0, 1, 80) * scale


@pytest.mark.parametrize("seed", range(5))
def test_the_loop_that_is_compiled_gives_the_bits_of_the_numpy_kernel(seed: int) -> None:
    sets, north, east = random_question(seed)
    by_numpy = np.array(sets.distances(north, east))
    by_loop = np.empty((3, 80))
    compiled.loop(*sets.arcs.packed, sets.r1_m, sets.r2_m, north, east, by_loop)
    assert (by_numpy[0] < 0).any()
    assert (by_numpy[0] > 0).any()
    assert (by_loop == by_numpy).all()


def test_one_contact_and_many_points_go_through_the_loop_alike() -> None:
    sets, north, east = random_question(9)
    by_numpy = np.array(sets.distances(north, east, 3))
    one = sets.arcs.only(3)
    r1, r2 = np.full(80, sets.r1_m[3]), np.full(80, sets.r2_m[3])
    by_loop = np.empty((3, 80))
    compiled.loop(*one.packed, r1, r2, north, east, by_loop)
    assert (by_loop == by_numpy).all()


def test_the_default_kernel_is_numpys_whatever_is_installed() -> None:
    assert reach.choose_kernel("numpy") is nearest
    sets, _, _ = random_question(1)
    assert sets.kernel is nearest


def test_asking_for_the_compiled_kernel_without_numba_names_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled.compiled.cache_clear()
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(ConfigError, match=r"companion\[fast\]"):
        reach.choose_kernel("numba")
    compiled.compiled.cache_clear()


def test_equal_tracks_have_equal_sets_remembered_or_not() -> None:
    ships = random_ships(np.random.default_rng(2), 50)
    again, position = replace(ships), np.array([100.0, -200.0])
    first, second, fresh = (reach.tube(t, T0, 300.0).nearest(position) for t in (ships, ships, again))
    assert (first.distance_m == second.distance_m).all()
    assert (first.distance_m == fresh.distance_m).all()
    assert (first.away == fresh.away).all()


def test_a_ships_answer_does_not_depend_on_the_others() -> None:
    ships = random_ships(np.random.default_rng(3), 40)
    position = np.array([100.0, -200.0])
    together = reach.tube(ships, T0, 300.0).nearest(position)
    for i in range(40):
        alone = reach.tube(reach.shapes.only(ships, np.array([i])), T0, 300.0).nearest(position)
        assert alone.distance_m[0] == pytest.approx(together.distance_m[i], abs=1e-9)


def test_no_ships_have_no_sets() -> None:
    none = random_ships(np.random.default_rng(4), 1)
    nobody = reach.shapes.only(none, np.array([], dtype=np.int64))
    sets = reach.tube(nobody, T0, 600.0)
    assert len(sets) == 0
    assert sets.nearest(np.zeros(2)).away.shape == (0, 2)
    assert sets.nearest_many(np.zeros((3, 2)))[0].shape == (3, 0)
    assert sets.support(np.eye(2)).shape == (0, 2)


def test_a_track_that_is_no_number_is_refused_because_it_would_pass_every_comparison() -> None:
    ships = random_ships(np.random.default_rng(5), 3)
    broken = replace(ships, cog_rad=np.array([0.0, np.nan, 0.0]))
    with pytest.raises(ValueError, match=r"tracks\.cog_rad"):
        reach.at(broken, T0)


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e-179, 1e-160, 1e-150, 1e-140])
@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_a_vehicle_almost_on_the_antenna_of_a_ship_without_size_is_no_division_by_zero(
    length: float, kernel: Literal["numpy", "numba"]
) -> None:
    sizes = dict.fromkeys(("bow_m", "stern_m", "port_m", "starboard_m", "position_error_m"), 0.0)
    ship = tracks({**sizes, "north_m": 0.0, "east_m": 0.0})
    positions = length * np.array([[1.0, 1.0], [1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]])
    distance, away = reach.tube(ship, T0, 0.0, choose_kernel(kernel)).nearest_many(positions)
    assert np.abs(distance).max() < 1e-139
    assert np.hypot(away[..., 0], away[..., 1]) == pytest.approx(1.0)
