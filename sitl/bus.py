"""The devices on the vehicle's NMEA 2000 bus: a GNSS receiver and an AIS receiver.

The PGNs are encoded by the `nmea2000` library (canboat's database), which shares nothing with
the companion's decoder.
"""

import itertools

from nmea2000.encoder import create_encoder
from nmea2000.input_formats import N2KFormat
from nmea2000.message import FieldScalarValue, NMEA2000Field, NMEA2000Message

from sitl.ais import AisPosition, AisReport, AisStatic

GNSS_ADDRESS = 12
AIS_ADDRESS = 43
_DAY_NS = 86_400_000_000_000

CanData = tuple[int, bytes]


class Talker:
    """One device: turns its messages into CAN frames (29-bit id, data), fast packets split."""

    def __init__(self, address: int) -> None:
        self.address = address
        self._encoder = create_encoder(N2KFormat.PYTHON_CAN, units="si")

    def say(self, pgn: int, priority: int, **values: FieldScalarValue) -> list[CanData]:
        """The frames of one message; fields not named are sent as "not available"."""
        fields = [NMEA2000Field(id=key, value=value, raw_value=_raw(value)) for key, value in values.items()]
        message = NMEA2000Message(
            PGN=pgn, fields=fields, source=self.address, destination=255, priority=priority
        )
        return [(frame.arbitration_id, bytes(frame.data)) for frame in self._encoder.encode(message)]


class GnssReceiver:
    """System time and own position, once a second."""

    def __init__(self) -> None:
        self._talker = Talker(GNSS_ADDRESS)
        self._sid = itertools.cycle(range(253))

    def say(self, utc_ns: int, latitude_deg: float, longitude_deg: float) -> list[CanData]:
        """PGN 126992 and 129029 for a fix at `utc_ns`."""
        sid = next(self._sid)
        days, into_ns = divmod(utc_ns, _DAY_NS)
        clock: dict[str, FieldScalarValue] = {"sid": sid, "date": days, "time": into_ns // 100_000 * 1e-4}
        return self._talker.say(126992, 3, source=0, **clock) + self._talker.say(
            129029,
            3,
            **clock,
            latitude=latitude_deg,
            longitude=longitude_deg,
            altitude=0.0,
            gnssType=0,
            method=1,
            integrity=0,
            numberOfSvs=11,
            hdop=0.8,
            pdop=1.5,
        )


class AisReceiver:
    """Repeats what it hears on the air: PGN 129038 for positions, 129794 for static data."""

    def __init__(self) -> None:
        self._talker = Talker(AIS_ADDRESS)

    def say(self, report: AisReport) -> list[CanData]:
        """The frames of one report."""
        if isinstance(report, AisPosition):
            return self._position(report)
        return self._static(report)

    def _position(self, report: AisPosition) -> list[CanData]:
        return self._talker.say(
            129038,
            4,
            messageId=1,
            repeatIndicator=0,
            userId=report.mmsi,
            longitude=report.longitude_deg,
            latitude=report.latitude_deg,
            positionAccuracy=int(report.accurate),
            raim=0,
            timeStamp=report.utc_second,
            cog=report.cog_rad,
            sog=report.sog_mps,
            communicationState=bytes(3),
            aisTransceiverInformation=0,
            heading=report.heading_rad,
            rateOfTurn=0.0,
            navStatus=report.navigational_status,
            specialManeuverIndicator=0,
        )

    def _static(self, report: AisStatic) -> list[CanData]:
        hull = report.hull
        return self._talker.say(
            129794,
            6,
            messageId=5,
            repeatIndicator=0,
            userId=report.mmsi,
            imoNumber=report.imo,
            callsign=report.callsign,
            name=report.name,
            typeOfShip=report.ship_type,
            length=hull.bow_m + hull.stern_m,
            beam=hull.port_m + hull.starboard_m,
            positionReferenceFromStarboard=hull.starboard_m,
            positionReferenceFromBow=hull.bow_m,
            draft=report.draught_m,
            destination="",
            aisVersionIndicator=0,
            gnssType=1,
            dte=0,
            aisTransceiverInformation=0,
        )


def _raw(value: FieldScalarValue) -> int | float | str | bytes | None:
    return value if isinstance(value, int | float | str | bytes) else None
