"""The contact picture: one track for each ship, never rewound, never forgotten, cheap when unchanged."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymap3d.vincenty import vreckon

from companion import config
from companion.geodesy import MAX_RANGE_M, LocalFrame
from companion.instant import instant
from companion.messages import Hull, Model, Source, TargetKind, Tracks
from companion.picture import Picture
from tests.contact_reports import FRAME, SHIP, own, picture, report, static, tracks

HULL = Hull(100.0, 50.0, 10.0, 12.0)


def only(table: Tracks, column: str) -> float:
    """The value of a one-row table."""
    assert len(table) == 1
    return float(getattr(table, column)[0])


# ---------------------------------------------------------------- one ship, one track


def test_a_single_report_is_a_track_at_once() -> None:
    table = tracks(picture(report(1.0, 300.0, -400.0)), 1.0)
    assert table.mmsi.tolist() == [SHIP]
    assert only(table, "north_m") == pytest.approx(300.0, abs=0.01)
    assert only(table, "east_m") == pytest.approx(-400.0, abs=0.01)
    assert only(table, "measured_at_ns") == instant(1.0)


def test_rows_stand_in_mmsi_order_whatever_the_order_of_the_reports() -> None:
    numbers = [230_000_009, 219_000_001, 244_000_005, 219_000_000]
    heard = picture(*(report(1.0, 1000.0 * i, mmsi=mmsi) for i, mmsi in enumerate(numbers)))
    assert tracks(heard, 1.0).mmsi.tolist() == sorted(numbers)


def test_the_same_ship_over_two_sources_is_one_track_with_both_named() -> None:
    heard = picture(report(1.0), report(3.0, 10.0, source=Source.AIS_VESSEL))
    assert only(tracks(heard, 3.0), "north_m") == pytest.approx(10.0, abs=0.01)
    assert heard.heard_from(SHIP) == {Source.NMEA2000: 1, Source.AIS_VESSEL: 1}
    assert heard.heard_from(1) == {}


def test_an_older_measurement_never_rewinds_a_track() -> None:
    heard = picture(report(10.0, 50.0), report(11.0, 0.0, measured_at=instant(0.0)))
    table = tracks(heard, 11.0)
    assert only(table, "measured_at_ns") == instant(10.0)
    assert only(table, "north_m") == pytest.approx(50.0, abs=0.01)
    assert heard.counts["picture.older"] == 1


def test_a_vessel_sent_again_with_a_larger_age_stays_where_it_was() -> None:
    """The age is in whole seconds, so the same measurement seems up to a second newer."""
    first = report(10.0, measured_at=instant(9.0), age_error_s=0.5, source=Source.AIS_VESSEL)
    again = report(40.0, measured_at=instant(9.8), age_error_s=0.5, source=Source.AIS_VESSEL)
    heard = picture(first)
    before = tracks(heard, 40.0)
    heard.observe(again)
    assert tracks(heard, 40.0) is before
    assert heard.counts["picture.duplicate"] == 1


def test_a_ship_at_rest_is_heard_anew_from_the_same_place() -> None:
    heard = picture(report(10.0, sog_mps=0.0, age_error_s=2.0), report(20.0, sog_mps=0.0, age_error_s=2.0))
    assert only(tracks(heard, 20.0), "measured_at_ns") == instant(20.0)


def test_a_measurement_later_than_its_reception_counts_from_the_reception() -> None:
    heard = picture(report(10.0, measured_at=instant(500.0)), report(12.0, 10.0))
    assert only(tracks(heard, 12.0), "measured_at_ns") == instant(12.0)
    assert heard.counts["picture.measured_in_the_future"] == 1


@pytest.mark.parametrize("static_first", [True, False])
def test_static_data_completes_the_track_before_or_after_the_position(static_first: bool) -> None:
    told = static(1.0, hull=HULL, name="AAVA", ship_type=70, kind=TargetKind.CLASS_B)
    seen = report(1.0, kind=TargetKind.UNKNOWN)
    table = tracks(picture(*((told, seen) if static_first else (seen, told))), 1.0)
    assert (only(table, "bow_m"), only(table, "stern_m")) == (100.0, 50.0)
    assert (only(table, "port_m"), only(table, "starboard_m")) == (10.0, 12.0)
    assert table.names == ("AAVA",)


def test_a_report_that_is_silent_about_the_hull_erases_nothing() -> None:
    heard = picture(report(1.0, hull=HULL, name="AAVA"), report(6.0, 25.0), static(7.0))
    assert only(tracks(heard, 7.0), "bow_m") == 100.0
    assert tracks(heard, 7.0).names == ("AAVA",)


def test_static_data_alone_makes_no_track() -> None:
    heard = picture(static(1.0, hull=HULL))
    assert len(tracks(heard, 1.0)) == 0
    assert len(heard) == 1


def test_a_ship_is_never_forgotten_by_time() -> None:
    heard = picture(report(0.0))
    table = tracks(heard, 30 * 86400.0)
    assert table.mmsi.tolist() == [SHIP]
    assert table.age_s(instant(30 * 86400.0))[0] == 30 * 86400.0


# ---------------------------------------------------------------- the table


def test_nothing_new_gives_the_same_object() -> None:
    heard = picture(report(1.0))
    table = tracks(heard, 1.0)
    assert tracks(heard, 5.0) is table
    heard.observe_own(own(6.0, 9000.0))
    assert tracks(heard, 700.0) is table  # a ship under way is aged by whoever reads the row


def test_an_empty_picture_is_an_empty_table() -> None:
    table = tracks(picture(), 1.0)
    assert len(table) == 0
    assert table.north_m.shape == (0,)


def test_every_change_gives_a_new_revision_and_leaves_the_old_table_alone() -> None:
    heard = picture(report(1.0))
    before = tracks(heard, 1.0)
    heard.observe(report(2.0, 5.0))
    after = tracks(heard, 2.0)
    assert after.revision > before.revision
    assert only(before, "measured_at_ns") == instant(1.0)


def test_a_new_frame_moves_every_row() -> None:
    heard = picture(report(1.0), report(1.0, 2000.0, mmsi=SHIP + 1))
    before = tracks(heard, 1.0)
    elsewhere = LocalFrame(*FRAME.to_geodetic(500.0, 0.0))
    after = heard.tracks(instant(1.0), elsewhere)
    assert after.north_m == pytest.approx(before.north_m - 500.0, abs=0.1)
    assert after.revision > before.revision


def test_the_arrays_are_contiguous_and_read_only() -> None:
    table = tracks(picture(report(1.0), report(1.0, 2000.0, mmsi=SHIP + 1)), 1.0)
    for column in (table.mmsi, table.north_m, table.model, table.validity_s, table.measured_at_ns):
        assert column.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 0
    assert table.north_m.dtype == table.validity_s.dtype == np.float64
    assert table.mmsi.dtype == table.model.dtype == table.measured_at_ns.dtype == np.int64


# ---------------------------------------------------------------- the area, and a full picture


def test_a_far_ship_gets_its_row_when_it_could_have_come_near() -> None:
    far = FRAME.latitude_deg - 3.0  # some 334 km: 234 km to go at 16 m/s are 4 hours
    heard = picture(report(0.0, latitude_deg=far, longitude_deg=FRAME.longitude_deg))
    assert len(tracks(heard, 3600.0)) == 0
    assert len(heard) == 1
    assert len(tracks(heard, 5 * 3600.0)) == 1


@pytest.mark.parametrize("bearing_deg", range(0, 360, 30))
@pytest.mark.parametrize("range_km", [101, 300, 3000])
def test_a_far_ship_that_comes_straight_for_us_has_its_row_in_time(bearing_deg: int, range_km: int) -> None:
    """On the ellipsoid, at top speed: it must be there when it crosses the area's edge."""
    latitude_deg, longitude_deg = vreckon(
        FRAME.latitude_deg, FRAME.longitude_deg, range_km * 1000.0, bearing_deg
    )
    heard = picture(
        report(
            0.0,
            latitude_deg=float(latitude_deg),
            longitude_deg=(float(longitude_deg) + 180.0) % 360.0 - 180.0,
        )
    )
    in_s = (range_km * 1000.0 - MAX_RANGE_M) / 16.0
    assert len(tracks(heard, in_s)) == 1


