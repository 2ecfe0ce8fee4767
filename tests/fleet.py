"""Many ships on straight courses, as reports and as the bytes of every link."""

import math

import numpy as np
from pyais.encode import encode_dict
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.instant import NS_PER_S, instant
from companion.messages import ContactReport, Hull, Link, Source, TargetKind
from sitl.ais import AisPosition
from sitl.bus import AisReceiver
from tests.contact_reports import FRAME

_FLAGS = 1 | 2 | 4 | 64 | 4096
_SPREAD_M = 30_000.0


class Fleet:
    """Ships by number; where each is at any time since the start."""

    source = Source.NMEA2000
    utc_ns = 1_700_000_000 * NS_PER_S // (60 * NS_PER_S) * 60 * NS_PER_S  # the start, on a full minute

    def __init__(self, ships: int, seed: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self._start = rng.uniform(-_SPREAD_M, _SPREAD_M, (ships, 2))
        self._sog = rng.uniform(1.0, 10.0, ships)
        self._cog = rng.uniform(0.0, math.tau, ships)
        self._packer = mav.MAVLink(None, srcSystem=1, srcComponent=156)
        self._bus = AisReceiver()

    def place(self, ship: int, at_s: float) -> tuple[float, float]:
        """Latitude and longitude, degrees."""
        way = self._sog[ship] * at_s
        north, east = self._start[ship] + way * np.array(
            (math.cos(self._cog[ship]), math.sin(self._cog[ship]))
        )
        return FRAME.to_geodetic(float(north), float(east))

    def mmsi(self, ship: int) -> int:
        """Its number."""
        return 230_000_000 + ship

    def report(self, ship: int, at_s: float) -> ContactReport:
        """As a decoder would make it."""
        latitude, longitude = self.place(ship, at_s)
        return ContactReport(
            mmsi=self.mmsi(ship),
            source=Source.AIVDM,
            received_at=instant(at_s),
            measured_at=instant(at_s),
            age_error_s=1.0,
            kind=TargetKind.CLASS_A,
            latitude_deg=latitude,
            longitude_deg=longitude,
            accurate=True,
            cog_rad=float(self._cog[ship]),
            sog_mps=float(self._sog[ship]),
            heading_rad=float(self._cog[ship]),
            hull=Hull(100.0, 50.0, 10.0, 12.0),
            ship_type=70,
        )

    def say(self, link: Link, ship: int, at_s: float) -> list[tuple[int, bytes]]:
        """The frames of one report: identifier (of CAN, else 0) and bytes."""
        if link is Link.MAVLINK:
            return [(0, self.ais_vessel(ship, at_s))]
        if link is Link.AIVDM:
            return [(0, self.aivdm(ship, at_s))]
        return self._bus.say(self._position(ship, at_s))

    def ais_vessel(self, ship: int, at_s: float) -> bytes:
        """MAVLink 2."""
        p = self._position(ship, at_s)
        message = mav.MAVLink_ais_vessel_message(
            MMSI=p.mmsi,
            lat=round(p.latitude_deg * 1e7),
            lon=round(p.longitude_deg * 1e7),
            COG=round(math.degrees(p.cog_rad) * 100) % 36_000,
            heading=round(math.degrees(p.heading_rad) * 100) % 36_000,
            velocity=round(p.sog_mps * 100),
            turn_rate=0,
            navigational_status=0,
            type=70,
            dimension_bow=100,
            dimension_stern=50,
            dimension_port=10,
            dimension_starboard=12,
            callsign=b"",
            name=f"SHIP {ship}".encode().ljust(20, b"@"),
            tslc=0,
            flags=_FLAGS,
        )
        data = bytes(message.pack(self._packer))
        self._packer.seq = (self._packer.seq + 1) % 256
        return data

    def aivdm(self, ship: int, at_s: float) -> bytes:
        """A sentence of type 1."""
        p = self._position(ship, at_s)
        fields: dict[str, str | int | float | bytes | bool] = {
            "type": 1,
            "mmsi": p.mmsi,
            "status": 0,
            "speed": p.sog_mps * 3600 / 1852,
            "accuracy": 1,
            "lat": p.latitude_deg,
            "lon": p.longitude_deg,
            "course": math.degrees(p.cog_rad) % 360,
            "heading": int(math.degrees(p.heading_rad)) % 360,
            "second": p.utc_second,
        }
        return f"{encode_dict(fields, talker_id='AI', sentence_type='VDM')[0]}\r\n".encode()

    def _position(self, ship: int, at_s: float) -> AisPosition:
        latitude, longitude = self.place(ship, at_s)
        return AisPosition(
            mmsi=self.mmsi(ship),
            latitude_deg=latitude,
            longitude_deg=longitude,
            sog_mps=float(self._sog[ship]),
            cog_rad=float(self._cog[ship]),
            heading_rad=float(self._cog[ship]),
            navigational_status=0,
            accurate=True,
            utc_second=int(at_s) % 60,
        )
