from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion import reach
from companion.instant import Instant, instant
from companion.messages import SPREAD_AGES_S, Model, Tracks
from companion.planning.guard.foretold import foretold
from companion.planning.guard.watch import Watch
from tests.builders import T0, config, own, tracks

SHIP = {"speed_noise_mps": 0.1, "course_noise_rad": 0.02, "position_error_m": 5.0, "heading_error_rad": 0.05}


@pytest.mark.parametrize(
    ("later", "strays", "holds"),
    [
        ({"north_m": 300.0}, False, True),
        ({"north_m": 300.0 + 6.0 + 9.9}, False, True),  # the noise, and both position errors
        ({"north_m": 300.0 + 6.0 + 10.5}, True, False),
        ({"north_m": 300.0, "east_m": 16.0}, False, True),
        ({"north_m": 300.0, "east_m": 18.0}, True, False),
        ({"north_m": 300.0, "cog_rad": 0.039}, False, True),
        ({"north_m": 300.0, "cog_rad": 0.041}, True, False),
        ({"north_m": 300.0, "heading_rad": 0.099}, False, True),
        ({"north_m": 300.0, "heading_rad": 0.101}, True, False),
        ({"north_m": 300.0, "sog_mps": 5.19}, False, True),
        ({"north_m": 300.0, "sog_mps": 5.21}, True, False),
        ({"north_m": 0.0, "measured_at_s": 0.0}, False, True),  # nothing new
        (
            {"north_m": 0.0, "measured_at_s": 0.0, "position_error_m": 9.0},
            False,
            False,
        ),  # other bounds, same report
        ({"north_m": 300.0, "bow_m": 400.0}, False, False),  # longer than it was taken for
        ({"north_m": 300.0, "bow_m": 30.0}, False, True),
        ({"north_m": 900.0, "mmsi": 230_000_099}, False, False),  # never heard before
        ({"north_m": 3000.0, "measured_at_s": 600.0}, False, True),  # as long as the bounds last
        ({"north_m": 900.0, "measured_at_s": 700.0}, False, False),  # the bounds had ended
        ({"north_m": 300.0, "model": 1}, False, True),  # where it was foretold, as fast as foretold
        ({"north_m": 900.0, "model": 1}, True, False),
        ({"north_m": 300.0, "model": 1, "sog_mps": 0.3}, True, False),
    ],
)
def test_a_report_is_held_against_what_the_last_one_foretold(
    later: dict[str, float], strays: bool, holds: bool
) -> None:
    found = foretold(tracks(SHIP), tracks({**SHIP, "measured_at_s": 60.0, **later}))
    assert (len(found.strays) > 0, found.holds) == (strays, holds)


def test_a_ship_deeper_than_it_was_taken_for_was_not_foretold() -> None:
    before, after = tracks(SHIP), tracks({**SHIP, "north_m": 300.0, "measured_at_s": 60.0})
    assert not foretold(before, replace(after, draught_m=np.full(1, 9.0))).holds
    deep = replace(before, draught_m=np.full(1, 9.0))
    assert foretold(deep, replace(after, draught_m=np.full(1, 9.0))).holds


def test_a_ship_that_left_its_bounds_is_named() -> None:
    watch = Watch(config())
    watch.compare(tracks(SHIP), tracks({**SHIP, "north_m": 900.0, "measured_at_s": 60.0}))
    assert not watch.is_foretold
    (reason,) = watch.look(T0, own(), None, (0.0, 0.0))
    assert reason.code == "guard.report_unforetold"
    assert "230000001" in reason.text
    watch.compare(tracks(SHIP), tracks({**SHIP, "north_m": 300.0, "measured_at_s": 60.0}))
    assert watch.is_foretold


def test_an_mmsi_in_two_places_foretells_nothing() -> None:
    twice = tracks({**SHIP, "mmsi": 230_000_001}, {**SHIP, "mmsi": 230_000_001, "north_m": 5000.0})
    assert not foretold(twice, tracks({**SHIP, "north_m": 300.0, "measured_at_s": 60.0})).holds
    assert not foretold(Tracks.empty(), twice).holds


def test_a_picture_without_a_ship_that_was_in_it_promises_no_less() -> None:
    assert foretold(tracks(SHIP), Tracks.empty()).holds


MODELS = (Model.STRAIGHT, Model.DISC, Model.TURNING, Model.KITE, Model.BOX)


@given(st.sampled_from(MODELS), st.floats(1.0, 500.0), st.floats(-600.0, 600.0), st.floats(-600.0, 600.0))
def test_a_place_is_foretold_exactly_where_the_old_set_without_its_hull_reaches(
    model: Model, elapsed_s: float, north_m: float, east_m: float
) -> None:
    spread = np.outer(SPREAD_AGES_S, (1.0, 0.8, 0.5))[None]
    before = replace(
        tracks({**SHIP, "model": int(model), "disc_speed_mps": 1.0, "turn_rate_radps": 0.001}),
        spread_m=spread,
    )
    place = np.array((5.0 * elapsed_s * (model != Model.DISC) + north_m, east_m))
    moved = {"north_m": place[0], "east_m": place[1], "measured_at_s": elapsed_s}
    after = replace(tracks({**SHIP, "model": 1, **moved}), sog_mps=before.sog_mps, spread_m=spread)
    none = np.zeros(1)
    hulls = {"bow_m": none, "stern_m": none, "port_m": none, "starboard_m": none}
    points = replace(before, **hulls, position_error_m=np.full(1, 10.0))  # type: ignore[arg-type]
    distance = reach.at(points, Instant(round(elapsed_s * 1e9))).nearest(place).distance_m[0]
    if abs(distance) > 1e-3:
        assert (len(foretold(before, after).strays) > 0) == (distance > 0)


