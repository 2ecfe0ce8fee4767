"""Our own ship in the AIS stream is no contact, and everybody else near us is one."""

from itertools import pairwise

import pytest

from companion.instant import instant
from companion.messages import Source
from companion.picture import Picture
from tests.contact_reports import SHIP, own, picture, report, tracks

STEP_S = 1.0


def together(
    heard: Picture,
    seconds: int,
    *,
    off_m: float = 4.0,
    speed_mps: float = 3.0,
    every: int = 1,
    since: int = 0,
) -> list[int]:
    """Us and a sender `off_m` east of us, both going north; how many rows each second had."""
    rows = []
    for t in range(since, since + seconds):
        north_m = speed_mps * t
        heard.observe_own(own(t, north_m, velocity_ned_mps=(speed_mps, 0.0, 0.0)))
        if t % every == 0:
            heard.observe(report(t, north_m, off_m, sog_mps=speed_mps))
        rows.append(len(tracks(heard, t)))
    return rows


def test_the_configured_number_is_never_a_contact() -> None:
    heard = picture(report(1.0), own_mmsi=SHIP)
    assert len(tracks(heard, 1.0)) == 0
    assert heard.notes(instant(1.0))[0].code == "note.echo"


@pytest.mark.parametrize("speed_mps", [0.0, 3.0])
def test_an_echo_that_comes_every_second_never_has_a_row(speed_mps: float) -> None:
    heard = picture()
    assert together(heard, 120, speed_mps=speed_mps) == [0] * 120
    assert "note.echo" in {reason.code for reason in heard.notes(instant(120.0))}


def test_an_echo_that_comes_seldom_is_known_by_the_way_it_makes_with_us() -> None:
    heard = picture()
    rows = together(heard, 120, every=10)
    assert rows[-60:] == [0] * 60
    changes = sum(a != b for a, b in pairwise(rows))
    assert changes <= 2  # hidden on suspicion, shown in doubt, hidden for good: it does not flap


def test_an_echo_of_the_bus_s_platform_is_an_echo_though_the_autopilot_is_elsewhere() -> None:
    heard = picture()
    for t in range(20):
        heard.observe_own(own(t, 9000.0))
        heard.observe_own(own(t, 3.0 * t, source=Source.NMEA2000))
        heard.observe(report(t, 3.0 * t, 5.0, sog_mps=3.0))
        assert len(tracks(heard, t)) == 0


def test_an_echo_stays_one_while_only_the_other_platform_is_known() -> None:
    """The bus gives no position for a while: the autopilot's, elsewhere, does not contradict."""
    heard = picture()
    for t in range(60):
        heard.observe_own(own(t, 9000.0))
        if t < 20:
            heard.observe_own(own(t, 3.0 * t, source=Source.NMEA2000))
        heard.observe(report(t, 3.0 * t, 5.0, sog_mps=3.0))
        assert len(tracks(heard, t)) == 0


def test_a_neighbour_a_tenth_of_a_mile_off_on_our_course_stays_a_contact() -> None:
    heard = picture()
    assert together(heard, 120, off_m=185.0) == [1] * 120


def test_a_boat_moored_alongside_is_a_contact_again_after_a_moment() -> None:
    """It agrees with us by chance, but over the air it reports every three minutes, not every second."""
    heard = picture()
    rows = together(heard, 600, off_m=9.9, speed_mps=0.0, every=180)
    assert rows[:12] == [0] * 12
    assert rows[12:] == [1] * 588
    assert "picture.echo_doubted" in {reason.code for reason in heard.notes(instant(599.0))}


def test_doubt_ends_in_a_contact_even_when_we_hear_nothing_more() -> None:
    heard = picture()
    together(heard, 3)
    assert len(tracks(heard, 3.0)) == 0
    assert len(tracks(heard, 15.0)) == 1


def test_whoever_came_from_elsewhere_is_no_echo_however_long_it_keeps_our_company() -> None:
    heard = picture()
    assert together(heard, 10, off_m=400.0) == [1] * 10
    assert together(heard, 200, off_m=5.0, since=60) == [1] * 200


def test_a_recognised_echo_that_leaves_us_is_a_contact_again() -> None:
    heard = picture()
    together(heard, 60)
    for t in range(60, 64):
        heard.observe_own(own(t, 3.0 * t))
        heard.observe(report(t, 3.0 * t, 500.0, sog_mps=3.0))
    assert len(tracks(heard, 64.0)) >= 1


def test_nothing_is_hidden_where_our_own_position_is_unknown() -> None:
    heard = picture(*(report(t, 3.0 * t) for t in range(30)))
    assert len(tracks(heard, 30.0)) == 1


def test_a_time_stamp_too_vague_to_compare_proves_nothing() -> None:
    heard = picture()
    for t in range(30):
        heard.observe_own(own(t, 5.0 * t))
        heard.observe(report(t, 5.0 * t, 100.0, age_error_s=30.0))
    assert len(tracks(heard, 30.0)) == 1


def test_the_same_report_sent_over_and_over_is_no_evidence() -> None:
    heard = picture()
    for k in range(40):
        heard.observe_own(own(k * 0.25))
        heard.observe(report(k * 0.25, measured_at=instant(0.0), sog_mps=0.0))
    assert len(tracks(heard, 13.0)) == 1
