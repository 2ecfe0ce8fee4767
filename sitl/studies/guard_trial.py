"""One hostile trial: a planner that means harm, a vehicle that is as bad as declared, and the guard between.

No bytes here: the guard is asked directly, thousands of times faster than through the whole companion.
"""

import math
from collections import deque
from collections.abc import Callable
from typing import Literal

import numpy as np
from msgspec import Struct

from companion import reach
from companion.config import Config
from companion.instant import Instant, instant
from companion.messages import AutopilotHeartbeat, FloatArray, OwnState, Tracks
from companion.planning.guard import Guard, Velocity, Verdict
from companion.reach.kernel import Kernel, nearest
from sitl.closest import to_hulls
from sitl.studies.lanes_picture import Lanes
from sitl.vehicle import (
    Demand,
    Dynamics,
    KinematicBoat,
    KinematicSubmarine,
    Limits,
    VehicleState,
)

PLANNERS: tuple["PlannerKind", ...] = ("random", "adversarial", "frozen", "bow", "nan", "silent")
PlannerKind = Literal["random", "adversarial", "frozen", "bow", "nan", "silent"]
SIM_S = 0.1
FAR_M = 9999.0
NEAR_M = 15.0  # nearer than this every simulated step is measured, else every step of the guard

Planner = Callable[[float, OwnState, Tracks, Instant], Velocity | None]
Ask = Callable[[Instant, OwnState, AutopilotHeartbeat, Tracks, Velocity | None], Verdict]


class Outcome(Struct, frozen=True):
    """What came of a trial; distances are of the true position, metres, `FAR_M` where none was near."""

    closest_set_m: float
    closest_hull_m: float
    steps: int
    changed: int
    no_way_out: int
    viable: bool


def asking(config: Config, kernel: Kernel = nearest) -> Ask:
    """The project's guard as something to ask."""
    guard = Guard(config, kernel)
    return lambda now, own, beat, tracks, wanted: guard.check(now, own, beat, tracks, 1, wanted)


def unguarded(
    now: Instant,  # noqa: ARG001 - asked like the guard
    own: OwnState,  # noqa: ARG001
    heartbeat: AutopilotHeartbeat,  # noqa: ARG001
    tracks: Tracks,  # noqa: ARG001
    wanted: Velocity | None,
) -> Verdict:
    """No guard: what is wanted is flown, and what is no velocity is none."""
    flown = wanted if wanted is not None and all(map(math.isfinite, wanted)) else (0.0, 0.0, 0.0)
    return Verdict(flown, False, ())


