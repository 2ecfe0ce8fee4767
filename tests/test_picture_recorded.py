"""The picture on recorded traffic: counts, the known odd cases, nothing believed that should not be."""

from collections.abc import Iterable
from pathlib import Path

import pytest

from companion import config
from companion.geodesy import LocalFrame
from companion.instant import Instant, after, instant
from companion.messages import ContactReport, Heard, OwnPosition, Tracks
from companion.picture import Picture
from tests.contact_reports import recorded_bus, recorded_houston


def listen(heard: Iterable[Heard], look_every_s: float) -> tuple[Picture, list[Tracks]]:
    """A picture fed with a log, and what it showed at regular times once an own position was known."""
    picture = Picture(config.Contacts())
    frame: LocalFrame | None = None
    shown: list[Tracks] = []
    look = Instant(0)
    for each in heard:
        match each:
            case OwnPosition():
                picture.observe_own(each)
                frame = frame or LocalFrame(each.latitude_deg, each.longitude_deg)
                now = each.stamp
            case ContactReport():
                picture.observe(each)
                now = each.received_at
            case _:
                continue
        if frame is not None and now >= look:
            look = after(now, look_every_s)
            shown.append(picture.tracks(now, frame))
    assert frame is not None
    shown.append(picture.tracks(now, frame))
    return picture, shown


def codes(picture: Picture) -> dict[str, str]:
    return {reason.code: reason.text for reason in picture.notes(instant(0.0))}


@pytest.fixture(scope="module")
def gulf(shared_data: Path) -> tuple[Picture, list[Tracks]]:
    return listen(recorded_bus(shared_data / "n2k_gulf_of_finland_20140815_refragmented.candump.gz"), 2.0)


@pytest.fixture(scope="module")
def ijsselmeer(shared_data: Path) -> tuple[Picture, list[Tracks]]:
    return listen(recorded_bus(shared_data / "n2k_ijsselmeer_20221130_native.candump.gz"), 2.0)


def test_gulf_every_vessel_but_our_own_is_a_track(gulf: tuple[Picture, list[Tracks]]) -> None:
    """95 vessels give positions; one of them is the yacht that recorded the log."""
    picture, shown = gulf
    mmsi = shown[-1].mmsi.tolist()
    assert len(mmsi) == len(set(mmsi)) == 94
    assert picture.counts["picture.quarantined"] == 0
    assert "27653800" in codes(picture)["note.odd_number"]


def test_gulf_the_yacht_s_echo_is_no_contact_and_its_neighbour_is(
    gulf: tuple[Picture, list[Tracks]],
) -> None:
    picture, shown = gulf
    assert "230035780" in codes(picture)["note.echo"]
    assert all(230035780 not in table.mmsi for table in shown[1:])
    heard_since = next(i for i, table in enumerate(shown) if 230008070 in table.mmsi)
    assert all(230008070 in table.mmsi for table in shown[heard_since:])


def test_gulf_revisions_are_the_objects(gulf: tuple[Picture, list[Tracks]]) -> None:
    revisions = [table.revision for table in gulf[1]]
    assert revisions == sorted(revisions)
    assert len(set(revisions)) == len({id(table) for table in gulf[1]})


def test_ijsselmeer_our_echo_goes_and_the_marina_stays(ijsselmeer: tuple[Picture, list[Tracks]]) -> None:
    """Moored: the echo is told from the boat ten metres off by its rate alone."""
    picture, shown = ijsselmeer
    last = shown[-1].mmsi.tolist()
    assert len(last) == len(set(last)) == 180
    assert 244010225 not in last
    assert {244670233, 244850715, 244740074} <= set(last)
    assert "244010225" in codes(picture)["note.echo"]
    assert "877227750" in codes(picture)["note.odd_number"]


def test_houston_the_one_teleport_is_quarantined_and_nothing_else(shared_data: Path) -> None:
    """14,060 rows of ferries, tows and pilots; MMSI 258947000 jumps 7 miles for one report and back."""
    picture = Picture(config.Contacts())
    frame = LocalFrame(29.5, -94.8)
    jumped: list[Instant] = []
    for report in recorded_houston(shared_data / "ais_houston_ship_channel_20200101_1500-1700Z.csv.gz"):
        before = picture.counts["picture.quarantined"]
        picture.observe(report)
        if picture.counts["picture.quarantined"] > before:
            assert report.mmsi == 258947000
            jumped.append(report.received_at)
            table = picture.tracks(report.received_at, frame)
            norths = sorted(table.north_m[table.mmsi == 258947000])
            assert norths[1] - norths[0] == pytest.approx(7.0 * 1852, rel=0.01)
    assert jumped == [instant(4866.0)]
    assert picture.counts["picture.refuted"] == 1
    assert picture.counts["picture.duplicate"] == 3
    assert picture.tracks(instant(7200.0), frame).mmsi.shape == (280,)