def test_a_ship_on_the_other_side_of_the_globe_does_not_appear_at_the_origin() -> None:
    heard = picture(report(0.0, latitude_deg=-FRAME.latitude_deg, longitude_deg=FRAME.longitude_deg - 180.0))
    assert len(tracks(heard, 3600.0)) == 0


def test_a_full_picture_gives_up_the_farthest_for_a_nearer_one_and_says_so() -> None:
    heard = Picture(config.Contacts(), most_contacts=3)
    heard.observe_own(own(0.0))
    for i, north_m in enumerate((1000.0, 30_000.0, 20_000.0)):
        heard.observe(report(1.0, north_m, mmsi=SHIP + i))
    heard.observe(report(2.0, 500.0, mmsi=SHIP + 3))
    assert tracks(heard, 2.0).mmsi.tolist() == [SHIP, SHIP + 2, SHIP + 3]
    assert heard.counts["picture.evicted_when_full"] == 1
    assert "picture.full" in {reason.code for reason in heard.notes(instant(2.0))}


def test_a_flood_of_far_inventions_pushes_nobody_out() -> None:
    heard = Picture(config.Contacts(), most_contacts=50)
    heard.observe_own(own(0.0))
    for i in range(50):
        heard.observe(report(1.0, 100.0 * i, 3000.0, mmsi=SHIP + i))
    for i in range(2000):
        heard.observe(report(2.0, 40_000.0 + i, mmsi=219_000_000 + i))
    assert tracks(heard, 2.0).mmsi.tolist() == [SHIP + i for i in range(50)]
    assert heard.counts["picture.refused_when_full"] == 2000