def test_learned_bounds_are_compared_too() -> None:
    spread = np.ones((1, len(SPREAD_AGES_S), 3))
    learned = replace(tracks({**SHIP, "model": int(Model.KITE)}), spread_m=spread)
    assert foretold(learned, replace(learned, revision=2)).holds
    assert not foretold(learned, replace(learned, spread_m=2 * spread)).holds
    assert not foretold(tracks({**SHIP, "model": int(Model.KITE)}), learned).holds  # no spread before
    assert foretold(tracks(SHIP), replace(tracks(SHIP), spread_m=spread)).holds  # a straight ship has none


EXACT = {"speed_noise_mps": 0.0, "course_noise_rad": 0.0, "position_error_m": 5.0, "heading_error_rad": 0.05}
FROM = {"north_m": 300.0, "east_m": -200.0, "measured_at_s": -50.0, "disc_speed_mps": 0.0}


@pytest.mark.parametrize("model", [Model.STRAIGHT, Model.DISC, Model.TURNING])
@pytest.mark.parametrize("course", [0.7, 2.5, -1.9])
@pytest.mark.parametrize("elapsed_s", [3.0, 60.0])  # a turning ship is asked at whole seconds
def test_only_where_the_ship_was_going_was_it_foretold(model: Model, course: float, elapsed_s: float) -> None:
    """Neither where it was, nor where the same run leads in any other direction or from any other place."""
    ship = {**EXACT, **FROM, "model": int(model), "cog_rad": course, "turn_rate_radps": 0.0}
    north, east = 5.0 * elapsed_s * np.cos(course), 5.0 * elapsed_s * np.sin(course)
    if model == Model.DISC:
        north = east = 0.0
    there = np.array((300.0 + north, -200.0 + east))
    others = [
        (n * 300.0 + a * north, e * -200.0 + b * east)
        for n in (1, -1)
        for e in (1, -1)
        for a in (1, 0, -1)
        for b in (1, 0, -1)
    ]
    others += [
        (300.0 + north / np.cos(course) ** 2, there[1]),
        (there[0], -200.0 + east / np.sin(course) ** 2),
    ]
    ring = np.linspace(0, 2 * np.pi, 17)
    others += [(there[0] + r * np.cos(a), there[1] + r * np.sin(a)) for r in (9.8, 10.2) for a in ring]
    for place in map(np.array, others):
        later = {"north_m": place[0], "east_m": place[1], "measured_at_s": -50.0 + elapsed_s}
        after = tracks({**ship, **later, "model": int(Model.DISC), "sog_mps": 5.0})
        off = float(np.hypot(*(place - there)))
        if abs(off - 10.0) > 0.05:
            assert (len(foretold(tracks(ship), after).strays) > 0) is (off > 10.0), (place, off)


@pytest.mark.parametrize(("before", "after"), [(0, 1), (1, 0), (1, 1), (2, 0), (0, 2), (3, 0)])
@pytest.mark.parametrize("column", ["cog_rad", "heading_rad"])
def test_a_course_is_foretold_of_a_ship_that_keeps_it_only(before: int, after: int, column: str) -> None:
    spread = np.outer(SPREAD_AGES_S, (50.0, 50.0, 50.0))[None]
    wide = {**SHIP, "position_error_m": 900.0, "heading_rad": 0.0}
    old = replace(tracks({**wide, "model": before}), spread_m=spread)
    new = replace(tracks({**wide, "model": after, "measured_at_s": 60.0, column: 2.0}), spread_m=spread)
    assert len(foretold(old, new).strays) == 0


@pytest.mark.parametrize("column", ["cog_rad", "heading_rad"])
@pytest.mark.parametrize(
    ("old", "new", "strays"), [(3.13, -3.13, False), (3.13, -3.0, True), (-2.0, 2.0, True)]
)
def test_courses_either_side_of_south_are_near_each_other(
    column: str, old: float, new: float, strays: bool
) -> None:
    wide = {**SHIP, "position_error_m": 900.0, "cog_rad": 0.0, "heading_rad": 0.0, "heading_error_rad": 0.02}
    before, after = tracks({**wide, column: old}), tracks({**wide, column: new, "measured_at_s": 60.0})
    assert (len(foretold(before, after).strays) > 0) is strays


def test_one_ship_of_two_that_changed_does_not_hide_behind_the_other() -> None:
    spread = np.ones((2, len(SPREAD_AGES_S), 3))
    kite = {**SHIP, "model": int(Model.KITE)}
    two = replace(tracks(kite, {**kite, "north_m": 900.0}), spread_m=spread)
    wider = spread.copy()
    wider[1] *= 2
    assert not foretold(two, replace(two, spread_m=wider)).holds
    elsewhere = replace(tracks({**SHIP, "north_m": 900.0}), spread_m=spread[:1])
    assert not foretold(tracks(SHIP), elsewhere).holds  # the same report in another place


def test_one_ship_may_report_anew_while_the_other_is_silent() -> None:
    two = tracks(SHIP, {**SHIP, "north_m": 900.0})
    later = tracks({**SHIP, "north_m": 300.0, "measured_at_s": 60.0}, {**SHIP, "north_m": 900.0})
    assert foretold(two, later).holds
    assert len(foretold(two, later).strays) == 0


def test_a_ship_that_left_its_bounds_is_told_for_half_a_minute_and_no_longer() -> None:
    watch = Watch(config())
    watch.compare(tracks(SHIP), tracks({**SHIP, "north_m": 900.0, "measured_at_s": 60.0}))
    said = [watch.look(instant(t), own(at_s=t), None, (0.0, 0.0)) for t in (0.0, 1.0, 30.0, 31.0, 32.0)]
    assert [len(reasons) for reasons in said] == [1, 1, 1, 0, 0]
