"""A report the ship cannot have sent: quarantined beside what was known, until the ship itself decides."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.instant import instant
from companion.messages import Tracks
from companion.picture import Picture
from tests.contact_reports import SHIP, picture, report, tracks

FAR = 20_000.0


def sail(start_s: float, count: int, east_m: float = 0.0, every_s: float = 10.0) -> list:  # type: ignore[type-arg]
    """Reports of a ship that goes north at 5 m/s along `east_m`."""
    times = [start_s + every_s * i for i in range(count)]
    return [report(t, 5.0 * t, east_m) for t in times]


def weave(start_s: float, count: int, east_m: float) -> list:  # type: ignore[type-arg]
    """The same with the scatter of a GNSS receiver: 5 m to either side in turn."""
    sides = [-5.0 if i % 2 else 5.0 for i in range(count)]
    return [
        report(start_s + 10.0 * i, 5.0 * (start_s + 10.0 * i), east_m + side) for i, side in enumerate(sides)
    ]


def easts(table: Tracks) -> list[int]:
    """Where the rows are, in kilometres east."""
    return sorted(round(east_m / 1000.0) for east_m in table.east_m)


def codes(heard: Picture, at_s: float) -> set[str]:
    return {reason.code for reason in heard.notes(instant(at_s))}


def test_a_teleport_for_one_report_keeps_both_places_until_the_ship_speaks_again() -> None:
    heard = picture(*sail(0.0, 5), report(50.0, 250.0, FAR))
    assert easts(tracks(heard, 50.0)) == [0, 20]
    assert heard.counts["picture.quarantined"] == 1
    assert "picture.quarantined" in codes(heard, 50.0)
    heard.observe(report(60.0, 300.0))
    assert easts(tracks(heard, 60.0)) == [0, 20]
    heard.observe(report(70.0, 350.0))
    assert easts(tracks(heard, 70.0)) == [0]
    assert heard.counts["picture.refuted"] == 1
    assert "picture.quarantined" not in codes(heard, 70.0)


def test_a_doubt_that_silence_leaves_open_stays_open() -> None:
    heard = picture(*sail(0.0, 5), report(50.0, 250.0, FAR))
    assert easts(tracks(heard, 86400.0)) == [0, 20]


def test_a_second_report_confirms_the_jump_and_more_give_the_old_place_up() -> None:
    heard = picture(*sail(0.0, 5), *sail(50.0, 2, FAR))
    assert heard.counts["picture.jump_confirmed"] == 1
    assert easts(tracks(heard, 60.0)) == [0, 20]
    for each in sail(70.0, 2, FAR):
        heard.observe(each)
    assert easts(tracks(heard, 80.0)) == [20]
    assert heard.counts["picture.place_given_up"] == 1


def test_two_ships_under_one_number_stay_two_rows() -> None:
    heard = picture(*(report(10.0 * i, 50.0 * i, FAR * (i % 2)) for i in range(12)))
    for each in sail(120.0, 20, FAR):
        heard.observe(each)
    assert easts(tracks(heard, 310.0)) == [0, 20]
    assert tracks(heard, 310.0).mmsi.tolist() == [SHIP, SHIP]
    assert "picture.shared_number" in codes(heard, 310.0)


def test_a_rare_second_sender_is_recognised_when_it_speaks_again() -> None:
    """Refuted twice over by a busy number, it is remembered without a row."""
    heard = picture(*sail(0.0, 10), report(100.0, 500.0, FAR), *sail(101.0, 6))
    assert easts(tracks(heard, 151.0)) == [0]
    heard.observe(report(160.0, 800.0, FAR))
    assert easts(tracks(heard, 160.0)) == [0, 20]
    for each in sail(170.0, 10):
        heard.observe(each)
    assert easts(tracks(heard, 260.0)) == [0, 20]
    assert "picture.shared_number" in codes(heard, 260.0)


def test_a_place_given_up_does_not_come_back_because_it_has_grown_vague() -> None:
    """Ten minutes on, the old place could explain every report of the ship; the new one foretells them."""
    heard = picture(*sail(0.0, 5), *weave(50.0, 60, 1000.0))
    assert easts(tracks(heard, 640.0)) == [1]
    assert "picture.shared_number" not in codes(heard, 640.0)
    assert heard.counts["picture.continued"] == 4 + 58


def test_of_two_places_that_fit_the_one_that_foretold_the_report_has_it() -> None:
    """Two senders a kilometre apart under one number: the silent one does not take the other's reports."""
    both = [report(10.0 * i, 50.0 * i, 1000.0 * (i % 2)) for i in range(12)]
    heard = picture(*both, *weave(120.0, 60, 1000.0))
    table = tracks(heard, 710.0)
    assert easts(table) == [0, 1]
    silent = table.east_m.argmin()
    assert table.age_s(instant(710.0))[silent] == 610.0


@pytest.mark.parametrize("speed_mps", [30.0, 52.0])
def test_an_impossible_acceleration_is_not_believed_at_once(speed_mps: float) -> None:
    heard = picture(*sail(0.0, 5, every_s=2.0), report(10.0, 50.0, sog_mps=speed_mps))
    assert heard.counts["picture.quarantined"] == 1
    assert sorted(tracks(heard, 10.0).sog_mps) == [5.0, speed_mps]


def test_a_late_report_from_where_the_ship_cannot_have_been_is_a_place_of_its_own() -> None:
    heard = picture(*sail(0.0, 5), report(41.0, 200.0, FAR, measured_at=instant(39.0)))
    assert easts(tracks(heard, 41.0)) == [0, 20]
    heard.observe(report(42.0, 150.0, 0.0, measured_at=instant(31.0)))
    assert heard.counts["picture.older"] == 1
    assert easts(tracks(heard, 42.0)) == [0, 20]


def test_number_of_places_is_bounded() -> None:
    heard = picture(*(report(10.0 * i, 0.0, FAR * (i % 7 - 3)) for i in range(200)))
    assert len(tracks(heard, 2000.0)) <= 4


@settings(max_examples=40, deadline=None)
@given(
    speed=st.floats(0.0, 14.0),
    turns=st.lists(st.tuples(st.floats(2.0, 300.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), max_size=12),
)
def test_a_ship_that_manoeuvres_as_ships_can_is_never_doubted(
    speed: float, turns: list[tuple[float, float, float]]
) -> None:
    """Up to 0.25 m/s2 along and across, held for 20 s at most, between reports 2 s to 5 min apart."""
    north = east = course = 0.0
    t = 0.0
    heard = picture(report(0.0, sog_mps=speed))
    for gap_s, along, across in turns:
        steer_s = min(gap_s, 20.0)
        for _ in range(20):
            speed = min(max(speed + 0.25 * along * steer_s / 20, 0.0), 15.0)
            course += 0.25 * across / max(speed, 1.0) * steer_s / 20
            north += speed * math.cos(course) * steer_s / 20
            east += speed * math.sin(course) * steer_s / 20
        north += speed * math.cos(course) * (gap_s - steer_s)
        east += speed * math.sin(course) * (gap_s - steer_s)
        t += gap_s
        heard.observe(report(t, north, east, sog_mps=speed, cog_rad=course))
    assert heard.counts["picture.quarantined"] == 0
    assert len(tracks(heard, t)) == 1
