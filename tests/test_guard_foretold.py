from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion import reach
from companion.instant import Instant
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
