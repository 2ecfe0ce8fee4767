import numpy as np
import pytest

from sitl.studies.guard import Part, configuration, trials
from sitl.studies.guard_trial import PLANNERS, asking, run_trial
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


@pytest.mark.parametrize("traffic", TRAFFICS)
def test_the_true_ships_stay_within_what_is_known_of_them(traffic: str) -> None:
    rng = np.random.default_rng(5)
    lanes = Lanes(traffic, rng, renewed_s=20.0)  # type: ignore[arg-type]
    config = configuration("submarine", 1.0)
    outcome = run_trial(config, lanes, "bow", rng, asking(config), 60.0)
    assert outcome.closest_hull_m >= outcome.closest_set_m or not outcome.viable
