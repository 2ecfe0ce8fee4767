"""Every exception this package raises on purpose.

    CompanionError
    +-- ConfigError      a configuration key, option or file is wrong: names it and the remedy
    |   +-- ModelError   the ONNX file is missing, foreign, or disagrees with the configuration
    +-- LinkError        a MAVLink or CAN link cannot be opened
    +-- LogError         a recorded file cannot be read at all

They are raised at start only.  Bytes from outside never raise: they are dropped and counted.
Doubt at run time never raises: it becomes a `Decision` with a reason.
"""


class CompanionError(Exception):
    """Base of all errors a person can mend; `str()` is the sentence that tells how."""


class ConfigError(CompanionError):
    """A configuration value is unusable."""


class ModelError(ConfigError):
    """The network file is missing, is not ours, or was trained for other constants."""


class LinkError(CompanionError):
    """A link to the world cannot be opened."""


class LogError(CompanionError):
    """A recorded file cannot be read."""
