"""Messages of another encoder: canboatjs 3.20.0 made these frames, out of values that are ours.

The same was done once with 400 random messages of each PGN: every field agreed to half its unit.
"""

import pytest

from companion.instant import instant
from companion.messages import ContactReport, Frame, Heard, Hull, Link, OwnPosition, TargetKind
from companion.utc import UtcClock
from companion.wire.nmea2000 import Nmea2000Decoder

LATITUDE, LONGITUDE = 22.522192051411693, -69.87646670028403
MMSI = 593092428
FRAMES = {
    129025: (
        0x11F8012B,
        "219d6c0d85b259d6",
    ),
    129038: (
        0x11F80E2B,
        "401c014cdf592385 41b259d6219d6c0d 42f0aea6840a0000 43005d2a9409c0ff 44ffffffffffffff",
    ),
    129039: (
        0x11F80F2B,
        "401b124cdf592385 41b259d6219d6c0d 42f0aea6840a0000 43005d2affffffff",
    ),
    129040: (
        0x11F8102B,
        (
            "4036134cdf592385 41b259d6219d6c0d 42f0aea6840affff 43465d2a1f480bf9 "
            "4401ab0057084558 45542030ffffffff 46ffffffffffffff 47ffffffff3cf8ff"
        ),
    ),
    129794: (
        0x11FB022B,
        (
            "404b054cdf592340 41548900504130ff 42ffffff53484950 432030ffffffffff "
            "44ffffffffffffff 45ffff46480bf901 46ab0057082b5100 472a75154806524f "
            "485454455244414d 49ffffffffffffff 4affffffff84e0ff"
        ),
    ),
    129809: (
        0x11FB112B,
        "401b184cdf592342 414f41542030ffff 42ffffffffffffff 43ffffffffffe0ff",
    ),
    129810: (
        0x11FB122B,
        (
            "4023184cdf592324 41414243ffffffff 42504230ffffffff 43210133001100d6 "
            "440000000000ffe0 45ffffffffffffff"
        ),
    ),
}


def heard(pgn: int) -> Heard:
    can_id, data = FRAMES[pgn]
    raw, decoder = bytes.fromhex(data), Nmea2000Decoder(UtcClock())
    found = [
        each
        for at in range(0, len(raw), 8)
        for each in decoder.decode(Frame(instant(1.0), Link.CAN, raw[at : at + 8], can_id))
    ]
    (one,) = found
    return one


def contact(pgn: int) -> ContactReport:
    found = heard(pgn)
    assert isinstance(found, ContactReport)
    assert found.mmsi == MMSI
    return found


@pytest.mark.parametrize(
    ("pgn", "kind"),
    [(129038, TargetKind.CLASS_A), (129039, TargetKind.CLASS_B), (129040, TargetKind.CLASS_B)],
)
def test_a_position_is_the_one_that_was_encoded(pgn: int, kind: TargetKind) -> None:
    report = contact(pgn)
    assert report.kind is kind
    assert report.latitude_deg == pytest.approx(LATITUDE, abs=5.1e-8)
    assert report.longitude_deg == pytest.approx(LONGITUDE, abs=5.1e-8)
    assert report.cog_rad == pytest.approx(4.267018, abs=5.1e-5)
    assert report.sog_mps == pytest.approx(26.924934, abs=5.1e-3)
    assert report.heading_rad == pytest.approx(1.084544, abs=5.1e-5)
    assert not report.accurate


def test_the_turn_rate_and_the_status_are_class_a_s() -> None:
    report = contact(129038)
    assert report.turn_rate_radps == pytest.approx(0.0766344, abs=1.6e-5)
    assert report.navigational_status == 0
    assert contact(129039).turn_rate_radps is None


@pytest.mark.parametrize(
    ("pgn", "name", "ship_type"), [(129794, "SHIP 0", 70), (129040, "EXT 0", 70), (129809, "BOAT 0", None)]
)
def test_names_and_types_are_those_encoded(pgn: int, name: str, ship_type: int | None) -> None:
    report = contact(pgn)
    assert (report.name, report.ship_type) == (name, ship_type)


@pytest.mark.parametrize(("pgn", "tenths"), [(129794, 1), (129040, 1), (129810, 10)])
def test_the_hull_is_laid_out_around_the_antenna(pgn: int, tenths: int) -> None:
    hull = contact(pgn).hull
    assert isinstance(hull, Hull)
    sides = (hull.bow_m, hull.stern_m, hull.port_m, hull.starboard_m)
    true = (213.517731, 75.246329, 33.453579, 17.060821)
    assert sides == pytest.approx(tuple(side / tenths for side in true), abs=0.1)


def test_the_draught_is_in_the_static_data() -> None:
    assert contact(129794).draught_m == pytest.approx(16.084, abs=5.1e-3)
    assert contact(129809).draught_m is None


def test_the_rapid_position_is_our_own() -> None:
    own = heard(129025)
    assert isinstance(own, OwnPosition)
    assert (own.latitude_deg, own.longitude_deg) == pytest.approx((LATITUDE, LONGITUDE), abs=5.1e-8)
