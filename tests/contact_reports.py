"""Contact reports for the tests of the picture, and the recorded ones."""

import csv
import gzip
import math
from collections.abc import Iterator
from pathlib import Path

from companion import config
from companion.edges.files import read_candump
from companion.geodesy import LocalFrame
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Heard, Link, OwnPosition, Source, TargetKind, Tracks
from companion.picture import Picture
from companion.utc import UtcClock
from companion.wire.nmea2000 import Nmea2000Decoder

FRAME = LocalFrame(59.7, 24.7)
SHIP = 230_000_001


def report(at_s: float, north_m: float = 0.0, east_m: float = 0.0, **fields: object) -> ContactReport:
    """A class A ship at a place of FRAME, heading north at 5 m/s, measured and received at `at_s`."""
    latitude_deg, longitude_deg = FRAME.to_geodetic(north_m, east_m)
    values: dict[str, object] = {
        "mmsi": SHIP,
        "source": Source.NMEA2000,
        "received_at": instant(at_s),
        "measured_at": instant(at_s),
        "age_error_s": 0.0,
        "kind": TargetKind.CLASS_A,
        "latitude_deg": latitude_deg,
        "longitude_deg": longitude_deg,
        "accurate": True,
        "cog_rad": 0.0,
        "sog_mps": 5.0,
        "heading_rad": 0.0,
    }
    return ContactReport(**{**values, **fields})  # type: ignore[arg-type]


def static(at_s: float, **fields: object) -> ContactReport:
    """A report without position."""
    nothing: dict[str, object] = {"latitude_deg": None, "longitude_deg": None, "sog_mps": None}
    return report(at_s, 0.0, 0.0, **{**nothing, **fields})


def own(at_s: float, north_m: float = 0.0, east_m: float = 0.0, **fields: object) -> OwnPosition:
    """Our own position at a place of FRAME."""
    latitude_deg, longitude_deg = FRAME.to_geodetic(north_m, east_m)
    values: dict[str, object] = {"stamp": instant(at_s), "source": Source.MAVLINK}
    return OwnPosition(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        **{**values, **fields},  # type: ignore[arg-type]
    )


def picture(*reports: ContactReport, **contacts: float | str) -> Picture:
    """A picture that has heard `reports`, with keys of the [contacts] section."""
    heard = Picture(config.Contacts(**contacts))  # type: ignore[arg-type]
    for each in reports:
        heard.observe(each)
    return heard


def tracks(heard: Picture, at_s: float) -> Tracks:
    """The tracks at an instant, in FRAME."""
    return heard.tracks(instant(at_s), FRAME)


def recorded_bus(path: Path) -> Iterator[Heard]:
    """What the production decoder hears in a recorded NMEA 2000 log."""
    decoder = Nmea2000Decoder(UtcClock())
    for frame in read_candump(path):
        yield from decoder.decode(Frame(Instant(frame.unix_ns), Link.CAN, frame.data, frame.can_id))


def recorded_houston(path: Path) -> Iterator[ContactReport]:
    """The rows of the Houston extract as AIS_VESSEL reports, seconds from 15:00 UTC."""
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            hour, minute, second = (int(part) for part in row["BaseDateTime"][11:].split(":"))
            at = instant((hour - 15) * 3600.0 + minute * 60.0 + second)
            cog, heading = float(row["COG"]), float(row["Heading"])
            yield ContactReport(
                mmsi=int(row["MMSI"]),
                source=Source.AIS_VESSEL,
                received_at=at,
                measured_at=at,
                age_error_s=0.5,
                latitude_deg=float(row["LAT"]),
                longitude_deg=float(row["LON"]),
                cog_rad=math.radians(cog) if cog < 360.0 else None,
                sog_mps=float(row["SOG"]) * 1852 / 3600,
                heading_rad=math.radians(heading) if heading < 360.0 else None,
                name=row["VesselName"],
            )
