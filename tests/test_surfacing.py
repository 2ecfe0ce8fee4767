from functools import partial

import numpy as np
import pytest

from companion.config import Config
from companion.instant import instant
from companion.messages import FloatArray, Phase, Reason, Tracks
from companion.planning.mission import Mission
from companion.planning.surfacing import Surfacing
from tests.builders import T0, config, own, tracks

GOAL = np.array((5000.0, 0.0))


def look(
    ships: Tracks, at_s: float = 0.0, settings: Config | None = None, goal_m: FloatArray = GOAL
) -> tuple[FloatArray | None, set[str]]:
    surfacing, reasons = Surfacing(settings or config()), list[Reason]()
    surfacing.begin(T0)
    place = surfacing.look(instant(at_s), own(at_s=at_s), ships, goal_m, reasons)
    return place, {reason.code for reason in reasons}


def far(**row: float) -> Tracks:
    return tracks({"east_m": 3000.0, **row})


def test_with_fresh_information_it_stays_down() -> None:
    assert look(far()) == (None, set())


def test_it_goes_up_before_the_validity_runs_out_if_that_is_before_the_goal() -> None:
    # 120 s of reserve, 240 s of stay, 600 s of validity
    place, codes = look(far(), at_s=230.0)
    assert (place, codes) == (None, set())
    place, codes = look(far(), at_s=241.0)
    assert codes == {"plan.information_ends"}
    assert place == pytest.approx((0.0, 0.0))


def test_near_the_goal_the_information_need_not_last_longer() -> None:
    assert look(far(), at_s=400.0, goal_m=np.array((300.0, 0.0))) == (None, set())


def test_without_a_way_forward_it_asks_for_new_reports() -> None:
    lasting = far(validity_s=1e5, course_noise_rad=0.0, speed_noise_mps=0.0)
    assert look(lasting, at_s=299.0)[1] == set()
    surfacing, reasons = Surfacing(config()), list[Reason]()
    surfacing.begin(T0)
    for second in range(0, 310, 5):
        surfacing.look(instant(second), own(at_s=second), lasting, GOAL, reasons)
    assert {reason.code for reason in reasons} == {"plan.does_not_fit"}


def test_a_set_nearby_that_has_become_too_large_is_a_reason() -> None:
    wide = far(validity_s=1e5, course_noise_rad=0.3, east_m=300.0)
    assert "plan.set_too_large" in look(wide, at_s=120.0)[1]


def test_at_fixed_intervals_nothing_else_counts() -> None:
    settings = config(surfacing={"every_s": 100.0})
    assert look(far(), at_s=99.0, settings=settings)[1] == set()
    place, codes = look(Tracks.empty(), at_s=100.0, settings=settings)
    assert codes == {"plan.surfacing_interval"}
    assert place == pytest.approx((0.0, 0.0))


def test_under_a_ship_that_passes_it_stays_down_and_says_when_it_can() -> None:
    overhead = tracks({"north_m": -1000.0, "measured_at_s": 60.0, "validity_s": 305.0})
    surfacing, reasons = Surfacing(config()), list[Reason]()
    surfacing.begin(T0)
    state = own(at_s=241.0)
    place = surfacing.look(instant(241.0), state, overhead, np.array((0.0, 5000.0)), reasons)
    assert not surfacing.is_free(instant(241.0), own(), overhead)
    assert {reason.code for reason in reasons} >= {"plan.information_ends"}
    assert place is None or np.hypot(*place) > 0


def test_where_no_surface_is_free_for_long_enough_it_says_so() -> None:
    ring = tracks({"sog_mps": 0.0, "model": 1.0, "disc_speed_mps": 5.0})
    place, codes = look(ring, at_s=500.0)
    assert place is None
    assert "plan.cannot_surface" in codes


def test_whom_the_last_listening_did_not_hear_again_is_no_reason_to_go_up_again() -> None:
    """Else a ship out of earshot keeps the vehicle going up and down at one place."""
    out_of_earshot = {"east_m": 60_000.0, "measured_at_s": -400.0}
    assert look(tracks(out_of_earshot), at_s=100.0) == (None, set())
    assert look(tracks(out_of_earshot, {"east_m": 3000.0}), at_s=241.0)[1] == {"plan.information_ends"}


def test_the_mission_goes_up_listens_and_goes_on() -> None:
    mission, clear = Mission(config().vehicle, config().goal), lambda: True
    steps = [(0, 0.0, False), (1, 0.0, False), (61, 0.0, False), (70, 45.0, True), (80, 20.0, True)]
    phases = []
    for t, depth, must in [*steps, (170, 0.5, True), (171, 0.5, True), (240, 0.5, True)]:
        renew = partial(bool, must)
        phases.append(mission.advance(instant(t), own(depth_m=depth), 900.0, 1, clear, renew))
    listen, cross, rise = Phase.LISTEN, Phase.CROSS, Phase.RISE
    assert phases == [listen, listen, cross, rise, rise, listen, listen, cross]
    assert mission.crossings == 2
