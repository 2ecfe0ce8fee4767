"""Who may import whom: the arrows of the architecture, held against the code."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PURE = [
    "companion/wire",
    "companion/picture",
    "companion/reach",
    "companion/planning",
    "companion/planning/guard",
    "companion",
]
WORLD = {"time", "datetime", "random", "socket", "selectors", "threading", "asyncio", "serial", "can", "sitl"}


def imports(path: Path) -> set[str]:
    """Every module a file imports, absolute."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{name.name}" for name in node.names}
    return found


def within(name: str, package: str) -> bool:
    return name == package or name.startswith(package + ".")


def pure_files() -> list[Path]:
    edge = {"__main__.py", "replay.py", "config.py"}
    files = [f for folder in PURE for f in (ROOT / folder).glob("*.py")]
    return [f for f in files if f.name not in edge]


@pytest.mark.parametrize("path", pure_files(), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_pure_part_touches_no_clock_no_world_and_no_edge(path: Path) -> None:
    banned = {n for n in imports(path) for world in WORLD if within(n, world)}
    banned |= {n for n in imports(path) if within(n, "companion.edges")}
    assert not banned


def test_the_guard_knows_nothing_of_field_or_network() -> None:
    allowed = {
        "companion",
        "companion.config",
        "companion.instant",
        "companion.messages",
        "companion.geodesy",
        "companion.reach",
        "companion.planning.creep",
        "companion.planning.guard",
    }
    rooms = [*(ROOT / "companion/planning/guard").glob("*.py"), ROOT / "companion/planning/creep.py"]
    assert len(rooms) > 5
    for path in rooms:
        ours = {n for n in imports(path) if within(n, "companion")}
        strays = {n for n in ours if not any(within(n, room) for room in allowed - {"companion"})} - {
            "companion"
        }
        assert not strays


@pytest.mark.parametrize(
    ("library", "homes"),
    [
        ("torch", ("models/", "tests/")),
        ("onnxruntime", ("companion/planning/network.py", "models/", "tests/")),
        ("filterpy", ("companion/picture/", "tests/")),
        ("can", ("companion/edges/can_bus.py", "tests/")),
        ("pymavlink.mavutil", ("companion/edges/mavlink.py", "tests/")),
        ("mcap", ("companion/record/", "tests/")),
    ],
)
def test_a_library_has_one_home(library: str, homes: tuple[str, ...]) -> None:
    users = {
        str(path.relative_to(ROOT))
        for folder in ("companion", "sitl", "models", "tests")
        for path in (ROOT / folder).rglob("*.py")
        if any(within(name, library) for name in imports(path))
    }
    assert {user for user in users if not user.startswith(homes)} == set()


def test_nothing_the_board_runs_imports_sitl_or_models_code() -> None:
    for path in (ROOT / "companion").rglob("*.py"):
        if "cli" in path.parts:
            continue  # loads a sub-command only when it is called
        assert not {n for n in imports(path) if within(n, "sitl") or within(n, "torch")}, path
