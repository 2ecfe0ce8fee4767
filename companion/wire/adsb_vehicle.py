"""MAVLink ADSB_VEHICLE (#246) to a contact report: aircraft are told from ships, and are no obstacle.

ArduPilot shows its own avoidance database in this message too; those entries are not aircraft.
"""

import math
from collections import Counter
from typing import Any

from companion.instant import Instant, after
from companion.messages import ContactReport, Source, TargetKind
from companion.wire import ais_rules

ADSB_VEHICLE = 246
VALID_COORDS, VALID_HEADING, VALID_VELOCITY, VALID_CALLSIGN = 1, 4, 8, 16
NOT_AN_AIRCRAFT = 255  # emitter type of ArduPilot's own database


def read(field: dict[str, Any], received: Instant, counts: Counter[str]) -> ContactReport | None:
    """The report in the fields of an ADSB_VEHICLE; None (counted) for what is no aircraft."""
    callsign = field["callsign"]
    raw = callsign if isinstance(callsign, bytes) else str(callsign).encode("ascii", "replace")
    name = ais_rules.text(raw)
    if field["emitter_type"] == NOT_AN_AIRCRAFT or (name or "").startswith("OA_DB"):
        counts["adsb_vehicle.own_database"] += 1
        return None
    flags: int = field["flags"]
    latitude, longitude = field["lat"] * 1e-7, field["lon"] * 1e-7
    placed = bool(flags & VALID_COORDS) and ais_rules.is_position(latitude, longitude)
    return ContactReport(
        mmsi=int(field["ICAO_address"]),
        source=Source.ADSB_VEHICLE,
        received_at=received,
        measured_at=after(received, -float(field["tslc"])),
        age_error_s=1.0,
        kind=TargetKind.AIRCRAFT,
        latitude_deg=latitude if placed else None,
        longitude_deg=longitude if placed else None,
        cog_rad=math.radians(field["heading"] / 100) if flags & VALID_HEADING else None,
        sog_mps=field["hor_velocity"] / 100 if flags & VALID_VELOCITY else None,
        name=name if flags & VALID_CALLSIGN else None,
    )
