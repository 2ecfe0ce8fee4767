"""What all tests share: where the recorded traffic lies."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded real traffic beside the project."""
    return Path(__file__).parents[2] / "shared" / "data"
