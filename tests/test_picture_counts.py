"""Reports in and tracks out, counted by decoders not ours: pyais, and its words packed by pymavlink."""

import gzip
import math
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from pyais.stream import IterMessages
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion import config
from companion.edges import traffic
from companion.instant import instant
from companion.messages import ContactReport, Frame, Heard, Link
from companion.picture import Picture
from companion.wire.mavlink import MavlinkDecoder

DANISH = "aivdm_danish_network_20100611_27s.nmea.gz"
FORGED, FORGED_PLACES = 111_111_111, 2  # one number, an aircraft's, on two anchored ships 900 km apart
BASE_UNDER_A_SHIP_S_NUMBER = 257_049_000


@pytest.fixture(scope="module")
def told(shared_data: Path) -> list[dict[str, Any]]:
    """The fields of every message a ship sent about where it is, by pyais."""
    with gzip.open(shared_data / DANISH) as stream:
        lines = [line for line in stream.read().splitlines() if line.startswith(b"!")]
    messages = [m for m in IterMessages(lines) if m.type == "VDM"]
    fields: list[dict[str, Any]] = [m.decode().asdict() for m in messages]
    return [f for f in fields if f["msg_type"] in (1, 2, 3, 18, 19) and f["lat"] <= 90 and f["lon"] <= 180]


def filled(heard: Iterable[Heard]) -> Picture:
    picture = Picture(config.Contacts())
    for each in heard:
        if isinstance(each, ContactReport):
            picture.observe(each)
    return picture


def ais_vessel(field: dict[str, Any], packer: mav.MAVLink) -> bytes:
    """A message of pyais as an autopilot that passes AIS on would send it."""
    speed, course, heading = field["speed"], field["course"], field["heading"]
    message = mav.MAVLink_ais_vessel_message(
        MMSI=int(field["mmsi"]),
        lat=round(field["lat"] * 1e7),
        lon=round(field["lon"] * 1e7),
        COG=round(course * 100),
        heading=heading * 100,
        velocity=round(speed * 1852 / 36),
        turn_rate=0,
        navigational_status=int(field.get("status", 15)),
        type=0,
        dimension_bow=0,
        dimension_stern=0,
        dimension_port=0,
        dimension_starboard=0,
        callsign=b"",
        name=b"",
        tslc=0,
        flags=(mav.AIS_FLAGS_VALID_COG if course < 360 else 0)
        | (mav.AIS_FLAGS_VALID_VELOCITY if speed < 102.3 else 0),
    )
    return bytes(message.pack(packer))


def same(ours: float | None, theirs: float | None, within: float) -> bool:
    return ours is theirs if ours is None or theirs is None else abs(ours - theirs) <= within


def test_every_ship_of_the_danish_network_is_a_contact_where_pyais_puts_it(
    told: list[dict[str, Any]], shared_data: Path
) -> None:
    picture = filled(traffic.read(shared_data / DANISH, Counter()))
    assert picture.placed() == {int(f["mmsi"]) for f in told} | {BASE_UNDER_A_SHIP_S_NUMBER}
    assert len(picture.places_deg()) == len(picture.placed()) + FORGED_PLACES - 1
    assert picture.counts["picture.quarantined"] == FORGED_PLACES - 1
    assert picture.counts["picture.not_a_ship.coast"] == 75
    assert picture.counts["picture.not_a_ship.aid"] == 23
    assert picture.counts["picture.not_a_ship.aircraft"] == 1


def test_the_same_ships_over_mavlink_are_the_same_contacts(told: list[dict[str, Any]]) -> None:
    packer, decoder = mav.MAVLink(None, srcSystem=1, srcComponent=1), MavlinkDecoder(system_id=1)
    heard: list[Heard] = []
    for number, field in enumerate(told):
        frame = Frame(instant(number * 0.01), Link.MAVLINK, ais_vessel(field, packer))
        heard += decoder.decode(frame)
        packer.seq = (packer.seq + 1) % 256
    assert len(heard) == len(told)
    for report, field in zip(heard, told, strict=True):
        assert isinstance(report, ContactReport)
        assert report.mmsi == int(field["mmsi"])
        assert report.latitude_deg == pytest.approx(field["lat"], abs=6e-8)
        assert report.longitude_deg == pytest.approx(field["lon"], abs=6e-8)
        assert same(report.sog_mps, field["speed"] * 1852 / 3600 if field["speed"] < 102.3 else None, 5e-3)
        assert same(report.cog_rad, math.radians(field["course"]) if field["course"] < 360 else None, 1e-4)
    # AIS_VESSEL does not say which message a ship sent: a number of an aircraft is an aircraft
    assert filled(heard).placed() == {int(f["mmsi"]) for f in told} - {FORGED}
