"""Small builders for the tests: a track table, a configuration, an own state, with sensible values."""

from typing import Any

import numpy as np

from companion.config import Config, from_mapping
from companion.instant import Instant, instant
from companion.messages import AutopilotHeartbeat, FloatArray, OwnState, Tracks

GOAL = {"latitude_deg": 59.71, "longitude_deg": 24.7}


def config(**sections: dict[str, object]) -> Config:
    """The default configuration with `sections` laid over it."""
    return from_mapping({"goal": GOAL, **sections})


def tracks(*rows: dict[str, float], revision: int = 1) -> Tracks:
    """Ships by row; what a row leaves out is the paper's 75 x 25 m ship heading north at 5 m/s."""
    base: dict[str, float] = {
        "mmsi": 0,
        "measured_at_s": 0.0,
        "north_m": 0.0,
        "east_m": 0.0,
        "cog_rad": 0.0,
        "sog_mps": 5.0,
        "bow_m": 37.5,
        "stern_m": 37.5,
        "port_m": 12.5,
        "starboard_m": 12.5,
        "position_error_m": 0.0,
        "speed_noise_mps": 0.05,
        "course_noise_rad": 0.01,
        "heading_error_rad": 0.01,
        "disc_speed_mps": 16.0,
        "top_speed_mps": 16.0,
        "validity_s": 600.0,
        "model": 0,
    }
    full = [{**base, "mmsi": 230_000_001 + i, **row} for i, row in enumerate(rows)]
    for row in full:
        row.setdefault("heading_rad", row["cog_rad"])

    def column(name: str) -> FloatArray:
        return np.array([row[name] for row in full], dtype=np.float64)

    whole = {"mmsi", "model"}
    columns: dict[str, Any] = {
        name: column(name).astype(np.int64) if name in whole else column(name)
        for name in (*base, "heading_rad")
        if name != "measured_at_s"
    }
    return Tracks(
        revision=revision,
        measured_at_ns=(column("measured_at_s") * 1e9).astype(np.int64),
        names=tuple(f"SHIP {i}" for i in range(len(full))),
        **columns,
    )


def own(north_m: float = 0.0, east_m: float = 0.0, *, depth_m: float = 45.0, at_s: float = 0.0) -> OwnState:
    """The vehicle, at rest, heading north."""
    return OwnState(instant(at_s), north_m, east_m, depth_m, (0.0, 0.0, 0.0), 0.0)


def heartbeat(at_s: float = 0.0, **fields: object) -> AutopilotHeartbeat:
    """An armed submarine in GUIDED."""
    values: dict[str, object] = {
        "stamp": instant(at_s),
        "system_id": 1,
        "component_id": 1,
        "firmware": "ardupilot",
        "vehicle": "submarine",
        "armed": True,
        "takes_setpoints": True,
        "mode": "GUIDED",
    }
    return AutopilotHeartbeat(**{**values, **fields})  # type: ignore[arg-type]


T0: Instant = instant(0.0)
