"""Arming and mode changes: only where the configuration says so.

By default a human arms the vehicle and puts it in GUIDED or OFFBOARD; taking it out again is how
a human takes over.  So a permitted request is repeated only until it has succeeded once: from
then on every change of mode or arming is a human's, and is never argued with.
"""

from companion.config import Autopilot
from companion.instant import Instant, elapsed_s
from companion.messages import AutopilotHeartbeat, Command

DO_SET_MODE = 176  # MAV_CMD_DO_SET_MODE
COMPONENT_ARM_DISARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
CUSTOM_MODE_ENABLED = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
RETRY_S = 2.0  # ArduSub refuses GUIDED until it has a position

# custom mode that takes velocity setpoints, by vehicle (ArduSub mode.h, Rover mode.h); PX4's main mode
GUIDED = {"submarine": 4.0, "boat": 15.0, "rover": 15.0}
OFFBOARD = 6.0


class Takeover:
    """Asks for the mode, then for arming."""

    def __init__(self, permissions: Autopilot) -> None:
        self._may_set_mode = permissions.may_set_mode
        self._may_arm = permissions.may_arm
        self._asked_at: Instant | None = None

    def due(self, now: Instant, heartbeat: AutopilotHeartbeat) -> Command | None:
        """The command to send now, if any."""
        self._may_set_mode &= not heartbeat.takes_setpoints
        self._may_arm &= not heartbeat.armed
        if self._asked_at is not None and elapsed_s(self._asked_at, now) < RETRY_S:
            return None
        command = None
        if self._may_set_mode:
            mode = OFFBOARD if heartbeat.firmware == "px4" else GUIDED.get(heartbeat.vehicle)
            if mode is not None:
                command = Command(DO_SET_MODE, (CUSTOM_MODE_ENABLED, mode, 0.0, 0.0, 0.0, 0.0, 0.0))
        elif self._may_arm and heartbeat.takes_setpoints:
            command = Command(COMPONENT_ARM_DISARM, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        if command is not None:
            self._asked_at = now
        return command
