"""The claim with a vehicle of another make, a planner of another malice, and starts beside a ship.

Nothing of the guard's own model, nor of the bundled vehicles', is used: a hull that yaws with inertia,
faster to port than to starboard, slips outward in a turn, speeds up and slows down at rates of its own,
and holds its place only by turning into the current.
"""

import math
from collections import deque
from collections.abc import Callable

import numpy as np
import pytest

from companion import reach
from companion.config import Config
from companion.instant import instant
from companion.messages import FloatArray, OwnState, Tracks
from companion.planning.guard import Guard, Velocity
from companion.planning.guard.margins import RAMP_S
from tests.builders import config, heartbeat, tracks

STEP_S, PERIOD_S = 0.1, 0.5
SETTINGS = config(
    timing={"rate_hz": 2.0, "setpoint_validity_s": 1.5},
    guard={"tracking_error_m": 4.0},  # what this vehicle keeps: the test holds that too
)
DELTA_M = SETTINGS.field.delta_m
NO_VELOCITY = (None, (math.nan, 0.0, 0.0), (1e9, -1e9, math.inf))
Planner = Callable[[float, OwnState, Tracks], Velocity | None]


class Unicycle:
    """Within what `settings` declare: turn rate, lag, current, delay and position error at their worst."""

    def __init__(self, settings: Config, rng: np.random.Generator, place_m: FloatArray) -> None:
        vehicle, guard = settings.vehicle, settings.guard
        self.place_m = place_m
        self._heading = float(rng.uniform(-math.pi, math.pi))
        self._yaw = self._ahead = self._aside = 0.0
        self._rate = {1: vehicle.max_turn_rate_radps, -1: vehicle.max_turn_rate_radps * rng.uniform(1.0, 1.6)}
        self._lag = vehicle.speed_lag_s * rng.uniform(0.5, 1.0, 2)  # to speed up, to slow down
        self._most = vehicle.max_speed_mps
        self._slip_s = float(rng.uniform(0.0, 0.8))
        self._current = polar(guard.current_mps, rng)
        self._off = polar(guard.own_position_error_m, rng)
        self._drift = polar(guard.own_position_drift_mps, rng)
        self._delay_s = guard.setpoint_delay_s
        self._told: deque[tuple[float, FloatArray]] = deque()
        self._command = np.zeros(2)

    def velocity(self) -> FloatArray:
        ahead = np.array((math.cos(self._heading), math.sin(self._heading)))
        return np.asarray(self._current + self._ahead * ahead + self._aside * ahead[::-1] * (-1, 1))

    def measured(self, t: float) -> OwnState:
        north, east = self.place_m + self._off + self._drift * t
        v_north, v_east = self.velocity()
        return OwnState(
            instant(t), float(north), float(east), 45.0, (float(v_north), float(v_east), 0.0), self._heading
        )

    def tell(self, t: float, velocity: Velocity) -> None:
        self._told.append((t + self._delay_s, np.array(velocity[:2])))

    def move(self, t: float) -> None:
        while self._told and self._told[0][0] <= t + 1e-9:
            self._command = self._told.popleft()[1]
        through = self._command - self._current  # its autopilot steers over ground
        speed = min(float(np.hypot(*through)), self._most)
        error = 0.0
        if speed > 0.02:
            error = math.remainder(math.atan2(through[1], through[0]) - self._heading, math.tau)
        turn = min(max(1.5 * error, -self._rate[-1]), self._rate[1])
        self._yaw += (turn - self._yaw) * STEP_S / 0.5
        self._heading += self._yaw * STEP_S
        wanted = speed * max(math.cos(error), 0.0)
        lag = self._lag[0 if wanted > self._ahead else 1]
        self._ahead += (wanted - self._ahead) * STEP_S / lag
        self._aside += (-self._slip_s * self._yaw * self._ahead - self._aside) * STEP_S / 0.8
        self.place_m = self.place_m + STEP_S * self.velocity()


