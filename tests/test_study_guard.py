import numpy as np
import pytest

from sitl.studies.guard import Part, configuration, trials
from sitl.studies.guard_trial import asking, run_trial
from sitl.studies.hostile import PLANNERS
from sitl.studies.lanes_picture import TRAFFICS, Lanes


def outcomes(guard: str, count: int, duration_s: float = 40.0) -> list[float]:
    part = Part(guard, 0, count, 3, duration_s, 1.0, "numpy")
    return [outcome.closest_set_m for outcome in trials(part)]


def test_no_hostile_planner_gets_the_vehicle_within_delta_of_a_set() -> None:
    """Every planner, both traffics, both vehicles once; the study runs thousands."""
    assert len(PLANNERS) * len(TRAFFICS) * 2 == 24
    assert min(outcomes("way out", 24)) >= configuration("submarine", 1.0).field.delta_m


def test_without_a_guard_and_with_a_mere_filter_the_same_planners_do() -> None:
    assert min(outcomes("none", 24, 80.0)) < 5.0
    assert len(outcomes("half-space", 6)) == 6


def test_a_trial_is_the_same_whoever_computes_it() -> None:
    assert outcomes("way out", 3) == outcomes("way out", 3)


def test_other_dynamics_than_the_guards_own_come_no_nearer() -> None:
    part = Part("way out", 0, 24, 9, 40.0, 1.0, "numpy", "physics")
    assert min(outcome.closest_set_m for outcome in trials(part)) >= 5.0


def test_ships_that_leave_their_bounds_are_told_of_and_evaded() -> None:
    found = trials(Part("way out", 0, 12, 4, 60.0, 1.0, "numpy", broken=True))
    assert sum(outcome.unforetold for outcome in found) >= 11
    struck = [outcome for outcome in found if outcome.closest_hull_m < 0]
    assert len(struck) <= 1
    assert all(outcome.no_way_out > 0 for outcome in struck)  # and it had said so


def test_a_start_beside_a_ship_is_flown_with_a_way_out_or_without() -> None:
    part = Part("way out", 0, 24, 5, 30.0, 1.0, "numpy", beside_m=15.0)
    found = trials(part)
    assert {outcome.viable for outcome in found} == {True, False}
    assert min(outcome.closest_set_m for outcome in found if outcome.viable) >= 5.0
    assert all(outcome.no_way_out > 0 for outcome in found if not outcome.viable)


@pytest.mark.parametrize("traffic", TRAFFICS)
def test_the_true_ships_stay_within_what_is_known_of_them(traffic: str) -> None:
    rng = np.random.default_rng(5)
    lanes = Lanes(traffic, rng, renewed_s=20.0)  # type: ignore[arg-type]
    config = configuration("submarine", 1.0)
    outcome = run_trial(config, lanes, "bow", rng, asking(config), 60.0)
    assert outcome.closest_hull_m >= outcome.closest_set_m or not outcome.viable