# ---------------------------------------------------------------- whose number


@pytest.mark.parametrize("mmsi", [2_300_001, 992_301_234])
def test_base_stations_and_aids_to_navigation_are_no_contacts(mmsi: int) -> None:
    heard = picture(report(1.0, mmsi=mmsi, kind=TargetKind.UNKNOWN, sog_mps=None, cog_rad=None))
    assert len(tracks(heard, 1.0)) == len(heard) == 0
    assert "note.not_ships" in {reason.code for reason in heard.notes(instant(1.0))}


@pytest.mark.parametrize("mmsi", [2_300_001, 992_301_234])
def test_a_fixed_station_that_moves_or_sends_as_a_ship_is_a_ship(mmsi: int) -> None:
    moving = report(1.0, mmsi=mmsi, kind=TargetKind.UNKNOWN, sog_mps=6.0)
    still = report(1.0, mmsi=mmsi, kind=TargetKind.UNKNOWN, sog_mps=0.0)
    ship_like = report(1.0, mmsi=mmsi, sog_mps=None)
    for each in (moving, still, ship_like):
        heard = picture(each)
        assert len(tracks(heard, 1.0)) == 1
        assert "note.odd_number" in {reason.code for reason in heard.notes(instant(1.0))}


def test_a_ship_under_the_number_of_an_aircraft_is_a_ship() -> None:
    """The Danish recording has two: 111111111 at anchor 900 km apart, by class A's message."""
    heard = picture(report(1.0, mmsi=111_111_111, sog_mps=0.05))
    assert len(tracks(heard, 1.0)) == 1
    assert "note.odd_number" in {reason.code for reason in heard.notes(instant(1.0))}
    unknown = picture(report(1.0, mmsi=111_230_001, kind=TargetKind.UNKNOWN, sog_mps=20.0))
    assert len(tracks(unknown, 1.0)) == 0


def test_ships_whose_number_was_never_set_share_0_and_the_largest_hull() -> None:
    one, other = Hull(10.0, 10.0, 3.0, 3.0), Hull(80.0, 5.0, 2.0, 9.0)
    heard = picture(report(1.0, mmsi=0, hull=one), report(2.0, 30_000.0, mmsi=0, hull=other, draught_m=7.0))
    heard.observe(report(3.0, mmsi=0, hull=one, draught_m=2.0))
    table = tracks(heard, 3.0)
    assert table.mmsi.tolist() == [0, 0]
    assert set(table.bow_m + table.stern_m) == {90.0}
    assert set(table.draught_m) == {7.0}


def test_search_and_rescue_aircraft_are_no_contacts() -> None:
    heard = picture(report(1.0, mmsi=111_230_001, sog_mps=50.0))
    assert len(tracks(heard, 1.0)) == 0
    assert heard.counts["picture.not_a_ship.aircraft"] == 1


@pytest.mark.parametrize("mmsi", [970_123_456, 972_123_456, 974_123_456])
def test_a_distress_transmitter_is_a_contact_and_is_announced(mmsi: int) -> None:
    heard = picture(report(1.0, mmsi=mmsi, sog_mps=0.3))
    assert len(tracks(heard, 1.0)) == 1
    assert "note.survivor" in {reason.code for reason in heard.notes(instant(1.0))}