def run_trial(
    config: Config, lanes: Lanes, planner: PlannerKind, rng: np.random.Generator, ask: Ask, duration_s: float
) -> Outcome:
    """Fly one trial; a start from which the guard finds no way out is not viable and ends it at once."""
    vehicle = BadVehicle(config, rng, lanes.start_m(rng))
    plan = _planner(planner, rng, config.vehicle.max_speed_mps)
    period_s = 1.0 / config.timing.rate_hz
    closest_set = closest_hull = FAR_M
    changed = lost = 0
    steps = round(duration_s / period_s)
    sets_m = math.inf
    for step in range(steps):
        t = step * period_s
        now = instant(t)
        tracks = lanes.tracks(t)
        own = vehicle.measured(now)
        beat = AutopilotHeartbeat(now, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
        wanted = plan(t, own, tracks, now) if step else (0.0, 0.0, 0.0)
        verdict = ask(now, own, beat, tracks, wanted)
        if not step and not viable(config, vehicle, tracks):
            return Outcome(FAR_M, FAR_M, 0, 0, 0, viable=False)
        changed += verdict.changed
        lost += not verdict.way_out
        assert verdict.velocity_ned_mps is not None
        vehicle.send(t, verdict.velocity_ned_mps)
        for k in range(round(period_s / SIM_S)):
            if sets_m < NEAR_M or k == 0:
                at = instant(t + k * SIM_S)
                here = vehicle.true_m
                sets_m = float(reach.at(tracks, at).nearest(here).distance_m.min())
                closest_set = min(closest_set, sets_m)
                if sets_m < NEAR_M:
                    closest_hull = min(closest_hull, float(to_hulls(lanes.truth(t + k * SIM_S), here).min()))
            vehicle.move(t + k * SIM_S)
    return Outcome(closest_set, closest_hull, steps, changed, lost, viable=True)


def viable(config: Config, vehicle: "BadVehicle", tracks: Tracks) -> bool:
    """Whether the guard finds a way out from the start: the same starts for whatever is compared."""
    own = vehicle.measured(instant(0.0))
    beat = AutopilotHeartbeat(own.stamp, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
    return Guard(config).check(own.stamp, own, beat, tracks, 1, (0.0, 0.0, 0.0)).way_out


class BadVehicle:
    """The bundled vehicle at the edge of what the configuration declares.

    A constant current of the declared size, a constant delay up to the declared one, and a position
    that is off by all that is declared, in one direction for ever.
    """

    def __init__(self, config: Config, rng: np.random.Generator, start_m: FloatArray) -> None:
        guard, vehicle = config.guard, config.vehicle
        drift = _polar(guard.current_mps, rng)
        limits = Limits(
            vehicle.max_speed_mps,
            vehicle.max_vertical_speed_mps,
            vehicle.max_turn_rate_radps,
            vehicle.speed_lag_s,
        )
        hull = KinematicBoat if vehicle.cruise_depth_m == 0 else KinematicSubmarine
        self._dynamics: Dynamics = hull(limits, (float(drift[0]), float(drift[1])))
        self._state: VehicleState = self._dynamics.start(
            float(start_m[0]),
            float(start_m[1]),
            vehicle.cruise_depth_m,
            float(rng.uniform(-math.pi, math.pi)),
        )
        self._delay_s = float(rng.uniform(0.0, guard.setpoint_delay_s)) if guard.setpoint_delay_s else 0.0
        self._off = _polar(1.0, rng)
        self._error_m = guard.own_position_error_m
        self._error_mps = guard.own_position_drift_mps if vehicle.cruise_depth_m > 0 else 0.0
        self._queue: deque[tuple[float, Velocity]] = deque()
        self._flown: Velocity = (0.0, 0.0, 0.0)

    @property
    def true_m(self) -> FloatArray:
        """(2,) where it is."""
        return np.array((self._state.north_m, self._state.east_m))

    def measured(self, now: Instant) -> OwnState:
        """Where it believes to be."""
        state = self._state
        off = self._off * (self._error_m + self._error_mps * now * 1e-9)
        return OwnState(
            now,
            state.north_m + float(off[0]),
            state.east_m + float(off[1]),
            state.depth_m,
            state.velocity_ned_mps,
            state.heading_rad,
        )

    def send(self, t: float, velocity: Velocity) -> None:
        """A setpoint that takes effect after the delay."""
        self._queue.append((t + self._delay_s, velocity))

    def move(self, t: float) -> None:
        """One simulated step from `t` on."""
        while self._queue and self._queue[0][0] <= t + 1e-9:
            self._flown = self._queue.popleft()[1]
        self._state = self._dynamics.step(self._state, Demand(self._flown), SIM_S)


def _planner(kind: PlannerKind, rng: np.random.Generator, speed: float) -> Planner:
    """A planner that means harm, or none."""
    fixed = _polar(speed, rng)
    held: dict[str, FloatArray] = {"v": fixed}

    def random(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        if rng.random() < 0.1:
            held["v"] = _polar(speed * rng.choice((0.0, 0.5, 1.0, 4.0)), rng)
        return (float(held["v"][0]), float(held["v"][1]), 0.0)

    def adversarial(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        near = reach.at(tracks, now, 10.0).nearest(own.position_m)
        k = int(near.distance_m.argmin())
        return (float(-speed * near.away[k, 0]), float(-speed * near.away[k, 1]), 0.0)

    def bow(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:  # noqa: ARG001
        north, east = _meeting(own, tracks, now, speed)
        away = math.hypot(north - own.north_m, east - own.east_m) or 1.0
        return (speed * (north - own.north_m) / away, speed * (east - own.east_m) / away, 0.0)

    def broken(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity | None:
        wild = rng.choice((math.nan, math.inf, -math.inf))
        return (float(wild), 1.0, 0.0) if rng.random() < 0.7 else adversarial(t, own, tracks, now)

    def silent(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity | None:
        return adversarial(t, own, tracks, now) if t < 60.0 else None

    def frozen(t: float, own: OwnState, tracks: Tracks, now: Instant) -> Velocity:
        if t < 1.0:
            held["v"] = np.array(bow(t, own, tracks, now)[:2])
        return (float(held["v"][0]), float(held["v"][1]), 0.0)

    return {
        "random": random,
        "adversarial": adversarial,
        "frozen": frozen,
        "bow": bow,
        "nan": broken,
        "silent": silent,
    }[kind]


def _meeting(own: OwnState, tracks: Tracks, now: Instant, speed: float) -> tuple[float, float]:
    """Where the nearest oncoming bow can be met."""
    age = tracks.age_s(now)
    ahead = age * tracks.sog_mps + tracks.bow_m
    north = tracks.north_m + ahead * np.cos(tracks.cog_rad) - own.north_m
    east = tracks.east_m + ahead * np.sin(tracks.cog_rad) - own.east_m
    v_north, v_east = tracks.sog_mps * np.cos(tracks.cog_rad), tracks.sog_mps * np.sin(tracks.cog_rad)
    t = np.arange(0.0, 240.0, 4.0)[:, None]
    late = np.hypot(north + v_north * t, east + v_east * t) - speed * t
    met = np.where(late < 0, t, np.inf).min(axis=0)
    k = int(met.argmin())
    at = float(met[k]) if math.isfinite(met[k]) else 60.0
    return own.north_m + float(north[k] + v_north[k] * at), own.east_m + float(east[k] + v_east[k] * at)


def _polar(length: float, rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(-math.pi, math.pi)
    return np.array((length * math.cos(angle), length * math.sin(angle)))
