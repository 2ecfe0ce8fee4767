"""Puts a sea together: from a scenario's own ships, or from a recorded log."""

import math

import numpy as np

from companion.errors import ConfigError
from companion.geodesy import MAX_RANGE_M, LocalFrame
from companion.instant import NS_PER_S, instant
from companion.messages import Hull
from sitl import lanes
from sitl.ais import representable_speed_mps
from sitl.autopilot import Autopilot
from sitl.boat import Boat
from sitl.logbook import Logbook
from sitl.profiles import PROFILES
from sitl.recorded import Recording
from sitl.rover import Rover
from sitl.scenario import Scenario
from sitl.sea import Finish, Sea, Traffic
from sitl.submarine import Submarine
from sitl.traffic import Fleet, Noise, Ship
from sitl.vehicle import Dynamics, KinematicBoat, KinematicSubmarine, Limits

Position = tuple[float, float]

_BOOT_S = -30.0  # the autopilot was switched on before the run
AFTER_LOG_S = 600.0
_FIRST_MMSI = 230_000_101


def scenario_sea(
    scenario: Scenario, *, seed: int = 1, start: Position | None = None, goal: Position | None = None
) -> Sea:
    """The scenario's channel with its convoys; `start` and `goal` are (latitude, longitude)."""
    channel = scenario.channel
    frame = LocalFrame(channel.latitude_deg, channel.longitude_deg)
    across = math.radians(channel.course_deg) + math.pi / 2
    half = channel.width_m / 2
    here = _at(across, -half - scenario.vehicle.before_m) if start is None else _local(frame, start, "start")
    there = _at(across, half + scenario.end.beyond_m) if goal is None else _local(frame, goal, "goal")
    rng = np.random.default_rng(seed)
    ships = scenario.ships
    fleet = Fleet(
        _convoys(scenario, rng),
        Noise(ships.noise, ships.speed_noise_mps, ships.course_noise_rad),
        rng,
        frame,
        utc_ns_at_zero=scenario.start_unix_s * NS_PER_S,
        begin=instant(-scenario.vehicle.receiver_on_s),
        end=instant(scenario.end.time_limit_s),
    )
    return _sea(
        scenario,
        fleet,
        frame,
        (here, there),
        utc_ns_at_zero=scenario.start_unix_s * NS_PER_S,
        gnss_on_bus=True,
    )


def recorded_sea(
    scenario: Scenario, log: Logbook, *, start: Position | None = None, goal: Position | None = None
) -> Sea:
    """A recorded log as the sea, with the scenario's vehicle.

    Without `start` or `goal` they come from the busiest lane (`sitl.lanes`).  The run may outlast the
    log by `AFTER_LOG_S`, to finish a crossing: the sets go on, the truth is not known any more.
    Raises `ConfigError` when no lane is found.
    """
    if start is None or goal is None:
        crossing = propose(scenario, log)
        start, goal = start or crossing.start_deg, goal or crossing.goal_deg
    frame = LocalFrame((start[0] + goal[0]) / 2, (start[1] + goal[1]) / 2)
    ends = _local(frame, start, "start"), _local(frame, goal, "goal")
    limited = min(log.duration_s + AFTER_LOG_S, scenario.end.time_limit_s)
    return _sea(
        scenario,
        Recording(log, frame),
        frame,
        ends,
        utc_ns_at_zero=log.utc_ns_at_zero,
        gnss_on_bus=False,
        time_limit_s=limited,
    )


def propose(scenario: Scenario, log: Logbook) -> lanes.Crossing:
    """A crossing of the log's busiest lane that the scenario's vehicle can finish within the log."""
    vehicle = scenario.companion.get("vehicle", {})
    rise_s = float(vehicle.get("cruise_depth_m", 0.0)) / scenario.vehicle.max_vertical_speed_mps
    return lanes.propose(
        log,
        speed_mps=scenario.vehicle.max_speed_mps,
        before_s=float(vehicle.get("listen_s", 60.0)),
        after_s=rise_s,
    )


