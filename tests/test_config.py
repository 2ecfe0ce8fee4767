import math
from pathlib import Path

import pytest

from companion.config import from_mapping, load, to_mapping
from companion.errors import ConfigError
from tests.builders import GOAL, config


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({}, "goal"),
        ({"goal": {**GOAL, "latitude_deg": 91.0}}, "goal.latitude_deg"),
        ({"goal": {**GOAL, "latitude_deg": math.nan}}, "latitude_deg"),
        ({"goal": {**GOAL, "radius_m": math.inf}}, "goal.radius_m"),
        ({"goal": {**GOAL, "radius_m": -1.0}}, "goal.radius_m"),
        ({"goal": GOAL, "vehicle": {"max_speed_mps": math.nan}}, "max_speed_mps"),
        ({"goal": GOAL, "vehicle": {"max_spede_mps": 2.0}}, "max_spede_mps"),
        ({"goal": GOAL, "vehicle": {"max_speed_mps": "fast"}}, "vehicle.max_speed_mps"),
        ({"goal": GOAL, "vehicle": {"cruise_depth_m": 90.0}}, "vehicle.max_depth_m"),
        ({"goal": GOAL, "timing": {"setpoint_validity_s": 0.05}}, "timing.setpoint_validity_s"),
        ({"goal": GOAL, "timing": {"rate_hz": 1e9}}, "timing.rate_hz"),
        ({"goal": GOAL, "field": {"attraction": "strong"}}, "field.attraction"),
        ({"goal": GOAL, "nonsense": {}}, "nonsense"),
        ({"goal": GOAL, "contacts": {"course_noise_rad": 2.0}}, "contacts.course_noise_rad"),
        ({"goal": GOAL, "surfacing": {"every_s": 250.0}}, "surfacing.every_s"),
        ({"goal": 3}, "goal"),
    ],
)
def test_a_bad_value_is_refused_by_the_name_of_its_key(tables: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words.replace(".", r"\.")):
        from_mapping(tables)


def test_a_configuration_survives_the_way_through_the_log() -> None:
    first = config(contacts={"speed_noise_mps": 0.05})
    assert from_mapping(to_mapping(first)) == first


def test_a_missing_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="existing TOML file"):
        load(tmp_path / "none.toml")


@pytest.mark.parametrize("content", [b"goal = [", b"\xff\xfe\x00", b"= 3"])
def test_a_file_that_is_no_toml_is_a_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match="not TOML"):
        load(path)


def test_options_lie_over_the_file(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text("[goal]\nlatitude_deg = 1.0\nlongitude_deg = 2.0\n[vehicle]\nmax_speed_mps = 1.5\n")
    merged = load(path, {"goal": {"latitude_deg": 3.0}})
    assert (merged.goal.latitude_deg, merged.goal.longitude_deg) == (3.0, 2.0)
    assert merged.vehicle.max_speed_mps == 1.5
