"""README is the manual: what it lists is what there is."""

import re
from pathlib import Path

import msgspec
import pytest

from companion.cli import main
from companion.config import Config, load

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def keys() -> dict[str, object]:
    """Every configuration key and its default."""
    return {
        f"{section.name}.{key.name}": None if key.required else key.default
        for section in msgspec.structs.fields(Config)
        for key in msgspec.structs.fields(section.type)
    }


def shown(default: object) -> str:
    if default is None:
        return ""
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, str):
        return f'`"{default}"`'
    return "`[]`" if default == () else f"`{default}`"


def test_the_configuration_table_has_every_key_with_its_default() -> None:
    table = dict(re.findall(r"^\| `(\w+\.\w+)` \| (.*?) \|", README, re.MULTILINE))
    assert table == {key: shown(default) for key, default in keys().items()}


def test_the_example_configuration_is_valid() -> None:
    assert load(ROOT / "docs" / "crossing.toml").vehicle.cruise_depth_m == 45.0


def test_every_picture_and_page_it_names_exists() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target


@pytest.mark.parametrize("command", re.findall(r"^companion (\w+)", README, re.MULTILINE))
def test_every_command_it_names_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    assert "usage: companion" in capsys.readouterr().out
