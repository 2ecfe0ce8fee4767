"""What distinguishes the autopilots the bundled one stands in for: one row of data each.

The rows restate what their sources and simulators do with SET_POSITION_TARGET_LOCAL_NED, how
they name modes, and when they lose patience.  `sitl.autopilot` has no `if firmware`.
"""

from dataclasses import dataclass, field, replace
from enum import Enum, auto

from pymavlink.dialects.v20 import ardupilotmega as mav

VELOCITY_ONLY = 0x0DC7  # ignore position, acceleration, yaw and yaw rate
_HORIZONTAL_VELOCITY_ONLY = 0x0DE7  # the same without vz: Rover's wiki


class Flight(Enum):
    """What a mode does with the hull."""

    SETPOINTS = auto()  # flies the companion's velocity
    REST = auto()  # comes to rest
    SURFACE = auto()  # rises to the surface


@dataclass(frozen=True, slots=True)
class Mode:
    """A flight mode: its custom_mode number and what it does."""

    name: str
    number: int
    flight: Flight = Flight.REST


@dataclass(frozen=True, slots=True)
class Profile:
    """An autopilot's habits.

    `stream_gap_s`: setpoints must have come no further apart than this before the setpoint mode can be
    entered (None: no such rule).  `after_timeout`: the mode it falls into when setpoints stop
    (None: stays, with velocity zero).
    """

    name: str
    autopilot: int
    vehicle: int
    modes: tuple[Mode, ...]
    masks: frozenset[int] = frozenset({VELOCITY_ONLY})
    frames: frozenset[int] = frozenset({mav.MAV_FRAME_LOCAL_NED})
    mask_complaint: str = ""
    setpoint_timeout_s: float = 3.0
    timeout_complaint: str = ""
    timeout_holds_heading: bool = False
    after_timeout: str | None = None
    stream_gap_s: float | None = None
    main_mode_shift: bool = False  # DO_SET_MODE carries PX4's main and sub mode apart
    params: dict[str, float] = field(default_factory=dict)

    @property
    def setpoint_mode(self) -> Mode:
        """The mode that takes velocity setpoints: GUIDED or OFFBOARD."""
        return next(mode for mode in self.modes if mode.flight is Flight.SETPOINTS)

    def mode(self, name_or_number: str | int) -> Mode | None:
        """The mode of this name or custom_mode number, if the autopilot has it."""
        return next((m for m in self.modes if name_or_number in (m.name, m.number)), None)


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


_ARDUPILOT_FRAMES = frozenset({mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_OFFSET_NED})

SUB = Profile(
    name="sub",
    autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    vehicle=mav.MAV_TYPE_SUBMARINE,
    modes=(
        Mode("GUIDED", 4, Flight.SETPOINTS),
        Mode("STABILIZE", 0),
        Mode("ALT_HOLD", 2),
        Mode("SURFACE", 9, Flight.SURFACE),
        Mode("POSHOLD", 16),
        Mode("MANUAL", 19),
    ),
    frames=_ARDUPILOT_FRAMES,
    params={"FS_PILOT_INPUT": 0.0, "FS_PILOT_TIMEOUT": 3.0, "FS_GCS_ENABLE": 0.0},
)

BOAT = Profile(
    name="boat",
    autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    vehicle=mav.MAV_TYPE_SURFACE_BOAT,
    modes=(
        Mode("GUIDED", 15, Flight.SETPOINTS),
        Mode("MANUAL", 0),
        Mode("HOLD", 4),
        Mode("LOITER", 5),
    ),
    masks=frozenset({VELOCITY_ONLY, _HORIZONTAL_VELOCITY_ONLY}),
    frames=_ARDUPILOT_FRAMES,
    mask_complaint="set ACC_IGNORE in mask",
    timeout_complaint="target not received last 3secs, stopping",
    timeout_holds_heading=True,
    params={"FRAME_CLASS": 2.0, "FS_ACTION": 2.0, "FS_TIMEOUT": 1.5, "FS_GCS_ENABLE": 0.0},
)

ROVER = replace(
    BOAT, name="rover", vehicle=mav.MAV_TYPE_GROUND_ROVER, params={**BOAT.params, "FRAME_CLASS": 1.0}
)

PX4 = Profile(
    name="px4",
    autopilot=mav.MAV_AUTOPILOT_PX4,
    vehicle=mav.MAV_TYPE_SUBMARINE,
    modes=(
        Mode("OFFBOARD", _px4(6), Flight.SETPOINTS),
        Mode("MANUAL", _px4(1)),
        Mode("POSCTL", _px4(3)),
        Mode("AUTO.LOITER", _px4(4, 3)),
    ),
    setpoint_timeout_s=1.0,
    timeout_complaint="Offboard control lost",
    after_timeout="AUTO.LOITER",
    stream_gap_s=0.5,
    main_mode_shift=True,
    params={"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 5.0, "COM_RCL_EXCEPT": 4.0},
)

PROFILES = {profile.name: profile for profile in (SUB, BOAT, ROVER, PX4)}
