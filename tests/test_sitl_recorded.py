"""Recorded logs as the sea: what is known of the ships, and where a crossing is proposed."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from companion.edges.files import read_candump
from companion.errors import ConfigError, LogError
from companion.geodesy import LocalFrame
from companion.instant import instant
from sitl import lanes, logbook
from sitl.launch import propose, recorded_sea
from sitl.logbook import Logbook
from sitl.recorded import Path as ShipPath
from sitl.recorded import Recording
from sitl.scenario import load

GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
LAKE = "n2k_ijsselmeer_20221130_native.candump.gz"
LOGS = [GULF, LAKE]


@cache
def log_of(folder: Path, name: str) -> Logbook:
    return logbook.read(folder / name)


@pytest.mark.parametrize(
    ("name", "own", "ships", "seconds"),
    [(GULF, 230035780, 93, 599.93), (LAKE, 244010225, 176, 179.87)],
)
def test_the_recording_ship_is_known_by_its_echo_and_is_no_traffic(
    shared_data: Path, name: str, own: int, ships: int, seconds: float
) -> None:
    log = log_of(shared_data, name)
    assert log.own_mmsi == own
    assert own not in {ship.mmsi for ship in log.ships}
    assert len(log.ships) >= ships
    assert log.duration_s == pytest.approx(seconds, abs=0.01)


def test_a_genuine_neighbour_on_the_same_course_stays_a_ship(shared_data: Path) -> None:
    assert 230008070 in {ship.mmsi for ship in log_of(shared_data, GULF).ships}  # S/Y ELEKTRA, 0.11 nm off


@pytest.mark.parametrize("name", LOGS)
def test_interpolated_ships_move_as_they_say_they_do(shared_data: Path, name: str) -> None:
    """Speeds over ground from positions against speeds reported: two paths to one number."""
    log = log_of(shared_data, name)
    checked = 0
    for ship in log.ships:
        if len(ship.t_s) < 8 or not np.nanmedian(ship.sog_mps) > 3.0:
            continue
        path = ShipPath(ship, LocalFrame(float(ship.latitude_deg[0]), float(ship.longitude_deg[0])))
        run = math.hypot(*(path.position_m[-1] - path.position_m[0])) / (ship.t_s[-1] - ship.t_s[0])
        assert run <= 1.1 * float(np.nanmax(ship.sog_mps)) + 0.2
        checked += 1
        if checked == 12:
            break
    assert checked >= 8


def test_a_ship_is_never_carried_far_beyond_its_reports(shared_data: Path) -> None:
    log = log_of(shared_data, GULF)
    sea = Recording(log, LocalFrame(59.72, 24.74))
    for t in (0.0, 100.0, 333.3, 599.0):
        known = set(sea.truth(instant(t)).mmsi.tolist())
        assert known
        for ship in log.ships:
            if ship.mmsi in known:
                assert ship.t_s[0] - 10.0 <= t <= ship.t_s[-1] + 10.0


@pytest.mark.parametrize("name", LOGS)
def test_every_frame_is_played_once_with_its_own_time(shared_data: Path, name: str) -> None:
    log = log_of(shared_data, name)
    sea = Recording(log, LocalFrame(59.72, 24.74))
    played = [f for k in range(6100) for f in sea.on_the_bus(instant(0.1 * k), instant(0.1 * (k + 1)))]
    recorded = list(read_candump(shared_data / name))
    assert len(played) == len(recorded)
    zero = min(frame.unix_ns for frame in recorded)
    assert sorted((f.unix_ns - zero, f.can_id, f.data) for f in recorded) == sorted(played)


def test_the_gulfs_busiest_lane_is_the_shipping_lane_and_not_the_yachts(shared_data: Path) -> None:
    log = log_of(shared_data, GULF)
    crossing = propose(load("uuv_crossing"), log)
    classes = {ship.mmsi: ship.class_a for ship in log.ships}
    assert crossing.ships
    assert all(classes[mmsi] for mmsi in crossing.ships)
    assert abs(math.sin(crossing.lane_course_rad)) > math.sin(math.radians(60.0))  # it runs east and west
    listen_s, rise_s = 60.0, 90.0
    assert listen_s + crossing.length_m / 2.5 + rise_s < log.duration_s


def test_the_lakes_barges_are_crossed_at_right_angles(shared_data: Path) -> None:
    log = log_of(shared_data, LAKE)
    crossing = lanes.propose(log, before_s=30.0, after_s=20.0)
    frame = LocalFrame(*crossing.start_deg)
    north, east = frame.to_local(*crossing.goal_deg)
    assert math.hypot(north, east) == pytest.approx(crossing.length_m, rel=1e-3)
    assert abs(math.cos(math.atan2(east, north) - crossing.lane_course_rad)) < 0.01
    courses = [np.nanmedian(s.cog_rad) for s in log.ships if s.mmsi in crossing.ships]
    assert courses
    assert all(abs(math.sin(c - crossing.lane_course_rad)) < math.sin(math.radians(30.0)) for c in courses)


def test_without_a_lane_the_error_asks_for_start_and_goal(shared_data: Path) -> None:
    log = log_of(shared_data, LAKE)
    with pytest.raises(ConfigError, match="--start and --goal"):
        lanes.propose(log, before_s=120.0, after_s=60.0)
    still = Logbook(log.frames, 600.0, 0, (), None, log.own_deg)
    with pytest.raises(ConfigError, match="--start and --goal"):
        lanes.propose(still)


def test_a_log_without_frames_or_without_a_file_is_an_error_with_a_remedy(tmp_path: Path) -> None:
    empty = tmp_path / "empty.candump"
    empty.write_text("nothing here\n")
    with pytest.raises(LogError, match="candump"):
        logbook.read(empty)
    with pytest.raises(LogError, match="candump"):
        logbook.read(tmp_path / "absent.candump")


def test_damaged_lines_and_frames_leave_the_rest_of_a_log_usable(shared_data: Path, tmp_path: Path) -> None:
    frames = [f for f, _ in zip(read_candump(shared_data / GULF), range(6000), strict=False)]
    rng = np.random.default_rng(1)
    lines = []
    for frame in frames:
        data = bytearray(frame.data)
        if data and rng.random() < 0.1:
            data[int(rng.integers(len(data)))] ^= int(rng.integers(1, 256))
        text = f"({frame.unix_ns / 1e9:.6f}) can0 {frame.can_id:08X}#{bytes(data).hex()}"
        lines.append(text if rng.random() > 0.02 else text[: int(rng.integers(len(text)))])
    damaged = tmp_path / "damaged.candump"
    damaged.write_text("\n".join(lines))
    log = logbook.read(damaged)
    sea = Recording(log, LocalFrame(59.72, 24.74))
    for t in range(0, 70, 5):
        truth = sea.truth(instant(float(t)))
        assert np.isfinite(truth.north_m).all()


def test_a_recorded_sea_keeps_the_logs_utc_and_its_time_limit(shared_data: Path) -> None:
    log = log_of(shared_data, GULF)
    sea = recorded_sea(load("uuv_crossing"), log)
    assert abs(log.utc_ns_at_zero - log.frames[0].unix_ns) < 1_000_000_000
    while sea.now < instant(2.0):
        heard = sea.advance(0.1)
        assert all(t <= sea.now for t, _, _ in heard.can)
    assert sea.finish.limit >= instant(log.duration_s)
    with pytest.raises(ConfigError, match="km away"):
        recorded_sea(load("uuv_crossing"), log, start=(59.7, 24.7), goal=(14.0, -60.0))
