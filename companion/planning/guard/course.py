"""A way out along a course of many velocities: what the planner intends, flown by the guard's own model.

Nothing of the intention is believed: a vehicle with the guard's model and speed is rolled out following it,
and that path, no other, is checked and flown.  Later the vehicle is not quite on it; then it is rolled out
leading back to it, and the rest is moved by what is still missing: a path from one place can be flown from
another.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.config import Vehicle
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray
from companion.planning.guard.beginning import Beginning
from companion.planning.guard.intended import Intended
from companion.planning.guard.rollout import Motion, moved
from companion.planning.guard.way_out import FOLLOW_PER_S, Orders, WayOut, stopped

STEP_S = 1.0  # of a whole course: as far apart as a run's points while it turns
JOIN_STEP_S = 0.5  # of what leads back to it
JOIN_LAGS = 4  # it leads back for so many lags of the speed and the time of half a circle, or as often again
JOINED_MPS = 0.1  # until the velocity is that of the course
FEWER, STRAIGHT_M = 4, 0.05  # so many steps are one where no point between is farther from straight

Path = tuple[FloatArray, FloatArray, FloatArray]  # times, north and east


@dataclass(frozen=True, slots=True)
class Rolled:
    """A vehicle rolled out on `orders`: where it is at `t_s` (N,) from now, and how it moves (N, 2)."""

    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    moving_mps: FloatArray
    orders: Orders


def following(
    now: Instant, first: Beginning, intended: Intended, longest_s: float, speed_mps: float, vehicle: Vehicle
) -> Rolled | None:
    """The vehicle after `first`, following what is intended for at most `longest_s`; None if that is over."""
    gone_s = elapsed_s(intended.begin, now)
    whole_s = min(float(intended.t_s[-1]) - gone_s - first.end_s, longest_s)
    if gone_s < 0 or whole_s < STEP_S:
        return None
    t = first.end_s + np.arange(0.0, whole_s, STEP_S)
    orders = Orders(intended.t_s, intended.velocity_mps)
    path = intended.t_s, intended.north_m, intended.east_m
    return _thinned(_follow(first.end, t, gone_s, path, orders, speed_mps, vehicle))


def joined(now: Instant, first: Beginning, stored: WayOut, speed_mps: float, vehicle: Vehicle) -> WayOut:
    """The stored course again, after `first`; to be asked only before it stops."""
    assert stored.orders is not None
    gone_s = elapsed_s(stored.begin, now)
    stop_s = stored.stop_s - gone_s
    path = stored.t_s, stored.north_m, stored.east_m
    join_s = math.pi / vehicle.max_turn_rate_radps + JOIN_LAGS * vehicle.speed_lag_s
    while True:
        end_s = min(first.end_s + join_s, stop_s)
        t = np.append(np.arange(first.end_s, end_s - 1e-6, JOIN_STEP_S), end_s)
        back = _follow(first.end, t, gone_s, path, stored.orders, speed_mps, vehicle)
        if end_s >= stop_s:
            return course_to(now, first, back, len(t) - 1, vehicle.speed_lag_s)
        north, east, north_mps, east_mps = _at(path, end_s + gone_s)
        if math.hypot(back.moving_mps[-1, 0] - north_mps, back.moving_mps[-1, 1] - east_mps) < JOINED_MPS:
            break
        join_s *= 2
    later, ordered = stored.t_s - gone_s > end_s, stored.orders.t_s - gone_s > end_s
    north, east = back.north_m[-1] - north, back.east_m[-1] - east  # still missing: for ever
    return WayOut(
        begin=now,
        t_s=np.concatenate((first.t_s, t, stored.t_s[later] - gone_s)),
        north_m=np.concatenate((first.north_m, back.north_m, stored.north_m[later] + north)),
        east_m=np.concatenate((first.east_m, back.east_m, stored.east_m[later] + east)),
        velocity_mps=_first(back),
        stop_s=stop_s,
        verified=True,
        orders=Orders(
            np.concatenate((t, stored.orders.t_s[ordered] - gone_s)),
            np.concatenate(
                (
                    back.orders.velocity_mps[:-1],
                    stored.orders.at(t[-1:] + gone_s),
                    stored.orders.velocity_mps[ordered],
                )
            ),
        ),
    )


def course_to(now: Instant, first: Beginning, rolled: Rolled, last: int, lag_s: float) -> WayOut:
    """A way out along what was rolled out, stopping at its point `last`; whether it is clear is not said."""
    t, north, east = stopped(
        rolled.t_s[: last + 1],
        rolled.north_m[: last + 1],
        rolled.east_m[: last + 1],
        math.atan2(rolled.moving_mps[last, 1], rolled.moving_mps[last, 0]),
        math.hypot(*rolled.moving_mps[last]),
        lag_s,
    )
    return WayOut(
        begin=now,
        t_s=np.concatenate((first.t_s, t)),
        north_m=np.concatenate((first.north_m, north)),
        east_m=np.concatenate((first.east_m, east)),
        velocity_mps=_first(rolled),
        stop_s=float(rolled.t_s[last]),
        verified=True,
        orders=rolled.orders,
    )


def _follow(
    start: Motion,
    t_s: FloatArray,
    gone_s: float,
    path: Path,
    orders: Orders,
    speed_mps: float,
    vehicle: Vehicle,
) -> Rolled:
    """Rolled out at `t_s` (N,) from now and commanded as a way out is; path and orders began `gone_s` ago."""
    north, east = (np.interp(t_s + gone_s, path[0], places) for places in path[1:])
    # the part of the command that the vehicle's place takes nothing from
    fixed_mps = (orders.at(t_s + gone_s) + FOLLOW_PER_S * np.column_stack((north, east))).tolist()
    steps_s = np.diff(t_s, append=t_s[-1]).tolist()
    m, rows = start, []
    for (north_mps, east_mps), step_s in zip(fixed_mps, steps_s, strict=True):
        v_north, v_east = north_mps - FOLLOW_PER_S * m.north_m, east_mps - FOLLOW_PER_S * m.east_m
        cut = min(speed_mps / max(math.hypot(v_north, v_east), 1e-9), 1.0)
        order = v_north * cut, v_east * cut
        rows.append((m.north_m, m.east_m, *m.velocity_mps, *order))
        m = moved(m, order, step_s, vehicle)
    columns = np.array(rows)
    return Rolled(t_s, columns[:, 0], columns[:, 1], columns[:, 2:4], Orders(t_s, columns[:, 4:]))


def _at(path: Path, t_s: float) -> tuple[float, float, float, float]:
    """North, east, and the velocity there."""
    around_s = np.array((t_s, t_s + JOIN_STEP_S))
    north, east = np.interp(around_s, path[0], path[1]), np.interp(around_s, path[0], path[2])
    return (
        float(north[0]),
        float(east[0]),
        float(north[1] - north[0]) / JOIN_STEP_S,
        float(east[1] - east[0]) / JOIN_STEP_S,
    )


def _thinned(rolled: Rolled) -> Rolled:
    """The same with fewer points: of steps as good as straight only the ends."""
    n = len(rolled.t_s)
    whole = (n - 1) // FEWER * FEWER
    values = np.stack((rolled.north_m, rolled.east_m))[:, : whole + 1]
    ends, share = values[:, ::FEWER], np.arange(FEWER) / FEWER
    straight = ends[:, :-1, None] * (1 - share) + ends[:, 1:, None] * share
    bent = np.abs(values[:, :whole].reshape(2, -1, FEWER) - straight).max(axis=(0, 2)) > STRAIGHT_M
    keep = np.ones(n, dtype=np.bool_)
    keep[:whole] = (bent[:, None] | (np.arange(FEWER) == 0)).ravel()
    return replace(
        rolled,
        t_s=rolled.t_s[keep],
        north_m=rolled.north_m[keep],
        east_m=rolled.east_m[keep],
        moving_mps=rolled.moving_mps[keep],
    )


def _first(rolled: Rolled) -> tuple[float, float]:
    """The first order: where the vehicle means to turn to."""
    north, east = rolled.orders.velocity_mps[0]
    return float(north), float(east)
