"""The first record of a log: what a replay needs to know about the process that made it."""

import platform
from importlib.metadata import version

from companion.config import Config, to_mapping
from companion.record.schema import SCHEMA_VERSION, Session

LIBRARIES = ("numpy", "onnxruntime", "pymavlink", "pymap3d", "filterpy")  # their digits are in the decisions


def session(config: Config, model_digest: str, turning_digest: str = "") -> Session:
    """Describe this process; a digest is "" where no such network was loaded."""
    return Session(
        schema_version=SCHEMA_VERSION,
        software=version("companion"),
        rate_hz=config.timing.rate_hz,
        config=to_mapping(config),
        model_sha256=model_digest or None,
        turning_model_sha256=turning_digest or None,
        versions={
            "python": platform.python_version(),
            "machine": platform.machine(),
            **{library: version(library) for library in LIBRARIES},
        },
    )
