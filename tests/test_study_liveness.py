"""The study of what a guard costs, in small."""

from sitl.studies.liveness import Part, run_part


def test_a_planner_that_means_well_is_let_through_between_two_lanes() -> None:
    """No single run leads out there: not told what it intends the guard changes 72 setpoints."""
    (guarded,) = run_part(1, Part("stream", "way out", 0, 1))
    assert guarded.time_s is not None
    assert guarded.changed == 0
    assert guarded.to_set_m > 15.0