def polar(length: float, rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(-math.pi, math.pi)
    return np.array((length * math.cos(angle), length * math.sin(angle)))


def toward_the_worst(rng: np.random.Generator) -> Planner:
    """The velocity after which it would be nearest to some set soon; sometimes the very opposite."""
    angles = np.linspace(0.0, math.tau, 16, endpoint=False)
    ways = np.column_stack((np.cos(angles), np.sin(angles)))

    def plan(t: float, own: OwnState, ships: Tracks) -> Velocity | None:
        if rng.random() < 0.05:
            return NO_VELOCITY[int(rng.integers(len(NO_VELOCITY)))]
        ahead_s = float(rng.choice((4.0, 12.0, 30.0)))
        places = own.position_m + ways * (2.5 * ahead_s)
        near, _ = reach.at(ships, instant(t), ahead_s).nearest_many(places)
        worst = ways[int(near.min(axis=1).argmin())]
        swing = rng.choice((1.0, 1.0, 1.0, -1.0)) * rng.choice((2.5, 2.5, 0.4, 6.0))
        return float(swing * worst[0]), float(swing * worst[1]), 0.0

    return plan


def sea(rng: np.random.Generator) -> Tracks:
    """A few ships that cross near the origin, of any course, size and noise, all heard at the start."""
    rows = []
    for _ in range(int(rng.integers(2, 6))):
        course, speed = float(rng.uniform(-math.pi, math.pi)), float(rng.choice((0.0, 3.0, 5.0, 9.0)))
        aside, along = rng.uniform(-150.0, 150.0), speed * rng.uniform(-30.0, 90.0)
        rows.append(
            {
                "north_m": -along * math.cos(course) - aside * math.sin(course),
                "east_m": -along * math.sin(course) + aside * math.cos(course),
                "cog_rad": course,
                "sog_mps": speed,
                "bow_m": float(rng.uniform(10.0, 120.0)),
                "stern_m": float(rng.uniform(5.0, 60.0)),
                "speed_noise_mps": float(rng.choice((0.05, 0.2))),
                "course_noise_rad": float(rng.choice((0.01, 0.03))),
                "position_error_m": float(rng.choice((0.0, 10.0))),
                "validity_s": 1500.0,
            }
        )
    return tracks(*rows)


def beside(ships: Tracks, rng: np.random.Generator, low_m: float, high_m: float) -> FloatArray:
    """A place that far from the nearest set."""
    sets = reach.at(ships, instant(0.0))
    while True:
        place = rng.uniform(-400.0, 400.0, 2)
        if low_m <= float(sets.nearest(place).distance_m.min()) <= high_m:
            return np.asarray(place)


def sail(seed: int, low_m: float, high_m: float, duration_s: float = 45.0) -> tuple[bool, bool, float, float]:
    """Whether there was a way out at the start, whether its lack was told; nearest set, worst tracking."""
    rng = np.random.default_rng((11, seed))
    ships = sea(rng)
    body = Unicycle(SETTINGS, rng, beside(ships, rng, low_m, high_m))
    guard, plan = Guard(SETTINGS), toward_the_worst(rng)
    viable, told, nearest, off = True, False, math.inf, 0.0
    for step in range(round(duration_s / PERIOD_S)):
        t = step * PERIOD_S
        own = body.measured(t)
        if guard._flown is not None:
            built_up = min((own.stamp - guard._flown.begin) * 1e-9 / RAMP_S, 1.0)
            off = max(off, guard._flown.deviation_m(own) * built_up)
        wanted = plan(t, own, ships) if step else (0.0, 0.0, 0.0)
        verdict = guard.check(own.stamp, own, heartbeat(t), ships, 1, wanted)
        viable &= verdict.way_out or step > 0
        told |= any(reason.code == "guard.no_way_out" for reason in verdict.reasons)
        assert verdict.velocity_ned_mps is not None
        body.tell(t, verdict.velocity_ned_mps)
        for k in range(round(PERIOD_S / STEP_S)):
            at = t + k * STEP_S
            nearest = min(nearest, float(reach.at(ships, instant(at)).nearest(body.place_m).distance_m.min()))
            body.move(at)
    return viable, told, nearest, off


@pytest.mark.parametrize(("low_m", "high_m"), [(DELTA_M + 0.2, DELTA_M + 15.0), (DELTA_M + 15.0, 120.0)])
def test_from_a_viable_start_another_vehicle_never_comes_within_delta(low_m: float, high_m: float) -> None:
    viable = 0
    for seed in range(8):
        is_viable, told, nearest_m, off_m = sail(seed, low_m, high_m)
        if is_viable:
            viable += 1
            assert nearest_m >= DELTA_M
            assert not told
            assert off_m <= SETTINGS.guard.tracking_error_m  # it is within what is declared
        else:
            assert told
    assert viable >= 3
