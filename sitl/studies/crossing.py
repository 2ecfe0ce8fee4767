"""Many crossings at once: m vehicles, each among its own ships, in one array each.

Nothing is heard on the way, so a planner's tables of ships stay as they are.  Trials that have arrived
leave the batch.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from companion.instant import Instant, instant
from companion.messages import BoolArray, FloatArray, Tracks
from sitl.studies.case import Crossing
from sitl.studies.closest import Paths
from sitl.studies.ships import Ships
from sitl.studies.vehicles import Integrator, Lag, Vehicles
from sitl.studies.wish import Planner

CROWDED = 0.8  # repack when fewer than this share of the vehicles is still under way


@dataclass(frozen=True, slots=True)
class Crossed:
    """What m vehicles did: their paths, whether they arrived (m,), when a ship last steered them (m,)."""

    paths: Paths
    arrived: BoolArray
    steered_s: FloatArray  # since the scenario's start; NaN: never


def cross(case: Crossing, ships: Ships, make: Callable[[Tracks, int], Planner]) -> Crossed:
    """Let every vehicle of the batch cross until it arrives or the time is up."""
    body = _body(case)
    steps = round(case.under_way_s / case.dt_s)
    m = ships.trials
    t_ns = np.array([instant(case.information_s + i * case.dt_s) for i in range(steps + 1)], dtype=np.int64)
    path = np.zeros((steps + 1, m, 2))
    last = np.full(m, steps)
    arrived, steered_s = np.zeros(m, dtype=np.bool_), np.full(m, np.nan)
    goal = np.array(case.goal_m)
    heading = float(np.arctan2(goal[1] - case.start_m[1], goal[0] - case.start_m[0]))
    batch = np.arange(m)  # the trials still computed
    vehicles = Vehicles.at_rest(m, case.start_m, heading)
    planner = make(ships.reported, m)
    velocity = np.zeros((m, 2))
    for step in range(steps + 1):
        path[step, batch] = vehicles.position_m
        to_goal_m = np.hypot(*(goal - vehicles.position_m).T)
        there = (to_goal_m <= case.goal_radius_m) & ~arrived[batch]
        last[batch[there]], arrived[batch[there]] = step, True
        under_way = ~arrived[batch]
        if not under_way.any() or step == steps:
            break
        if under_way.mean() < CROWDED:
            batch, planner = batch[under_way], planner.only(np.flatnonzero(under_way))
            vehicles, velocity = _those(vehicles, under_way), velocity[under_way]
        now = Instant(int(t_ns[step]))
        wish = planner.wish(now, vehicles.position_m, velocity)
        steered_s[batch[wish.steered & ~arrived[batch]]] = now * 1e-9
        moved = body.step(vehicles, wish.velocity_mps, case.dt_s)
        velocity = (moved.position_m - vehicles.position_m) / case.dt_s
        vehicles = moved
    return Crossed(Paths(t_ns, path, last), arrived, steered_s)


def _body(case: Crossing) -> Integrator | Lag:
    if case.readings.vehicle == "integrator":
        return Integrator(case.max_speed_mps)
    return Lag(case.max_speed_mps, case.max_turn_rate_radps, case.speed_lag_s)


def _those(vehicles: Vehicles, which: BoolArray) -> Vehicles:
    return replace(
        vehicles,
        position_m=vehicles.position_m[which],
        heading_rad=vehicles.heading_rad[which],
        speed_mps=vehicles.speed_mps[which],
    )
