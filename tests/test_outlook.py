"""Whether there is a safe way: asked before leaving and on the way, answered a little at every step."""

from dataclasses import replace

import numpy as np
import pytest

from companion.config import Config
from companion.instant import after, instant
from companion.loop import Tick
from companion.messages import Decision, Model, Phase, Reason, Status, StatusText, Tracks
from companion.planning import outlook
from companion.planning.field import ExactRepulsion
from companion.planning.outlook import Outlook
from companion.planning.rehearsal import CAST, STEP_S, Rehearsal
from companion.planning.steering import Steering
from sitl.studies import age
from sitl.studies.ships import draw
from tests.builders import own
from tests.test_core import LAT, LON, Vehicle, core, frame

NOW = instant(0.0)
GOAL_M = np.array((0.0, 330.0))


def stream(age_s: float, trial: int = 0) -> Tracks:
    """Endless traffic as reported `age_s` ago, off an edge at the origin."""
    return draw(age.case_of(age_s), 5, range(trial, trial + 1)).reported


def settings(**planner: object) -> Config:
    return age.case_of(0).settings({"horizon": "clearing", **planner})


def steps_to_an_answer(
    subject: Outlook, tracks: Tracks, phase: Phase = Phase.LISTEN, at_s: float = 0.0, east_m: float = 0.0
) -> int:
    for step in range(1, 5000):
        subject.look(after(NOW, at_s), phase, own(0.0, east_m), tracks, GOAL_M)
        if not subject.is_playing:
            return step
    raise AssertionError("it has no end")


def refusal(subject: Outlook) -> str:
    reasons: list[Reason] = []
    return "" if subject.may_leave(reasons) else reasons[0].text


@pytest.mark.parametrize("trial", range(3))
def test_fresh_information_is_left_on_and_old_information_is_not(trial: int) -> None:
    subject = Outlook(settings())
    steps_to_an_answer(subject, stream(0.0, trial))
    assert refusal(subject) == ""
    subject = Outlook(settings())
    steps_to_an_answer(subject, stream(600.0, trial))
    assert "no safe way on reports up to 600 s old" in refusal(subject)


def test_the_vehicle_waits_for_the_first_answer() -> None:
    subject, reasons = Outlook(settings()), list[Reason]()
    subject.look(NOW, Phase.LISTEN, own(), stream(0.0), GOAL_M)
    assert subject.is_playing
    assert not subject.may_leave(reasons)
    assert reasons == []


def test_a_ship_heard_for_the_first_time_is_looked_at_before_leaving() -> None:
    subject, tracks = Outlook(settings()), stream(600.0)
    assert steps_to_an_answer(subject, Tracks.empty()) == 1
    assert refusal(subject) == ""
    subject.look(NOW, Phase.LISTEN, own(), tracks, GOAL_M)
    assert subject.is_playing


def test_little_by_little_it_finds_what_a_rehearsal_in_one_go_finds() -> None:
    config, tracks = settings(), stream(420.0)
    whole = Rehearsal(config, Steering(config, ExactRepulsion(config.field)))
    subject = Outlook(config)
    steps = steps_to_an_answer(subject, tracks)
    found = whole(tracks, NOW, np.zeros((1, 2)), GOAL_M)
    assert bool(found.safe[0]) == (refusal(subject) == "")
    # never more rows in a step than the loop has time for
    moments = 330.0 / 2.5 / STEP_S
    assert steps > 0.5 * moments * len(tracks) * len(CAST) / outlook.ROWS_A_STEP


def test_the_paper_planner_and_who_does_not_want_it_are_never_refused() -> None:
    for config in (settings(rehearse=False), age.case_of(0).settings({"horizon": "paper"})):
        subject = Outlook(config)
        assert steps_to_an_answer(subject, stream(600.0)) == 1
        assert refusal(subject) == ""