@pytest.mark.parametrize("mmsi", [0, 27_653_800, 877_227_750, 123_456_789, 1_000_000_007])
def test_a_number_no_ship_should_have_is_kept_and_noted(mmsi: int) -> None:
    heard = picture(report(1.0, mmsi=mmsi))
    assert tracks(heard, 1.0).mmsi.tolist() == [mmsi]
    assert "note.odd_number" in {reason.code for reason in heard.notes(instant(1.0))}


@pytest.mark.parametrize("mmsi", [-1, 2**30, 2**32 - 1])
def test_a_number_no_radio_can_send_is_dropped_and_counted(mmsi: int) -> None:
    heard = picture(report(1.0, mmsi=mmsi))
    assert len(heard) == 0
    assert heard.counts["picture.not_a_ship.impossible"] == 1


# ---------------------------------------------------------------- anything may come


positions = st.tuples(
    st.one_of(st.none(), st.floats(59.6, 59.8), st.floats()), st.one_of(st.none(), st.floats(24.6, 24.8))
)
numbers = st.one_of(st.none(), st.floats(0.0, 20.0), st.floats())


@st.composite
def any_report(draw: st.DrawFn) -> object:
    latitude_deg, longitude_deg = draw(positions)
    received_s = draw(st.floats(0.0, 2000.0))
    return report(
        received_s,
        mmsi=draw(st.sampled_from([SHIP, SHIP + 1, SHIP + 2, 0, 970_000_001, 2_300_001])),
        source=draw(st.sampled_from([Source.NMEA2000, Source.AIS_VESSEL])),
        measured_at=instant(received_s - draw(st.floats(-50.0, 200.0))),
        age_error_s=draw(st.floats(0.0, 60.0)),
        kind=draw(st.sampled_from([k for k in TargetKind if k is not TargetKind.AIRCRAFT])),
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        accurate=draw(st.booleans()),
        cog_rad=draw(numbers),
        sog_mps=draw(numbers),
        heading_rad=draw(numbers),
        hull=draw(st.one_of(st.none(), st.builds(Hull, *[st.floats(-1.0, 500.0)] * 4))),
    )


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(any_report(), st.floats(-100.0, 300.0), st.booleans()), max_size=25))
def test_whatever_is_heard_no_ship_vanishes_and_every_number_is_finite(heard: list[tuple]) -> None:  # type: ignore[type-arg]
    sea = picture()
    known: dict[int, int] = {}
    last, set_back = tracks(sea, 0.0), 0
    for each, look_s, moored in heard:
        if moored:
            sea.observe_own(own(each.received_at * 1e-9, 100.0))
        sea.observe(each)
        now_s = each.received_at * 1e-9 + look_s
        table = tracks(sea, now_s)
        assert (table is last) == (table.revision == last.revision)
        assert table.revision >= last.revision
        last = table
        assert table.mmsi.tolist() == sorted(table.mmsi.tolist())
        for column in (c for c in Tracks.__dataclass_fields__ if c not in {"revision", "names", "draught_m"}):
            assert np.isfinite(getattr(table, column)).all(), column
        assert (table.position_error_m >= 10.0).all()
        assert set(table.model.tolist()) <= {Model.STRAIGHT, Model.DISC}
        newest = {m: int(table.measured_at_ns[table.mmsi == m].max()) for m in set(table.mmsi.tolist())}
        # at one place with us the row may be held back, and only there
        if not any(with_own for _, _, with_own in heard):
            steps = sea.counts["picture.clock_set_back"]
            assert steps > set_back or all(newest[m] >= at for m, at in known.items())
            assert known.keys() <= newest.keys()
            set_back = steps
        known = newest
        assert len(sea.notes(instant(now_s))) < 12
    assert sum(sea.heard_from(m).get(s, 0) for m in (SHIP, SHIP + 1, SHIP + 2) for s in Source) == sum(
        each.mmsi in {SHIP, SHIP + 1, SHIP + 2} for each, _, _ in heard
    )
    assert sea.reports_heard == len(heard)


def test_impossible_values_are_not_available_rather_than_believed() -> None:
    heard = picture(report(1.0, sog_mps=math.nan, cog_rad=math.inf, hull=Hull(-1.0, 5.0, 5.0, 5.0)))
    heard.observe(report(2.0, mmsi=SHIP + 1, latitude_deg=91.0))
    table = tracks(heard, 2.0)
    assert table.mmsi.tolist() == [SHIP]
    assert only(table, "model") == Model.DISC
    assert heard.counts["picture.bad_speed"] == heard.counts["picture.bad_position"] == 1
    assert heard.counts["picture.bad_angle"] == heard.counts["picture.bad_hull"] == 1
