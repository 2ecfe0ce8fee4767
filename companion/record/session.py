"""The first record of a log: what a replay needs to know about the process that made it."""

import platform
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

from companion.config import Config, to_mapping
from companion.picture import learned
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
        bounds_sha256=learned.digest(config.contacts.bounds_file) or None,
        code_sha256=code_digest(),
        versions={
            "python": platform.python_version(),
            "machine": platform.machine(),
            **{library: version(library) for library in LIBRARIES},
        },
    )


@cache
def code_digest() -> str:
    """SHA-256 over the names and contents of the package's sources."""
    whole, root = sha256(), Path(__file__).parents[1]
    for path in sorted(root.rglob("*.py")):
        whole.update(path.relative_to(root).as_posix().encode())
        whole.update(path.read_bytes())
    return whole.hexdigest()


def differences(recorded: Session, here: Session) -> tuple[str, ...]:
    """What is other here than where the log was made, in sentences; older logs knew of no turning model."""
    found = []
    for what, then, now in (
        ("model", recorded.model_sha256, here.model_sha256),
        (
            "turning model",
            recorded.turning_model_sha256 or here.turning_model_sha256,
            here.turning_model_sha256,
        ),
        ("bounds file", recorded.bounds_sha256, here.bounds_sha256),
    ):
        if then != now:
            found.append(f"the {what} differs: recorded {(then or 'none')[:12]}, here {(now or 'none')[:12]}")
    if recorded.code_sha256 is not None and recorded.code_sha256 != here.code_sha256:
        found.append(f"the program differs: recorded by {recorded.software} of other sources than these")
    return tuple(found)
