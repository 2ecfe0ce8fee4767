"""Stated bounds: what a report is worth, and that a ship within the assumptions stays in its set."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import reach
from companion.instant import instant
from companion.messages import Hull, Model, TargetKind, Tracks
from companion.picture.bounds import QUANTISATION_M
from tests.contact_reports import picture, report, static, tracks

HULL = Hull(100.0, 50.0, 10.0, 12.0)
T = 600.0  # the horizon of the default configuration


def row(table: Tracks, column: str) -> float:
    assert len(table) == 1
    return float(getattr(table, column)[0])


def test_a_ship_under_way_goes_straight_within_the_configured_noise() -> None:
    table = tracks(picture(report(0.0, hull=HULL), speed_noise_mps=0.05, course_noise_rad=0.01), 0.0)
    assert row(table, "model") == Model.STRAIGHT
    assert row(table, "speed_noise_mps") == 0.05
    assert row(table, "course_noise_rad") == 0.01
    assert row(table, "validity_s") == T
    assert row(table, "top_speed_mps") == 16.0


@pytest.mark.parametrize(("accurate", "error_m"), [(True, 10.0), (False, 30.0)])
def test_the_position_is_as_good_as_its_flag_and_its_time_stamp(accurate: bool, error_m: float) -> None:
    sharp = tracks(picture(report(0.0, accurate=accurate)), 0.0)
    assert row(sharp, "position_error_m") == pytest.approx(error_m + QUANTISATION_M)
    vague = tracks(picture(report(0.0, accurate=accurate, age_error_s=2.0)), 0.0)
    assert row(vague, "position_error_m") == pytest.approx(error_m + QUANTISATION_M + (5.0 + 0.25) * 2.0)


@pytest.mark.parametrize("missing", [{"sog_mps": None}, {"sog_mps": None, "cog_rad": None}])
def test_without_speed_a_ship_may_do_its_top_speed_anywhere(missing: dict[str, None]) -> None:
    table = tracks(picture(report(0.0, 0.0, 0.0, **missing)), 0.0)
    assert row(table, "model") == Model.DISC
    assert row(table, "disc_speed_mps") == 16.0
    assert row(table, "heading_error_rad") == math.pi


def test_a_speed_without_a_course_is_kept_any_way_until_its_validity_ends() -> None:
    heard = picture(report(0.0, cog_rad=None))
    table = tracks(heard, 0.0)
    assert (row(table, "model"), row(table, "heading_error_rad")) == (Model.DISC, math.pi)
    assert row(table, "disc_speed_mps") == 5.25
    assert (row(table, "validity_s"), row(table, "top_speed_mps")) == (T, 16.0)


def test_with_a_bounds_file_a_speed_without_a_course_may_be_the_top_speed() -> None:
    """Recorded ships change their speed, and of those without a course nothing was learned."""
    table = tracks(picture(report(0.0, cog_rad=None), bounds_file="houston"), 0.0)
    assert (row(table, "model"), row(table, "disc_speed_mps")) == (Model.DISC, 16.0)


@pytest.mark.parametrize(("status", "most_m"), [(1, 300.0), (5, 30.0), (6, 30.0)])
def test_a_ship_at_anchor_or_berth_stays_within_its_own_reach(status: int, most_m: float) -> None:
    """Whatever it does within its speed and that reach, it is inside its set, at every age."""
    said = report(0.0, sog_mps=0.1, navigational_status=status)
    heard = picture(said)
    table = tracks(heard, 0.0)
    assert row(table, "model") == Model.BOX
    assert table.spread_m.max() == min(most_m, 0.35 * T)
    for age_s in (1.0, 30.0, 59.0, 61.0, 80.0, 100.0, 130.0, 299.0, 400.0, 599.0):
        off_m = min(0.35 * age_s, most_m) + 10.0
        sets = reach.at(table, instant(age_s))
        for angle in np.linspace(0.0, math.tau, 9):
            assert sets.nearest(off_m * np.array((math.cos(angle), math.sin(angle)))).distance_m[0] <= 0.01
    assert reach.at(table, instant(500.0)).nearest(np.array((400.0, 400.0))).distance_m[0] > 0


@pytest.mark.parametrize(("status", "sog_mps"), [(1, 3.0), (5, 3.0), (0, 0.1), (None, 0.1)])
def test_who_moves_or_does_not_say_so_is_not_held_fast(status: int | None, sog_mps: float) -> None:
    table = tracks(picture(report(0.0, sog_mps=sog_mps, navigational_status=status)), 0.0)
    assert row(table, "model") in (Model.STRAIGHT, Model.DISC)


def test_a_ship_faster_than_the_top_speed_has_its_own() -> None:
    table = tracks(picture(report(0.0, sog_mps=18.5)), 0.0)
    assert row(table, "disc_speed_mps") == pytest.approx(18.75)


@pytest.mark.parametrize("cog_rad", [None, 1.0])
def test_a_slow_ship_is_a_small_disc_for_as_long_as_a_fast_one_goes_straight(cog_rad: float | None) -> None:
    heard = picture(report(0.0, sog_mps=0.1, cog_rad=cog_rad))
    table = tracks(heard, 0.0)
    assert row(table, "model") == Model.DISC
    assert row(table, "disc_speed_mps") == pytest.approx(0.35)
    assert (row(table, "validity_s"), row(table, "top_speed_mps")) == (T, 16.0)
    assert tracks(heard, 10 * T) is table


def test_a_report_that_may_be_older_than_it_says_is_valid_for_less() -> None:
    assert row(tracks(picture(report(0.0, age_error_s=2.0)), 0.0), "validity_s") == T - 2.0


def test_no_straight_ship_can_turn_back_within_the_noise() -> None:
    """The threshold follows the noise: v - w_v is never negative in a STRAIGHT row."""
    table = tracks(picture(report(0.0, sog_mps=0.9), speed_noise_mps=1.0), 0.0)
    assert row(table, "model") == Model.DISC


def test_a_heading_is_known_within_its_error_and_turns_with_the_course() -> None:
    table = tracks(picture(report(0.0, heading_rad=0.2)), 0.0)
    assert row(table, "heading_rad") == pytest.approx(0.2)
    assert row(table, "heading_error_rad") == pytest.approx(0.05 + 0.05)


def test_the_course_does_not_stand_in_for_a_heading() -> None:
    table = tracks(picture(report(0.0, heading_rad=None)), 0.0)
    assert row(table, "heading_error_rad") == math.pi


@pytest.mark.parametrize(
    ("kind", "length_m", "beam_m"),
    [(TargetKind.CLASS_A, 200.0, 32.0), (TargetKind.UNKNOWN, 200.0, 32.0), (TargetKind.CLASS_B, 25.0, 8.0)],
)
def test_a_hull_never_told_is_its_class_s_with_the_antenna_anywhere(
    kind: TargetKind, length_m: float, beam_m: float
) -> None:
    table = tracks(picture(report(0.0, kind=kind)), 0.0)
    assert row(table, "bow_m") == row(table, "stern_m") == length_m
    assert row(table, "port_m") == row(table, "starboard_m") == beam_m


def test_a_told_hull_is_taken_as_it_is() -> None:
    table = tracks(picture(report(0.0), static(0.0, hull=HULL)), 0.0)
    assert [row(table, f"{side}_m") for side in ("bow", "stern", "port", "starboard")] == [100, 50, 10, 12]


extreme = st.sampled_from([-1.0, 1.0])
quarter = st.sampled_from([0.0, math.pi / 2, math.pi, -math.pi / 2])


@settings(max_examples=100, deadline=None)
@given(
    sog=st.one_of(st.none(), st.floats(0.0, 14.0)),
    cog=st.one_of(st.none(), st.floats(-math.pi, math.pi)),
    heading=st.one_of(st.none(), st.floats(-math.pi, math.pi)),
    noise=st.tuples(extreme, extreme, extreme, st.sampled_from([0.0, 1.0]), quarter, extreme),
    age=st.sampled_from([0.0, 1.0, 20.0, 300.0, 589.0, 591.0, 900.0]),
    vague_s=st.sampled_from([0.0, 5.0, 40.0]),
    turns=st.floats(-math.pi, math.pi),
)
def test_a_ship_within_the_assumptions_is_wholly_inside_its_set(
    sog: float | None,
    cog: float | None,
    heading: float | None,
    noise: tuple[float, ...],
    age: float,
    vague_s: float,
    turns: float,
) -> None:
    """A truth is made, reported with errors at their worst, sailed on, and its corners looked for."""
    speed_bit, course_bit, heading_bit, off_m, off_to, late = noise
    measured_s = 100.0
    said = report(
        110.0,
        10.0 * off_m * math.cos((cog or 0.0) + off_to),
        10.0 * off_m * math.sin((cog or 0.0) + off_to),
        measured_at=instant(measured_s),
        age_error_s=vague_s,
        sog_mps=sog,
        cog_rad=cog,
        heading_rad=heading,
        hull=HULL,
    )
    true_since_s = measured_s + late * vague_s  # when it really was at the origin
    now_s = 110.0 + age
    sailed_s = now_s - true_since_s
    kept_s = min(sailed_s, 600.0)  # it keeps its bounds so long, then does anything
    if sog is None:
        speed, course = 16.0 * abs(speed_bit), turns
    elif cog is None or sog < 0.5:
        speed, course = (sog + 0.25) * abs(speed_bit), turns
    else:
        speed, course = sog + 0.25 * speed_bit, cog + 0.05 * course_bit
    if heading is None or sog is None or cog is None or sog < 0.5 or sailed_s > kept_s:
        lies = turns
    else:
        lies = heading + 0.05 * heading_bit + (course - cog)
    way, freely = kept_s * speed, (sailed_s - kept_s) * 16.0
    north = way * math.cos(course) + freely * math.cos(turns)
    east = way * math.sin(course) + freely * math.sin(turns)
    table = tracks(picture(said), now_s)
    sets = reach.at(table, instant(now_s))
    for ahead, right in ((100.0, 12.0), (100.0, -10.0), (-50.0, 12.0), (-50.0, -10.0)):
        corner = (
            north + ahead * math.cos(lies) - right * math.sin(lies),
            east + ahead * math.sin(lies) + right * math.cos(lies),
        )
        distance_m = sets.nearest(table.north_m[:1].repeat(2) * 0.0 + corner).distance_m
        assert distance_m[0] <= 0.01


def test_a_ship_whose_sensor_says_so_is_taken_to_turn_or_to_end_its_turn() -> None:
    turning = tracks(picture(report(0.0, turn_rate_radps=-0.01)), 0.0)
    assert row(turning, "model") == Model.TURNING
    rate, error = row(turning, "turn_rate_radps"), row(turning, "turn_rate_error_radps")
    assert (rate - error, rate + error) == pytest.approx((-0.011, 0.001))
    assert 200 < row(turning, "validity_s") < math.pi / 0.011
    for slow in (None, 0.002):
        assert row(tracks(picture(report(0.0, turn_rate_radps=slow)), 0.0), "model") == Model.STRAIGHT
    never = picture(report(0.0, turn_rate_radps=-0.01), turning_above_radps=0.0)
    assert row(tracks(never, 0.0), "model") == Model.STRAIGHT
