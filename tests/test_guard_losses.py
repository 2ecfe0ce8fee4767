"""Rows of the table in docs/guard.md that no other test proves, and that the table names tests that exist."""

import re
from dataclasses import replace
from pathlib import Path

from companion.instant import instant
from companion.planning.guard import Guard
from tests.builders import config, heartbeat, own, tracks

PAGE = Path(__file__).parents[1] / "docs" / "guard.md"


def codes_at(guard: Guard, at_s: float, ship_at_s: float = 0.0) -> set[str]:
    ship = tracks({"measured_at_s": ship_at_s, "north_m": 2000.0, "sog_mps": 0.0})
    state = replace(own(depth_m=0.0, at_s=at_s))
    verdict = guard.check(instant(at_s), state, heartbeat(at_s), ship, 1, (0.0, 0.0, 0.0))
    return {reason.code for reason in verdict.reasons}


def test_a_contact_source_that_dies_while_surfaced_ends_as_unknown_water_not_as_an_empty_sea() -> None:
    guard = Guard(config())
    assert codes_at(guard, 60.0) == set()
    # 600 s of validity, then 2 km are closed at 16 m/s
    assert "guard.unknown_water" in codes_at(guard, 850.0)


def test_every_test_and_every_key_that_the_page_names_exists() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for name in set(re.findall(r"`(test_\w+\.py)`", page)):
        assert (Path(__file__).parent / name).exists(), name
    for section, key in set(re.findall(r"`(guard|contacts|vehicle|surfacing|autopilot|field)\.(\w+)`", page)):
        known = type(getattr(config(), section)).__struct_fields__
        assert key in known or f'"{section}.{key}"' in _sources(), f"{section}.{key}"


def _sources() -> str:
    rooms = (Path(__file__).parents[1] / "companion" / "planning" / "guard").glob("*.py")
    return "".join(path.read_text(encoding="utf-8") for path in rooms)
