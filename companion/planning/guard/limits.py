"""Speed, climb and depth limits of the vehicle, applied to whatever is wanted."""

import math

from companion.config import Vehicle
from companion.messages import OwnState, Reason
from companion.planning.guard.verdict import Velocity

ROUNDING = 1 + 1e-9


def limited(wanted: Velocity, own: OwnState, vehicle: Vehicle) -> tuple[Velocity, list[Reason]]:
    """The velocity within the limits (same direction in the plane), and what was cut."""
    reasons: list[Reason] = []
    north, east, down = wanted
    speed, most = math.hypot(north, east), vehicle.max_speed_mps
    if speed > most * ROUNDING:
        reasons.append(Reason("guard.speed", f"{speed:.2f} m/s cut to vehicle.max_speed_mps = {most:g}"))
        north, east = north * (most / speed), east * (most / speed)
    climb = vehicle.max_vertical_speed_mps
    kept = min(max(down, -climb), climb)
    floor_m = vehicle.max_depth_m
    if own.depth_m + kept > floor_m and kept > 0:  # one second ahead
        kept = max(0.0, floor_m - own.depth_m) if own.depth_m < floor_m else -climb
        reasons.append(Reason("guard.depth", f"kept above vehicle.max_depth_m = {floor_m:g}"))
    return (north, east, kept), reasons
