import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from companion.planning.halfspace import nearest_velocity

LIMIT = 2.5
angles = st.floats(0, 2 * np.pi)
speeds = st.floats(0, LIMIT)
rules = st.lists(st.tuples(angles, st.floats(-2 * LIMIT, LIMIT)), min_size=1, max_size=8)


def _polar(angle: float, radius: float) -> np.ndarray:
    return radius * np.array((np.cos(angle), np.sin(angle)))


def _grid() -> np.ndarray:
    radius, angle = np.meshgrid(np.linspace(0, LIMIT, 26), np.linspace(0, 2 * np.pi, 181))
    return np.column_stack(((radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()))


GRID = _grid()


@given(angles, speeds, rules)
def test_no_point_of_a_dense_grid_is_better(
    angle: float, speed: float, rows: list[tuple[float, float]]
) -> None:
    wanted = _polar(angle, speed)
    away = np.array([_polar(a, 1.0) for a, _ in rows])
    bound = np.array([b for _, b in rows])
    kept, feasible = nearest_velocity(wanted, away, bound, LIMIT)
    grid = GRID
    allowed = (grid @ away.T >= bound).all(axis=1)
    if feasible:
        assert (away @ kept >= bound - 1e-8).all()
        assert np.hypot(*kept) <= LIMIT + 1e-8
        if allowed.any():
            best = np.hypot(*(grid[allowed] - wanted).T).min()
            assert np.hypot(*(kept - wanted)) <= best + 1e-7
    else:
        # nothing with room to spare exists
        assert not (grid @ away.T >= bound + 1e-6).all(axis=1).any()


@given(angles, speeds, rules)
def test_a_velocity_that_keeps_every_rule_passes_untouched(
    angle: float, speed: float, rows: list[tuple[float, float]]
) -> None:
    wanted = _polar(angle, speed)
    away = np.array([_polar(a, 1.0) for a, _ in rows])
    bound = away @ wanted - 0.01
    kept, feasible = nearest_velocity(wanted, away, bound, LIMIT)
    assert feasible
    assert kept is wanted


def test_between_two_ships_the_least_bad_velocity_is_said_to_be_so() -> None:
    away = np.array(((1.0, 0.0), (-1.0, 0.0)))
    kept, feasible = nearest_velocity(np.array((2.0, 0.0)), away, np.array((0.5, 0.5)), LIMIT)
    assert not feasible
    assert abs(kept[0]) < 0.2
