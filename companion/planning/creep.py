"""How a boat stands still.

A boat turns a velocity into heading and forward speed, and zero velocity has a direction too: to
ArduPilot's Rover it means "turn north".  So a surface vehicle creeps along its present heading.
"""

import math

import numpy as np

from companion.config import Vehicle
from companion.messages import FloatArray, OwnState

CREEP_MPS = 0.05  # slow enough to stand still by, fast enough to keep a boat's heading


def creep(velocity_mps: FloatArray, own: OwnState, vehicle: Vehicle) -> FloatArray:
    """The velocity (2,), north and east, or the creep in place of next to none on a surface vehicle."""
    if vehicle.cruise_depth_m > 0 or own.heading_rad is None or math.hypot(*velocity_mps) >= CREEP_MPS:
        return velocity_mps
    return CREEP_MPS * np.array((math.cos(own.heading_rad), math.sin(own.heading_rad)))
