"""The autopilot's AIS receiver: what it keeps of each vessel and how it passes it on.

As ArduPilot does: AIS_VESSEL only on request, one vessel an interval, each again on change or
every 30 s, `tslc` rising meanwhile, dropped after 600 s without a position.  Static data neither
makes a vessel newer nor sends it again: it rides with the next position.
"""

import math
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.instant import Instant, elapsed_s
from sitl.ais import AisPosition, AisReport, AisStatic

RESEND_S = 30.0
FORGET_S = 600.0
_U16 = 0xFFFF
_NO_SIDE = 0xFF  # dimension_port, dimension_starboard
_NO_TURN = 127


@dataclass(slots=True)
class _Vessel:
    heard: Instant  # the position, or the static data of a ship without one
    position: AisPosition | None = None
    static: AisStatic | None = None
    sent: Instant | None = None
    changed: bool = False


class AisList:
    """Vessels heard; `due` hands out the next message to send, if any."""

    def __init__(self) -> None:
        self._vessels: dict[int, _Vessel] = {}

    def __len__(self) -> int:
        return len(self._vessels)

    def hear(self, t: Instant, report: AisReport) -> None:
        """Take a report off the air."""
        vessel = self._vessels.setdefault(report.mmsi, _Vessel(heard=t))
        if isinstance(report, AisPosition):
            vessel.position, vessel.heard, vessel.changed = report, t, True
        else:
            vessel.static = report

    def due(self, t: Instant) -> mav.MAVLink_ais_vessel_message | None:
        """The vessel that has waited longest for its turn, as a message."""
        silent = [mmsi for mmsi, v in self._vessels.items() if elapsed_s(v.heard, t) > FORGET_S]
        for mmsi in silent:
            del self._vessels[mmsi]
        waiting = [v for v in self._vessels.values() if v.position is not None and _wants_turn(v, t)]
        if not waiting:
            return None
        vessel = min(waiting, key=lambda v: -math.inf if v.sent is None else v.sent)
        vessel.sent, vessel.changed = t, False
        return _message(vessel, t)


def _wants_turn(vessel: _Vessel, t: Instant) -> bool:
    return vessel.changed or vessel.sent is None or elapsed_s(vessel.sent, t) >= RESEND_S


def _message(vessel: _Vessel, t: Instant) -> mav.MAVLink_ais_vessel_message:
    position, static = vessel.position, vessel.static
    assert position is not None
    flags = mav.AIS_FLAGS_VALID_COG | mav.AIS_FLAGS_VALID_VELOCITY
    flags |= mav.AIS_FLAGS_POSITION_ACCURACY if position.accurate else 0
    bow, stern, port, starboard = _U16, _U16, _NO_SIDE, _NO_SIDE
    kind, callsign, name = 0, b"", b""
    if static is not None:
        flags |= mav.AIS_FLAGS_VALID_DIMENSIONS | mav.AIS_FLAGS_VALID_CALLSIGN | mav.AIS_FLAGS_VALID_NAME
        hull = static.hull
        bow, stern = round(hull.bow_m), round(hull.stern_m)
        port, starboard = round(hull.port_m), round(hull.starboard_m)
        kind, callsign, name = static.ship_type, static.callsign.encode("ascii"), static.name.encode("ascii")
    return mav.MAVLink_ais_vessel_message(
        MMSI=position.mmsi,
        lat=round(position.latitude_deg * 1e7),
        lon=round(position.longitude_deg * 1e7),
        COG=round(math.degrees(position.cog_rad) * 100) % 36000,
        heading=round(math.degrees(position.heading_rad) * 100) % 36000,
        velocity=round(position.sog_mps * 100),
        turn_rate=_NO_TURN,
        navigational_status=position.navigational_status,
        type=kind,
        dimension_bow=bow,
        dimension_stern=stern,
        dimension_port=port,
        dimension_starboard=starboard,
        callsign=callsign,
        name=name,
        tslc=int(elapsed_s(vessel.heard, t)),
        flags=flags,
    )
