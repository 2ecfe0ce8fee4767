"""What the guard keeps from step to step: the way out, what was sent, when it searched last."""

from dataclasses import replace

import numpy as np
import pytest

from companion.instant import Instant, elapsed_s, instant
from companion.messages import Tracks
from companion.planning.guard import Guard, Velocity, Verdict
from companion.planning.guard.search import Search
from tests.builders import T0, config, heartbeat, own, tracks

STILL = {"sog_mps": 0.0, "speed_noise_mps": 0.0, "heading_error_rad": 0.0, "validity_s": 1500.0}
NEAR = tracks({**STILL, "north_m": 37.5 + 15.2 + 5.0})
AHEAD = (2.0, 0.0, 0.0)


def step(
    guard: Guard, t: float, ships: Tracks, wanted: Velocity | None, north_m: float = 0.0, **how: object
) -> Verdict:
    state = own(north_m, at_s=t)
    return guard.check(instant(t), state, heartbeat(t, **how), ships, 1, wanted)


@pytest.mark.parametrize(("current_mps", "speed_mps"), [(0.0, 2.5), (0.3, 2.2), (2.45, 0.1)])
def test_ways_out_are_run_at_what_the_current_leaves_of_full_speed(
    current_mps: float, speed_mps: float
) -> None:
    guard = Guard(config(guard={"current_mps": current_mps}))
    step(guard, 0.0, tracks({**STILL, "north_m": 37.5 + 10.0}), (0.0, 0.0, 0.0))
    assert guard._way_out is not None
    assert guard._way_out.speed_mps == pytest.approx(speed_mps)


def test_before_and_after_hands_off_nothing_was_sent() -> None:
    guard = Guard(config(timing={"rate_hz": 4.0, "setpoint_validity_s": 1.0}))
    assert guard._sent == (0.0, 0.0, 0.0)
    assert guard._period_s == 0.25
    assert step(guard, 0.0, Tracks.empty(), AHEAD).velocity_ned_mps == guard._sent == AHEAD
    closed = step(guard, 0.1, Tracks.empty(), AHEAD, armed=False)
    assert guard._sent == (0.0, 0.0, 0.0)
    assert closed.changed is False


def test_every_reason_of_a_step_is_told() -> None:
    guard = Guard(config())
    step(guard, 0.0, NEAR, (0.0, 0.0, 0.0))
    verdict = step(guard, 0.5, NEAR, None, north_m=-80.0)
    assert {"guard.no_plan", "guard.position_accuracy"} <= {reason.code for reason in verdict.reasons}


def test_without_a_plan_it_neither_rises_nor_dives_and_in_a_sea_that_emptied_it_stops() -> None:
    guard = Guard(config())
    step(guard, 0.0, NEAR, (0.0, 0.0, 0.3))
    silent = step(guard, 0.1, NEAR, None).velocity_ned_mps
    assert silent is not None
    assert silent[2] == 0.0
    assert step(guard, 0.2, Tracks.empty(), None).velocity_ned_mps == (0.0, 0.0, 0.0)


def test_in_vain_it_searches_every_two_fifths_of_a_second_at_once_and_after_longer_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Twice each time: after what is wanted, and from where the vehicle is."""
    asked: list[tuple[float, float]] = []
    best = Search.best

    def counted(self: Search, now: Instant, *args: object) -> object:
        asked.append((elapsed_s(T0, now), float(args[3]) if len(args) > 3 else 0.0))  # type: ignore[arg-type]
        return best(self, now, *args)  # type: ignore[arg-type]

    monkeypatch.setattr(Search, "best", counted)
    guard, upon_us = Guard(config()), tracks({**STILL, "bow_m": 400.0, "stern_m": 400.0, "port_m": 400.0})
    for k in range(20):
        assert not step(guard, k / 10, upon_us, (0.0, 0.0, 0.0)).way_out
    waits = (0.0, 15.0, 0.0, 30.0, 0.0)
    assert asked == [
        each
        for k, wait_s in enumerate(waits)
        for each in ((round(0.4 * k, 1), wait_s), (round(0.4 * k, 1), 0.0))
    ]


@pytest.mark.parametrize(("speed_mps", "wait_s"), [(1.15, 0.0), (2.3, 0.0), (2.3, 60.0)])
def test_a_stored_way_out_keeps_its_speed_and_its_wait(speed_mps: float, wait_s: float) -> None:
    guard = Guard(config())
    step(guard, 0.0, NEAR, (0.0, 0.0, 0.0))
    first = guard._beginning(T0, own(), (0.0, 0.0, 0.0), (0.0, 0.0), 0.1)
    for change in (replace, lambda kept, **_: kept):  # begun anew by itself, and beside a verified one
        if change is replace:
            guard._way_out = guard._search.toward(T0, first, (-90.0, 30.0), speed_mps, wait_s)
            guard._beside = None
        now = 0.1 if change is replace else 0.2
        assert step(guard, now, NEAR, (0.0, 0.0, 0.0)).way_out
        assert guard._way_out is not None
        assert guard._way_out.speed_mps == pytest.approx(speed_mps)
        assert guard._way_out.wait_s(instant(now)) == pytest.approx(max(wait_s - now, 0.0), abs=0.7)
        assert np.hypot(guard._way_out.end_m[0] + 90.0, guard._way_out.end_m[1] - 30.0) < 20.0


def test_beside_a_way_out_there_is_the_room_that_was_looked_for_and_none_is_used_below_ships() -> None:
    for vertical in ("ignore", "clear_below"):
        guard = Guard(config(guard={"vertical": vertical}))
        for k in range(3):
            t = k / 10
            state = own(depth_m=0.0, at_s=t)
            assert guard.check(state.stamp, state, heartbeat(t), NEAR, 1, (0.0, 0.0, 0.0)).way_out
        if vertical == "clear_below":
            assert guard._beside is None
        else:
            assert guard._beside is not None
            assert 5.0 < guard._beside.at_m.max() < 13.0
