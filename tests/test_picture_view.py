"""What `companion picture` shows: age states, closest approach at one common time, sizes; the command."""

import argparse
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion import reach
from companion.edges import lookout
from companion.errors import ConfigError
from companion.instant import instant
from companion.messages import Model
from companion.picture.ageing import AgeState, age_state
from companion.picture.closest import approaches
from companion.picture.view import DIRECTIONS, areas_m2, lines
from tests.builders import tracks as rows
from tests.contact_reports import FRAME, own, picture, report, tracks

GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
HOUSTON = "ais_houston_ship_channel_20200101_1500-1700Z.csv.gz"


@pytest.mark.parametrize(
    ("age", "sog", "state"),
    [
        (5.0, 5.0, AgeState.FRESH),
        (90.0, 5.0, AgeState.COASTING),
        (200.0, 0.1, AgeState.FRESH),
        (450.0, 5.0, AgeState.STALE),
        (601.0, 5.0, AgeState.UNBOUNDED),
        (601.0, 0.0, AgeState.UNBOUNDED),
    ],
)
def test_an_age_has_its_state(age: float, sog: float, state: AgeState) -> None:
    assert age_state(age, 600.0, sog) is state


@given(st.floats(0, 700), st.floats(0, 700), st.floats(0, 20))
def test_states_only_get_worse_with_age(one: float, other: float, sog: float) -> None:
    order = list(AgeState)
    young, old = sorted((one, other))
    assert order.index(age_state(young, 600.0, sog)) <= order.index(age_state(old, 600.0, sog))


def test_the_unbounded_state_closes_water_instead_of_opening_it() -> None:
    heard = picture(report(0.0))
    areas = [
        lines(heard, tracks(heard, t), instant(t), own(t), FRAME)[0].area_km2 for t in (500.0, 601.0, 900.0)
    ]
    assert areas == sorted(areas)
    assert areas[2] > 20 * areas[0]


def test_closest_approach_brings_both_ships_to_one_time() -> None:
    """A ship heard 100 s ago crosses 600 m ahead of us; we were last heard of 10 s ago."""
    ship = rows({"north_m": 1000.0, "east_m": -2000.0, "cog_rad": math.pi / 2, "sog_mps": 10.0})
    found = approaches(ship, instant(100.0), instant(90.0), np.array((-20.0, 0.0)), np.array((2.0, 0.0)))
    assert found.range_m[0] == pytest.approx(math.hypot(1000.0, 1000.0))
    best = min((math.hypot(1000.0 - 2.0 * t, -1000.0 + 10.0 * t), t) for t in np.arange(0.0, 200.0, 0.01))
    assert found.cpa_m[0] == pytest.approx(best[0], abs=0.05)
    assert found.tcpa_s[0] == pytest.approx(best[1], abs=0.05)


def test_a_ship_that_has_passed_is_as_near_as_it_is_now() -> None:
    ship = rows({"north_m": 500.0, "east_m": 0.0, "cog_rad": 0.0, "sog_mps": 5.0})
    found = approaches(ship, instant(0.0), instant(0.0), np.zeros(2), np.zeros(2))
    assert found.tcpa_s[0] < 0
    assert found.cpa_m[0] == pytest.approx(500.0)


def test_the_area_is_that_of_the_set() -> None:
    """A disc has a formula; a hull with its position error against the outline's shoelace."""
    disc = rows({"model": int(Model.DISC), "disc_speed_mps": 1.0})
    angles = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    for table in (disc, rows({"cog_rad": 0.3})):
        sets = reach.at(table, instant(60.0))
        (area,) = areas_m2(sets.support(directions))
        x, y = sets.outline(0).T
        shoelace = 0.5 * abs(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))
        assert area == pytest.approx(shoelace, rel=0.03)  # a tangent polygon cuts no corner
        assert area >= shoelace * 0.999


def command(source: Path | str, chart: Path, **more: object) -> argparse.Namespace:
    values = {
        "own": None,
        "bounds": "",
        "at": None,
        "silence": 0.0,
        "most": 5,
        "speedup": 1.0,
        "chart": chart,
    }
    return argparse.Namespace(source=[str(source)], **{**values, **more})


def test_the_command_lists_and_draws_a_recorded_bus(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    options = command(shared_data / GULF, tmp_path / "c.png", silence=350.0, most=90)
    assert lookout.run(options) == 0
    said = capsys.readouterr().out
    assert "ELEKTRA" in said
    assert "stale" in said
    assert "own position from NMEA2000" in said
    assert (tmp_path / "c.png").stat().st_size > 20_000


@pytest.mark.parametrize("columns", [80, 120])
def test_a_narrow_terminal_loses_columns_and_not_letters(
    columns: int,
    shared_data: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    assert lookout.run(command(shared_data / GULF, tmp_path / "c.png", at=120.0)) == 0
    said = capsys.readouterr().out
    assert "…" not in said
    for kept in ("MMSI", "state", "CPA nm", "TCPA min", "to set nm", "set km2", "source"):
        assert kept in said


def test_every_number_heard_is_accounted_for(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The yacht that recorded the log is one of the 95 with positions."""
    assert lookout.run(command(shared_data / GULF, tmp_path / "c.png")) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "3094 reports of ships, 96 numbers: 94 listed, 1 out of reach (beyond 54 nm) or ourselves" in said
    assert "1 that never told a position" in said


def test_a_log_without_own_position_is_shown_around_its_middle_and_says_so(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert lookout.run(command(shared_data / HOUSTON, tmp_path / "h.png", at=600.0)) == 0
    assert "own position UNKNOWN" in capsys.readouterr().out


def test_a_missing_file_is_no_link() -> None:
    with pytest.raises(ConfigError, match="no such file, and no link"):
        lookout.run(command("nowhere.log", Path("x.png")))


def test_only_the_operator_ends_a_contact() -> None:
    heard = picture(report(0.0), report(0.0, mmsi=230_000_002))
    assert len(tracks(heard, 100_000.0)) == 2
    assert heard.end(230_000_002)
    assert not heard.end(230_000_002)
    assert list(tracks(heard, 100_000.0).mmsi) == [230_000_001]
    assert heard.counts["picture.ended_by_operator"] == 1
