"""The exact field: eq. (8) as written beyond delta, outward inside it, one sign everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import reach
from companion.config import Field
from companion.messages import FloatArray, Tracks
from companion.planning.attraction import attraction
from companion.planning.field import SINGULAR_GAP_M, ExactRepulsion, repulsion_strength
from tests.builders import T0, tracks
from tests.ships import random_ships

FIELD = Field()


def potential(ships: Tracks, position: FloatArray) -> FloatArray:
    """Eq. (8) of each ship, from the distance alone."""
    gap = reach.tube(ships, T0, FIELD.horizon_s).nearest(position).distance_m - FIELD.delta_m
    return np.asarray(FIELD.k_r / 2 * (1 / gap) ** 2, dtype=np.float64)


def test_repulsion_points_from_the_ship_to_the_vehicle() -> None:
    north_of_it = ExactRepulsion(FIELD)(tracks({"cog_rad": np.pi / 2}), T0, 0.0, np.array([100.0, 0.0]))
    assert north_of_it.velocity[0, 0] > 0
    assert north_of_it.velocity[0, 1] == pytest.approx(0.0, abs=1e-12)
    assert not north_of_it.from_network.any()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_repulsion_is_minus_the_gradient_of_equation_8(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ships = random_ships(rng, 30)
    position, step = rng.normal(0, 9000, 2), 1e-3
    exact = ExactRepulsion(FIELD)(ships, T0, FIELD.horizon_s, position)
    far = exact.nearest.distance_m > FIELD.delta_m + 2 * SINGULAR_GAP_M
    sides = [np.array((step, 0.0)), np.array((0.0, step))]
    slope = [(potential(ships, position + d) - potential(ships, position - d)) / (2 * step) for d in sides]
    strength = np.hypot(*exact.velocity.T)[:, None]
    # the finite difference of a curved potential: relative to its strength
    error = (exact.velocity + np.column_stack(slope)) / (strength + 1e-12)
    assert np.abs(error)[far].max(initial=0) < 2e-2


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_repulsion_points_away_from_every_point_of_the_set(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ships = random_ships(rng, 5)
    sets, position = reach.tube(ships, T0, FIELD.horizon_s), rng.normal(0, 9000, 2)
    push = ExactRepulsion(FIELD).from_nearest(sets.nearest(position))
    outside = push.nearest.distance_m > 0
    for i in np.flatnonzero(outside):
        towards_set = sets.outline(int(i)) - position
        assert (towards_set @ push.nearest.away[i] <= 1e-3).all()


def test_its_strength_is_the_papers_beyond_delta() -> None:
    distance = np.array([6.0, 19.42, 105.0])
    expected = [15000.0, 15000 / 14.42**3, 15000 / 100.0**3]
    assert repulsion_strength(distance, 15000.0, 5.0) == pytest.approx(expected)


def test_within_a_metre_of_delta_and_inside_the_set_it_stays_outward_and_at_its_saturation() -> None:
    strength = repulsion_strength(np.array([6.0, 5.1, 5.0, 4.9, 0.0, -50.0]), 15000.0, 5.0)
    assert strength == pytest.approx(np.full(6, 15000.0))
    inside = ExactRepulsion(FIELD)(tracks({}), T0, 0.0, np.array([0.0, 11.0]))
    assert inside.nearest.distance_m[0] < 0
    assert inside.velocity[0] == pytest.approx([0.0, 15000.0], abs=1e-6)


def test_unit_attraction_balances_the_repulsion_at_the_papers_distance() -> None:
    balance_m = FIELD.delta_m + (FIELD.k_r / FIELD.k_p) ** (1 / 3)
    assert balance_m == pytest.approx(19.4, abs=0.03)
    pull = attraction(np.zeros(2), np.array([300.0, 400.0]), FIELD.k_p, "unit")
    assert np.hypot(*pull) == pytest.approx(
        repulsion_strength(np.array([balance_m]), FIELD.k_r, FIELD.delta_m)[0]
    )


def test_proportional_attraction_is_minus_the_gradient_of_equation_6() -> None:
    goal, position, step = np.array([300.0, -400.0]), np.array([10.0, 20.0]), 1e-3
    pull = attraction(position, goal, FIELD.k_p, "proportional")
    for axis in range(2):
        d = np.eye(2)[axis] * step
        u = [FIELD.k_p / 2 * ((p - goal) ** 2).sum() for p in (position - d, position + d)]
        assert pull[axis] == pytest.approx(-(u[1] - u[0]) / (2 * step), rel=1e-6)


def test_the_repulsions_of_many_ships_are_those_of_each_alone() -> None:
    ships = random_ships(np.random.default_rng(1), 20)
    position = np.array([100.0, 200.0])
    together = ExactRepulsion(FIELD)(ships, T0, 300.0, position).velocity
    for i in range(20):
        alone = reach.shapes.only(ships, np.array([i]))
        assert ExactRepulsion(FIELD)(alone, T0, 300.0, position).velocity[0] == pytest.approx(
            together[i], rel=1e-9
        )


def test_no_contacts_give_no_repulsion() -> None:
    assert ExactRepulsion(FIELD)(Tracks.empty(), T0, 600.0, np.zeros(2)).velocity.shape == (0, 2)