def test_under_way_it_holds_on_the_near_side_and_goes_on_once_it_has_begun_to_cross() -> None:
    subject, tracks = Outlook(settings()), stream(600.0)
    steps_to_an_answer(subject, tracks, Phase.CROSS)
    reasons: list[Reason] = []
    post = subject.post(own(0.0, 5.0), tracks, reasons)
    assert post is not None
    assert post.tolist() == [0.0, 5.0]
    assert [r.code for r in reasons] == ["plan.no_safe_way"]
    assert subject.holds
    # driven off a little it goes back to its post; beyond the first lane there is no way back
    assert subject.post(own(0.0, 8.0), tracks, reasons) is post
    assert subject.post(own(0.0, 60.0), tracks, reasons) is None
    assert not subject.holds


def test_under_way_what_was_found_safe_is_given_up_only_when_it_is_not_safe_at_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    subject = Outlook(settings())
    steps_to_an_answer(subject, stream(0.0))
    monkeypatch.setattr(outlook, "MARGIN_M", 50.0)
    steps_to_an_answer(subject, stream(0.0), Phase.CROSS, at_s=outlook.EVERY_S)
    assert refusal(subject) == ""
    steps_to_an_answer(subject, stream(0.0), at_s=2 * outlook.EVERY_S)  # before leaving the margin counts
    assert refusal(subject) != ""


def once(tracks: Tracks) -> str:
    subject = Outlook(settings())
    steps_to_an_answer(subject, tracks)
    return refusal(subject)


def test_whom_the_sets_are_too_dear_or_too_wide_for_is_left_to_field_and_guard() -> None:
    old = stream(600.0)
    turning = replace(old, model=np.full(len(old), Model.TURNING))
    silent = replace(old, validity_s=np.full(len(old), 500.0))
    assert once(turning) == ""
    assert once(silent) == ""


def test_it_looks_only_as_far_as_reports_are_believed() -> None:
    old = stream(450.0)
    assert once(old) != ""
    soon_over = replace(old, validity_s=np.full(len(old), 460.0))
    assert once(soon_over) == ""  # by then it has surfaced for news


def decisions_at_an_edge(age_s: int, seconds: float) -> list[Decision]:
    """A core at the surface before two lanes of ships it last heard `age_s` ago."""
    contacts: dict[str, object] = {
        "speed_noise_mps": 0.05,
        "course_noise_rad": 0.01,
        "position_error_m": 1.0,
        "coarse_position_error_m": 1.0,
        "validity_s": 1500.0,
    }
    goal: dict[str, object] = {"latitude_deg": LAT + 400 / 111_400, "longitude_deg": LON}
    subject = core(vehicle={"listen_s": 25.0}, contacts=contacts, goal=goal)
    vehicle, found = Vehicle(), list[Decision]()
    for k in range(round(seconds * 10)):
        t = instant(k / 10)
        data = vehicle.position(k / 10)
        if k % 10 == 0:
            data += vehicle.heartbeat()
        if k == 0:
            for lane, sails in ((90.0, 1), (205.0, -1)):
                for i in range(20):
                    ahead_m = 450.0 * (i - 10) - 5.0 * age_s
                    cog = 9000 if sails > 0 else 27000
                    mmsi = 230_000_000 + 100 * round(lane) + i
                    data += vehicle.ship(mmsi, lane, sails * ahead_m, age_s, COG=cog, heading=cog)
        found.append(subject.step(Tick(t, (frame(t, data),))))
    return found


def test_the_core_says_so_does_not_leave_and_tells_the_operator() -> None:
    decisions = decisions_at_an_edge(600, 60.0)
    last = decisions[-1]
    assert last.phase is Phase.LISTEN
    assert last.status is Status.DEGRADED
    assert "plan.no_safe_way" in [r.code for r in last.reasons]
    texts = [m.text for d in decisions for m in d.outgoing if isinstance(m, StatusText)]
    assert any("no safe way on reports up to" in text for text in texts)


def test_the_core_leaves_on_fresh_reports() -> None:
    decisions = decisions_at_an_edge(1, 40.0)
    assert decisions[-1].phase is Phase.CROSS
    assert not any(r.code == "plan.no_safe_way" for d in decisions for r in d.reasons)
