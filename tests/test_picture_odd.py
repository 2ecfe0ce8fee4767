"""Odd logs: a clock that steps back, mutated frames, an antenna under water."""

import argparse
import gzip
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from companion import config
from companion.calibrate.dataset import collect
from companion.edges import lookout, traffic
from companion.edges.files import read_candump
from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Link, OwnPosition
from companion.picture import Picture
from companion.utc import UtcClock
from companion.wire.n2k_ais import LAYOUTS
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.benchmarks import damage
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


def copied(
    source: Path, target: Path, keep: Callable[[int], bool], back_after_s: float | None = None
) -> Path:
    """A candump of the frames whose PGN is kept; from some time on its clock is set back."""
    first = None
    with gzip.open(target, "wt", encoding="ascii") as out:
        for frame in read_candump(source):
            first = frame.unix_ns if first is None else first
            at_s = frame.unix_ns / 1e9
            if back_after_s is not None and frame.unix_ns - first > back_after_s * 1e9:
                at_s -= BACK_S
            if keep(frame.can_id >> 8 & 0x3FFFF):
                out.write(f"({at_s:.6f}) can0 {frame.can_id:08X}#{frame.data.hex().upper()}\n")
    return target


def test_a_log_whose_clock_steps_back_gives_the_contacts_and_nearly_the_outcomes_of_one_that_does_not(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    stepped = copied(shared_data / GULF, tmp_path / "back.candump.gz", lambda _: True, 300.0)
    options = argparse.Namespace(
        source=[str(stepped)],
        own=None,
        bounds="houston",
        at=None,
        silence=0.0,
        most=200,
        chart=tmp_path / "c.png",
    )
    assert lookout.run(options) == 0
    said = capsys.readouterr().out
    shown = re.findall(r"^ *(\d{8,9})  ", said, re.MULTILINE)
    assert len(shown) == len(set(shown)) == 94  # all of the log's but our own
    assert "230035780" not in shown
    assert "the clock was set back 1 times" in said
    assert "quarantined" not in said
    whole, cut = (collect(traffic.read(path, Counter())).at(0) for path in (shared_data / GULF, stepped))
    assert 0.6 * len(whole) < len(cut) < len(whole)  # none across the step
    assert np.hypot(cut.ahead_m, cut.aside_m).max() < 1.5 * np.hypot(whole.ahead_m, whole.aside_m).max()


def test_a_bus_without_own_position_is_shown_around_its_traffic(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = copied(shared_data / GULF, tmp_path / "mute.candump.gz", LAYOUTS.__contains__)
    options = argparse.Namespace(
        source=[str(path)], own=None, bounds="", at=None, silence=0.0, most=5, chart=tmp_path / "c.png"
    )
    assert lookout.run(options) == 0
    said = capsys.readouterr().out
    assert "95 contacts" in said  # our own transponder too: nobody tells that it is ours
    assert "own position UNKNOWN" in said
    assert len(collect(traffic.read(path, Counter())).at(0)) > 500


def test_a_receiver_that_falls_silent_at_the_surface_is_told_and_one_under_water_is_not() -> None:
    heard = picture(report(0.0), report(0.0, 0.0, 500.0, mmsi=230_000_002))
    heard.observe_own(own(0.0, depth_m=0.0))
    assert "picture.receiver_silent" not in {r.code for r in heard.notes(instant(100.0))}
    codes = {r.code for r in heard.notes(instant(200.0))}
    assert {"note.silent", "picture.receiver_silent"} <= codes
    dived = picture(report(0.0), report(0.0, 0.0, 500.0, mmsi=230_000_002))
    dived.observe_own(own(1.0, depth_m=5.0))
    codes = {r.code for r in dived.notes(instant(500.0))}
    assert "note.deaf" in codes
    assert not {"note.silent", "picture.receiver_silent"} & codes


def test_one_ship_that_falls_silent_among_others_is_not_the_receiver_s_fault() -> None:
    heard = picture(report(0.0), report(0.0, 0.0, 500.0, mmsi=230_000_002))
    for at in range(10, 300, 10):
        heard.observe(report(float(at), 5.0 * at))
    notes = {r.code: r.text for r in heard.notes(instant(295.0))}
    assert "230000002" in notes["note.silent"]
    assert "picture.receiver_silent" not in notes


@pytest.mark.parametrize("link", list(Link))
def test_damaged_frames_raise_nothing_and_invent_next_to_nothing(link: Link) -> None:
    """Thousands here; `python -m tests.benchmarks.bench_ingest mutate` takes a million of each."""
    reports, invented, heard, counts = damage.feed(link, 6_000, seed=2)
    assert reports > 50
    assert invented <= 0.02 * reports
    assert len(heard) <= damage.SHIPS + invented
    assert sum(counts.values()) > 1_000
