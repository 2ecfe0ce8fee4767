"""Several receivers of our own position, and aircraft: ranked, watched, told apart."""

from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion import config
from companion.edges.files import read_candump
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Link, OwnPosition, Source, TargetKind
from companion.picture import Picture
from companion.picture.own_sources import OwnSources
from companion.utc import UtcClock
from companion.wire.adsb_vehicle import ADSB_VEHICLE
from companion.wire.mavlink import MavlinkDecoder
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.contact_reports import own

IJSSELMEER = "n2k_ijsselmeer_20221130_native.candump.gz"
BUS: Any = {"source": Source.NMEA2000}
MOVING: Any = {"velocity_ned_mps": (2.0, 0.0, 0.0), "heading_rad": 0.0}


def test_the_receiver_that_says_most_is_followed_and_kept() -> None:
    sources = OwnSources()
    assert sources.observe(own(0.0, talker=9, **BUS))
    assert not sources.observe(own(0.1, talker=3, **BUS, **MOVING))
    assert sources.observe(own(1.0, talker=9, **BUS))
    assert sources.observe(own(4.0, talker=3, **BUS, **MOVING))  # the other has been silent
    assert not sources.observe(own(4.1, talker=9, **BUS))


def test_a_receiver_that_disagrees_is_named_after_some_evidence() -> None:
    sources = OwnSources()
    for i in range(8):
        sources.observe(own(float(i), talker=3, **BUS, **MOVING))
        sources.observe(own(i + 0.1, 400.5, talker=9, **BUS))
        assert bool(sources.doubts(instant(i + 0.2))) == (i >= 4)
    (doubt,) = sources.doubts(instant(8.0))
    assert doubt.code == "own.sources_disagree"
    assert "NMEA2000 9 is 400 m from 3's" in doubt.text
    assert sources.doubts(instant(60.0)) == []


def test_receivers_of_different_links_are_not_compared() -> None:
    sources = OwnSources()
    for i in range(8):
        assert sources.observe(own(float(i)))
        assert sources.observe(own(float(i), 9000.0, talker=9, **BUS))
    assert sources.doubts(instant(8.0)) == []


def test_four_recorded_receivers_agree_and_one_is_followed(shared_data: Path) -> None:
    decoder, sources = Nmea2000Decoder(UtcClock()), OwnSources()
    followed = set()
    now = Instant(0)
    for number, one in enumerate(read_candump(shared_data / IJSSELMEER)):
        if number > 40_000:
            break
        for heard in decoder.decode(Frame(Instant(one.unix_ns), Link.CAN, one.data, one.can_id)):
            if isinstance(heard, OwnPosition) and sources.observe(heard):
                followed.add(heard.talker)
                now = heard.stamp
    assert len(followed) <= 2
    assert sources.doubts(now) == []


def adsb(**fields: Any) -> bytes:
    values: dict[str, Any] = {
        "ICAO_address": 4_700_000,
        "lat": 597_000_000,
        "lon": 247_000_000,
        "altitude_type": 0,
        "altitude": 900_000,
        "heading": 9_000,
        "hor_velocity": 6_000,
        "ver_velocity": 0,
        "callsign": b"OHRES1",
        "emitter_type": 7,
        "tslc": 2,
        "flags": 1 | 4 | 8 | 16,
        "squawk": 7000,
    }
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = dialect.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3).pack(mav)
    return beat + dialect.MAVLink_adsb_vehicle_message(**{**values, **fields}).pack(mav)  # type: ignore[no-any-return]


def test_an_aircraft_is_heard_and_is_no_contact() -> None:
    heard = MavlinkDecoder(system_id=0).decode(Frame(instant(5.0), Link.MAVLINK, adsb()))
    (report,) = [h for h in heard if isinstance(h, ContactReport)]
    assert (report.source, report.kind, report.name) == (Source.ADSB_VEHICLE, TargetKind.AIRCRAFT, "OHRES1")
    assert report.measured_at == instant(3.0)
    assert report.sog_mps == 60.0
    picture = Picture(config.Contacts())
    picture.observe(report)
    assert len(picture) == 0
    assert [r.code for r in picture.notes(instant(5.0))] == ["note.not_ships"]


def test_ardupilot_s_own_avoidance_database_is_no_aircraft() -> None:
    decoder = MavlinkDecoder(system_id=0)
    for odd in ({"emitter_type": 255}, {"callsign": b"OA_DB"}):
        heard = decoder.decode(Frame(instant(5.0), Link.MAVLINK, adsb(**odd)))
        assert not any(isinstance(h, ContactReport) for h in heard)
    assert decoder.counts["adsb_vehicle.own_database"] == 2
    assert ADSB_VEHICLE == dialect.MAVLINK_MSG_ID_ADSB_VEHICLE