def _sea(
    scenario: Scenario,
    traffic: Traffic,
    frame: LocalFrame,
    ends: tuple[Position, Position],
    *,
    utc_ns_at_zero: int,
    gnss_on_bus: bool,
    time_limit_s: float | None = None,
) -> Sea:
    (north, east), goal_m = ends
    vehicle, end = scenario.vehicle, scenario.end
    dynamics = _dynamics(scenario)
    heading = math.atan2(goal_m[1] - east, goal_m[0] - north)
    profile = PROFILES[vehicle.profile]
    if vehicle.mode and profile.mode(vehicle.mode) is None:
        modes = ", ".join(mode.name for mode in profile.modes)
        raise ConfigError(f"vehicle.mode = {vehicle.mode!r}: profile {profile.name} has {modes}")
    autopilot = Autopilot(
        profile,
        frame=frame,
        home_m=(north, east),
        utc_ns_at_zero=utc_ns_at_zero,
        boot=instant(_BOOT_S),
        armed=vehicle.armed,
        operator_mode=vehicle.mode or None,
    )
    limit = instant(end.time_limit_s if time_limit_s is None else time_limit_s)
    return Sea(
        frame=frame,
        traffic=traffic,
        dynamics=dynamics,
        start=dynamics.start(north, east, 0.0, heading),
        autopilot=autopilot,
        finish=Finish(goal_m, end.radius_m, end.surfaced_depth_m, limit),
        utc_ns_at_zero=utc_ns_at_zero,
        antenna_height_m=vehicle.antenna_height_m,
        receiver_on_s=vehicle.receiver_on_s,
        gnss_on_bus=gnss_on_bus,
    )


def _dynamics(scenario: Scenario) -> Dynamics:
    vehicle = scenario.vehicle
    limits = Limits(
        max_speed_mps=vehicle.max_speed_mps,
        max_vertical_speed_mps=vehicle.max_vertical_speed_mps,
        max_turn_rate_radps=vehicle.max_turn_rate_radps,
        speed_lag_s=vehicle.speed_lag_s,
    )
    if vehicle.profile == "rover":
        return Rover(limits)
    hulls: dict[tuple[bool, str], type[Boat | Submarine | KinematicBoat | KinematicSubmarine]]
    hulls = {
        (True, "physics"): Boat,
        (False, "physics"): Submarine,
        (True, "kinematic"): KinematicBoat,
        (False, "kinematic"): KinematicSubmarine,
    }
    return hulls[vehicle.profile == "boat", vehicle.model](
        limits, (vehicle.current_north_mps, vehicle.current_east_mps)
    )


def _convoys(scenario: Scenario, rng: np.random.Generator) -> tuple[Ship, ...]:
    channel, row = scenario.channel, scenario.ships
    course = math.radians(channel.course_deg)
    hull = Hull(
        bow_m=row.antenna_from_bow_m,
        stern_m=row.length_m - row.antenna_from_bow_m,
        port_m=row.beam_m - row.antenna_from_starboard_m,
        starboard_m=row.antenna_from_starboard_m,
    )
    speed = representable_speed_mps(row.speed_mps)
    ships: list[Ship] = []
    for lane, (name, offset_m) in enumerate(zip(("NEAR", "FAR"), channel.lanes_m, strict=True)):
        sails = course + (0.0 if channel.same_way else math.pi * (1 - lane))
        middle = _at(course + math.pi / 2, offset_m - channel.width_m / 2)
        shift = rng.uniform(-row.spread_m, row.spread_m)
        for k in range(row.per_lane):
            ahead = ((row.per_lane - 1) / 2 - k) * (row.length_m + row.gap_m)
            # the lane holds the hull's middle; a report tells where the antenna is
            along = ahead + shift - speed * row.meet_s + row.length_m / 2 - hull.bow_m
            aside = row.beam_m / 2 - hull.starboard_m
            ships.append(
                Ship(
                    mmsi=_FIRST_MMSI + len(ships),
                    name=f"{name} {k + 1}",
                    north_m=middle[0] + along * math.cos(sails) - aside * math.sin(sails),
                    east_m=middle[1] + along * math.sin(sails) + aside * math.cos(sails),
                    course_rad=sails,
                    speed_mps=speed,
                    hull=hull,
                    draught_m=row.draught_m,
                )
            )
    return tuple(ships)


def _at(direction_rad: float, distance_m: float) -> Position:
    return distance_m * math.cos(direction_rad), distance_m * math.sin(direction_rad)


def _local(frame: LocalFrame, position: Position, key: str) -> Position:
    north, east = frame.to_local(*position)
    if math.hypot(north, east) > MAX_RANGE_M:
        raise ConfigError(
            f"{key} = {position[0]:g},{position[1]:g} is {math.hypot(north, east) / 1000:.0f} km away "
            f"(at most {MAX_RANGE_M / 1000:.0f}): give a {key} near the ships"
        )
    return north, east
