"""The bundled world as a whole: geometry of the scenarios, the antenna, determinism, lock-step."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion import config, reach
from companion.build import build
from companion.errors import ConfigError
from companion.instant import Instant, instant
from companion.messages import Link
from sitl.launch import scenario_sea
from sitl.lockstep import LockstepSea
from sitl.scenario import End, load, names
from sitl.sea import Sea


def setpoint(velocity: tuple[float, float, float]) -> bytes:
    link = mav.MAVLink(None, srcSystem=1, srcComponent=196)
    zeros = (0.0,) * 5
    message = mav.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, 0x0DC7, 0.0, 0.0, 0.0, *velocity, *zeros
    )
    return bytes(message.pack(link))


def towards_goal(sea: Sea, depth_m: float, listen_s: float = 5.0) -> tuple[float, float, float]:
    """A pilot who knows the truth: straight to the goal at a depth, up at the end."""
    if sea.now < instant(listen_s):
        return (0.0, 0.0, 0.0)
    north, east = sea.finish.goal_m[0] - sea.state.north_m, sea.finish.goal_m[1] - sea.state.east_m
    left = math.hypot(north, east)
    speed = min(2.5, 0.2 * left)
    wanted = 0.0 if left < 12.0 else depth_m
    climb = min(max(0.5 * (wanted - sea.state.depth_m), -0.5), 0.5)
    return (north / left * speed, east / left * speed, climb)


def test_the_papers_scenario_has_the_papers_geometry() -> None:
    sea = scenario_sea(load("uuv_crossing"))
    assert (sea.state.north_m, sea.state.east_m) == pytest.approx((0.0, -615.0))
    assert sea.finish.goal_m == pytest.approx((0.0, 615.0))
    truth = sea.truth(instant(0.0))
    assert len(truth) == 10
    for lane, (east, heading) in enumerate([(-57.5, math.pi), (57.5, 0.0)]):
        rows = slice(5 * lane, 5 * lane + 5)
        starboard = np.array((-math.sin(heading), math.cos(heading)))
        middle = truth.east_m[rows] + starboard[1] * (truth.starboard_m[rows] - truth.port_m[rows]) / 2
        assert middle == pytest.approx(east, abs=1e-9)
        bow_to_bow = np.abs(np.diff(truth.north_m[rows]))
        assert bow_to_bow == pytest.approx(450.0)
        assert np.cos(truth.heading_rad[rows] - heading) == pytest.approx(1.0, abs=1e-4)
    assert truth.bow_m + truth.stern_m == pytest.approx(75.0)
    assert truth.port_m + truth.starboard_m == pytest.approx(25.0)


@pytest.mark.parametrize("seed", range(6))
def test_both_convoys_pass_the_crossing_line_around_the_meeting_time(seed: int) -> None:
    sea = scenario_sea(load("uuv_crossing"), seed=seed)
    truth = sea.truth(instant(300.0))
    for rows in (slice(0, 5), slice(5, 10)):
        assert truth.north_m[rows].min() < 0.0 < truth.north_m[rows].max()


@pytest.mark.parametrize("name", names())
def test_every_bundled_scenario_starts_and_configures_the_companion(name: str) -> None:
    scenario = load(name)
    sea = scenario_sea(scenario)
    made = config.from_mapping(scenario.companion_tables(sea.goal_deg))
    assert made.goal.latitude_deg == pytest.approx(sea.goal_deg[0])
    if scenario.ships.per_lane:
        assert made.contacts.speed_noise_mps >= scenario.ships.speed_noise_mps
    assert sea.advance(0.1).mavlink


def test_a_wrong_scenario_is_an_error_that_names_the_key_or_the_choice(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="uuv_crossing"):
        load("no_such_scenario")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('title = "x"\n[channel]\nlatitude_deg = 91.0\nlongitude_deg = 0.0\n')
    with pytest.raises(ConfigError, match="latitude_deg"):
        load(str(wrong))


def test_under_water_the_bus_is_silent_and_no_report_reaches_the_autopilot() -> None:
    sea = scenario_sea(load("uuv_crossing"))
    ask = mav.MAVLink_command_long_message(1, 1, 511, 0, 301.0, 2e5, 0, 0, 0, 0, 0)
    sea.receive(bytes(ask.pack(mav.MAVLink(None, srcSystem=1, srcComponent=196))))
    dry = wet = 0
    newest: dict[int, int] = {}
    for k in range(900):
        sea.receive(setpoint((0.0, 0.0, 0.5 if k > 300 else 0.0)))
        heard = sea.advance(0.1)
        if sea.antenna_is_dry:
            dry += len(heard.can)
        else:
            wet += len(heard.can)
            for message in mav.MAVLink(None).parse_buffer(heard.mavlink) or []:
                if message.get_type() == "AIS_VESSEL":
                    newest[message.MMSI] = message.tslc
    assert sea.state.depth_m > 15.0
    assert dry > 300  # 10 ships, 30 s, 5 frames a report, and the clock
    assert wet == 0
    assert len(newest) == 10  # the autopilot repeats what it knows, and it only gets older
    assert min(newest.values()) >= 30


def fly(seed: int, name: str, depth_m: float, ticks: int = 20_000) -> tuple[list[bytes], LockstepSea]:
    lockstep = LockstepSea(scenario_sea(load(name), seed=seed), dt_s=0.1)
    out = []
    for tick, _ in zip(lockstep, range(ticks), strict=False):
        out += [frame.can_id.to_bytes(4, "big") + frame.data for frame in tick.frames]
        lockstep.send(tick.t, setpoint(towards_goal(lockstep.sea, depth_m)), None)
    return out, lockstep


def test_in_lockstep_the_same_seed_gives_the_same_bytes() -> None:
    first = fly(3, "uuv_crossing", 2.0, ticks=300)[0]
    assert first == fly(3, "uuv_crossing", 2.0, ticks=300)[0]
    assert first != fly(4, "uuv_crossing", 2.0, ticks=300)[0]


@pytest.mark.parametrize(("name", "depth_m"), [("uuv_crossing", 6.0), ("boat_crossing", 0.0)])
def test_a_vehicle_that_is_steered_to_the_goal_arrives_and_ends_the_run(name: str, depth_m: float) -> None:
    sea = fly(3, name, depth_m)[1].sea
    assert sea.arrived
    assert not sea.timed_out


def test_ticks_rise_by_the_period_and_can_frames_carry_their_own_time_within_the_tick() -> None:
    lockstep = LockstepSea(scenario_sea(load("uuv_crossing")), dt_s=0.1)
    before = Instant(0)
    for tick, _ in zip(lockstep, range(300), strict=False):
        assert tick.t - before == 100_000_000
        for frame in tick.frames:
            assert before < frame.stamp <= tick.t
            assert frame.link is Link.CAN or frame.stamp == tick.t
        before = tick.t


def test_an_expired_setpoint_never_reaches_the_autopilot() -> None:
    lockstep = LockstepSea(scenario_sea(load("uuv_crossing")))
    ticks = iter(lockstep)
    tick = next(ticks)
    lockstep.send(tick.t, setpoint((1.0, 0.0, 0.0)), Instant(tick.t - 1))
    assert lockstep.counts == {"sink.expired": 1}
    lockstep.send(tick.t, setpoint((1.0, 0.0, 0.0)), tick.t)
    next(ticks)
    assert lockstep.sea.autopilot.counts["setpoint.taken"] == 1


def test_without_setpoints_the_run_ends_at_the_time_limit_where_it_began() -> None:
    sea = scenario_sea(msgspec.structs.replace(load("uuv_crossing"), end=End(time_limit_s=60.0)))
    while not sea.timed_out:
        sea.advance(1.0)
    assert sea.timed_out
    assert not sea.arrived
    assert sea.to_goal_m == pytest.approx(1230.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_the_companion_hears_in_a_minute_bounds_every_true_hull_for_the_next_nine(seed: int) -> None:
    scenario = load("uuv_crossing")
    sea = scenario_sea(scenario, seed=seed)
    tables = scenario.companion_tables(sea.goal_deg, {"repulsion": {"kind": "exact"}})
    companion = build(config.from_mapping(tables))
    lockstep = LockstepSea(sea)
    for tick in lockstep:
        decision = companion.core.step(tick)
        companion.encoder.system_id = companion.core.system_id
        for out in decision.outgoing:
            lockstep.send(tick.t, companion.encoder.encode(out), None)
        if tick.t >= instant(59.0):
            break
    assert len(decision.tracks) == 10
    assert companion.core.frame is not None
    for t in map(instant, range(60, 601, 60)):
        sets, truth = reach.at(decision.tracks, t), sea.truth(t)
        assert np.array_equal(truth.mmsi, decision.tracks.mmsi)
        for ahead in (truth.bow_m, -truth.stern_m):
            for aside in (truth.starboard_m, -truth.port_m):
                cos, sin = np.cos(truth.heading_rad), np.sin(truth.heading_rad)
                north = truth.north_m + ahead * cos - aside * sin
                east = truth.east_m + ahead * sin + aside * cos
                for i in range(len(truth)):
                    corner = companion.core.frame.to_local(*sea.frame.to_geodetic(north[i], east[i]))
                    assert sets.nearest(np.array(corner)).distance_m[i] <= 0.0
