"""A new folder for every run, named by UTC."""

from datetime import UTC, datetime
from pathlib import Path

from companion.errors import ConfigError


def new_run_folder(parent: Path) -> Path:
    """Create `parent`/YYYYMMDD-HHMMSS (UTC), with a number behind it where that exists already."""
    name = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    for attempt in range(1, 1000):
        folder = parent / (name if attempt == 1 else f"{name}-{attempt}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            if parent.exists() and not parent.is_dir():
                raise ConfigError(f"{parent} is a file; name a folder for the runs by --out") from None
            continue
        except OSError as error:
            raise ConfigError(f"cannot create {folder}: {error.strerror}; name another by --out") from None
        return folder
    raise ConfigError(f"{parent} is full of runs of this second; name another folder by --out")
