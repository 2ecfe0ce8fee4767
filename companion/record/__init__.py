"""The log of a run: what came in, what was decided, what went out, in one MCAP file."""

from companion.record.difference import EXACT, OTHER_MACHINE, FieldDifference, Tolerance, first_difference
from companion.record.digest import DecisionRecorder
from companion.record.reader import Log, Step
from companion.record.schema import SCHEMA_VERSION, Session, Topic, encode
from companion.record.writer import LOG_NAME, Recorder

__all__ = [
    "EXACT",
    "LOG_NAME",
    "OTHER_MACHINE",
    "SCHEMA_VERSION",
    "DecisionRecorder",
    "FieldDifference",
    "Log",
    "Recorder",
    "Session",
    "Step",
    "Tolerance",
    "Topic",
    "encode",
    "first_difference",
]
