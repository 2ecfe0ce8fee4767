"""What all tests share: where the recorded traffic lies, and the recorded buses, decoded once."""

from pathlib import Path

import pytest

from tests.bus_messages import GULF, IJSSELMEER, Recording, recording


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded real traffic beside the project."""
    return Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def gulf(shared_data: Path) -> Recording:
    """The Gulf of Finland's bus, read once for all tests."""
    return recording(shared_data / GULF)


@pytest.fixture(scope="session")
def ijsselmeer(shared_data: Path) -> Recording:
    """The IJsselmeer's."""
    return recording(shared_data / IJSSELMEER)
