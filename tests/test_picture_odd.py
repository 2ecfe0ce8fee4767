"""Odd logs: a clock that steps back, mutated frames, an antenna under water."""

from pathlib import Path

import numpy as np
import pytest

from companion import config
from companion.edges.files import read_candump
from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Link, OwnPosition
from companion.picture import Picture
from companion.utc import UtcClock
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.contact_reports import FRAME, own, picture, report, tracks

GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
BACK_S = 13.9 * 86_400
START_S = 2 * BACK_S


def test_a_clock_set_back_by_two_weeks_neither_freezes_nor_rejuvenates_a_ship() -> None:
    """Before, its later reports were taken for late ones, and its old place stayed fresh for two weeks."""
    heard = picture(
        report(START_S, 0.0),
        report(START_S + 100.0, 500.0),
        report(START_S + 100.0, 0.0, 900.0, mmsi=230_000_002),
    )
    now = START_S + 110.0 - BACK_S
    heard.observe(report(now, 550.0))
    table = tracks(heard, now)
    assert table.north_m[0] == pytest.approx(550.0, abs=0.1)
    assert table.age_s(instant(now)) == pytest.approx([0.0, 10.0])  # how long the step took is assumed
    for i in range(1, 4):
        heard.observe(report(now + 10.0 * i, 550.0 + 50.0 * i))
    table = tracks(heard, now + 30.0)
    assert len(table) == 2
    assert table.north_m[0] == pytest.approx(700.0, abs=0.1)
    assert heard.counts["picture.clock_set_back"] == 1
    assert heard.counts["picture.quarantined"] == 0
    assert any(reason.code == "note.clock_set_back" for reason in heard.notes(instant(now)))


def test_with_learned_bounds_the_forecasts_begin_anew_after_the_step() -> None:
    heard = picture(*(report(START_S + 60.0 * i, 300.0 * i) for i in range(5)), bounds_file="houston")
    back = START_S + 300.0 - BACK_S
    for i in range(4):
        heard.observe(report(back + 60.0 * i, 1500.0 + 300.0 * i))
    assert heard.adaptation is not None
    assert heard.adaptation.coverage()[0] == 1.0
    assert len(tracks(heard, back + 180.0)) == 1


def test_a_report_that_merely_comes_late_sets_no_clock() -> None:
    heard = picture(report(100.0), report(70.0, -150.0, mmsi=230_000_002))
    assert heard.counts["picture.clock_set_back"] == 0


def test_mutated_frames_change_no_picture_s_sanity(shared_data: Path) -> None:
    """A tenth of the recorded frames damaged at random: nothing raises, every number stays finite."""
    rng = np.random.default_rng(4)
    decoder, heard = Nmea2000Decoder(UtcClock()), Picture(config.Contacts(bounds_file="houston"))
    frame = LocalFrame(59.7, 24.7)
    for number, one in enumerate(read_candump(shared_data / GULF)):
        if number > 12_000:
            break
        data, can_id = one.data, one.can_id
        if rng.random() < 0.1:
            spoilt = bytearray(data)
            for _ in range(int(rng.integers(1, 4))):
                spoilt[int(rng.integers(len(spoilt)))] = int(rng.integers(256))
            data = bytes(spoilt)
        for each in decoder.decode(Frame(Instant(one.unix_ns), Link.CAN, data, can_id)):
            if isinstance(each, ContactReport):
                heard.observe(each)
            elif isinstance(each, OwnPosition):
                heard.observe_own(each)
        if number % 2000 == 0:
            table = heard.tracks(Instant(one.unix_ns), frame)
            for column in (table.north_m, table.east_m, table.sog_mps, table.bow_m, table.spread_m):
                assert np.isfinite(column).all()
            heard.notes(Instant(one.unix_ns))
    assert len(heard) > 40


def test_silence_under_water_is_not_a_loss() -> None:
    """Two ships heard at the surface; we dive for ten minutes, and then listen for four."""
    heard = picture(report(0.0), report(0.0, 0.0, 500.0, mmsi=230_000_002))
    heard.observe_own(own(0.0, depth_m=0.0))
    heard.observe_own(own(10.0, depth_m=5.0))
    assert heard.listening.is_deaf()
    assert heard.silent(instant(600.0)) == []
    heard.observe_own(own(610.0, depth_m=0.2))
    heard.observe(report(620.0, 3100.0))
    assert heard.silent(instant(700.0)) == []
    heard.observe(report(840.0, 4200.0))
    assert heard.silent(instant(850.0)) == [230_000_002]
    assert len(heard.tracks(instant(850.0), FRAME)) == 2


def test_the_time_listened_leaves_out_every_dive() -> None:
    heard = picture()
    for at, depth in ((0, 0), (10, 3), (40, 0), (100, 9), (150, 0)):
        heard.observe_own(own(float(at), depth_m=float(depth)))
    assert heard.listening.listened_s(instant(0.0), instant(200.0)) == pytest.approx(120.0)
    assert heard.listening.listened_s(instant(20.0), instant(30.0)) == 0.0
