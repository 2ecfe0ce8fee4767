"""The nouns of the line from report to setpoint, each one frozen.

    Frame -wire-> Heard -picture-> Tracks -reach-> ReachableSets -field-> Repulsion -guard-> Setpoint

SI units, radians, seconds.  Local frame: NED around `LocalFrame`'s origin (x north, y east,
z down).  Headings and courses clockwise from true north.  "Not available" is `None` (or NaN in
an array whose docstring says so), never a number.
"""

from companion.messages.arrays import BoolArray, FloatArray, IntArray
from companion.messages.decision import (
    Command,
    Decision,
    Heartbeat,
    Outgoing,
    Phase,
    Reason,
    Setpoint,
    Status,
    StatusText,
)
from companion.messages.heard import (
    AutopilotHeartbeat,
    CommandAck,
    ContactReport,
    Frame,
    Heard,
    Hull,
    Link,
    OwnPosition,
    Source,
    TargetKind,
    UtcTime,
)
from companion.messages.repulsion import Nearest, Repulsion
from companion.messages.tracks import SPREAD_AGES_S, Model, OwnState, Tracks

__all__ = [
    "SPREAD_AGES_S",
    "AutopilotHeartbeat",
    "BoolArray",
    "Command",
    "CommandAck",
    "ContactReport",
    "Decision",
    "FloatArray",
    "Frame",
    "Heard",
    "Heartbeat",
    "Hull",
    "IntArray",
    "Link",
    "Model",
    "Nearest",
    "Outgoing",
    "OwnPosition",
    "OwnState",
    "Phase",
    "Reason",
    "Repulsion",
    "Setpoint",
    "Source",
    "Status",
    "StatusText",
    "TargetKind",
    "Tracks",
    "UtcTime",
]
