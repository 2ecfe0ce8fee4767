"""Looks for a verified way out: many headings and speeds rolled out at once, each with places to stop."""

import math
from dataclasses import dataclass

import numpy as np

from companion.config import Vehicle
from companion.instant import Instant
from companion.messages import FloatArray
from companion.planning.guard.clearance import Clearance, Paths
from companion.planning.guard.rollout import Motion, Runner
from companion.planning.guard.way_out import WayOut, stopped

HEADINGS = 16
SLOW_HEADINGS = 8
SLOWER = 0.5  # the second speed tried, a share of the first
STOPS_S = (8.0, 15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 300.0)
TURN_COST_S = 60.0  # a way out against the wanted direction counts as this much longer
TRIES = 3  # best candidates verified to the end


@dataclass(frozen=True, slots=True)
class Beginning:
    """What is flown before a way out begins: times, north and east (P,), and the motion at its end."""

    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    end_s: float
    end: Motion


class Search:
    """Finds ways out for one vehicle; `speed_mps` is what it makes good in any declared current."""

    def __init__(self, vehicle: Vehicle, speed_mps: float, length_s: float) -> None:
        self._lag_s = vehicle.speed_lag_s
        self._speed = speed_mps
        self._runner = Runner(vehicle, length_s)
        stops = [s for s in STOPS_S if s < length_s] + [length_s]
        self._stops = np.unique(np.searchsorted(self._runner.t_s, np.array(stops) - 1e-9)).clip(
            max=len(self._runner.t_s) - 1
        )
        turns = [np.arange(k) * (2 * math.pi / k) for k in (HEADINGS, SLOW_HEADINGS)]
        self._turn = np.concatenate(turns)
        self._speeds = np.repeat((speed_mps, SLOWER * speed_mps), (HEADINGS, SLOW_HEADINGS))

    def toward(
        self,
        now: Instant,
        first: Beginning,
        end_m: tuple[float, float],
        speed_mps: float,
        clearance: Clearance,
    ) -> WayOut | None:
        """A way out from `first` to a place, if it is clear."""
        north, east = end_m[0] - first.end.north_m, end_m[1] - first.end.east_m
        distance = max(math.hypot(north, east) - speed_mps * self._lag_s, 0.0)
        if speed_mps <= 0 or distance <= 0:
            return self._verified(now, first, first.end.heading_rad, 0.0, int(self._stops[0]), clearance)
        stop = int(np.searchsorted(self._runner.t_s, distance / speed_mps))
        stop = min(stop, len(self._runner.t_s) - 1)
        return self._verified(now, first, math.atan2(east, north), speed_mps, stop, clearance)

    def best(
        self, now: Instant, first: Beginning, wanted: tuple[float, float], clearance: Clearance
    ) -> tuple[WayOut | None, WayOut]:
        """The verified way out nearest to what is wanted, if there is one; and the least bad one."""
        toward = math.atan2(wanted[1], wanted[0]) if math.hypot(*wanted) > 0.1 else first.end.heading_rad
        direction = np.append(toward + self._turn, first.end.heading_rad)
        speeds = np.append(self._speeds, 0.0)
        north, east, speed = self._runner.paths(first.end, direction, speeds)
        paths = _after(first, self._runner.t_s, north, east)
        room = clearance.room(paths)
        begun = len(first.t_s)
        clear = np.minimum.accumulate(room, axis=1)[:, begun:] > 0  # (C, T) up to and including
        run, stop = np.nonzero(clear[:, self._stops])
        index = self._stops[stop]
        coast = speed[run, index] * self._lag_s
        at_s = first.end_s + self._runner.t_s[index]
        stay = clearance.room_to_stay(
            at_s,
            north[run, index] + coast * np.cos(direction[run]),
            east[run, index] + coast * np.sin(direction[run]),
        )
        cost = at_s + TURN_COST_S * (1 - np.cos(direction[run] - toward))
        good = np.flatnonzero(stay > 0)
        for k in good[np.argsort(cost[good], kind="stable")][:TRIES]:
            found = self._verified(
                now, first, float(direction[run[k]]), float(speeds[run[k]]), int(index[k]), clearance
            )
            if found is not None:
                return found, found
        return None, self._least_bad(now, first, direction, speeds, room)

    def is_clear(self, way_out: WayOut, now: Instant, clearance: Clearance) -> bool:
        """Whether what is still to come of a way out is clear of every set, to the end."""
        t, north, east = way_out.rest(now)
        if clearance.room(Paths(t, north[None], east[None])).min() <= 0:
            return False
        return bool(clearance.room_to_stay(t[-1:], north[-1:], east[-1:])[0] > 0)

    def _verified(
        self, now: Instant, first: Beginning, direction: float, speed: float, stop: int, clearance: Clearance
    ) -> WayOut | None:
        """The way out that runs until grid point `stop` and stays, if all of it is clear."""
        way_out = self._way_out(now, first, direction, speed, stop, verified=True)
        return way_out if self.is_clear(way_out, now, clearance) else None

    def _least_bad(
        self, now: Instant, first: Beginning, direction: FloatArray, speeds: FloatArray, room: FloatArray
    ) -> WayOut:
        """The run with the least time and depth inside the margins, soon before late."""
        t = np.concatenate((first.t_s, first.end_s + self._runner.t_s))
        weight = np.diff(t, append=t[-1:] + 4.0) * np.exp(-t / 60.0)
        bad = (np.minimum(room, 0.0) * weight).sum(axis=1)
        best = int(np.argmax(bad))
        return self._way_out(
            now, first, float(direction[best]), float(speeds[best]), len(self._runner.t_s) - 1, verified=False
        )

    def _way_out(
        self, now: Instant, first: Beginning, direction: float, speed: float, stop: int, *, verified: bool
    ) -> WayOut:
        north, east, speeds = self._runner.paths(first.end, np.array((direction,)), np.array((speed,)))
        run_s = self._runner.t_s[: stop + 1]
        heading = self._runner.heading_rad(first.end, direction, speed, float(run_s[-1]))
        t, run_north, run_east = stopped(
            run_s, north[0, : stop + 1], east[0, : stop + 1], heading, float(speeds[0, stop]), self._lag_s
        )
        return WayOut(
            begin=now,
            t_s=np.concatenate((first.t_s, first.end_s + t)),
            north_m=np.concatenate((first.north_m, run_north)),
            east_m=np.concatenate((first.east_m, run_east)),
            velocity_mps=(speed * math.cos(direction), speed * math.sin(direction)),
            stop_s=first.end_s + float(run_s[-1]),
            verified=verified,
        )


def _after(first: Beginning, t_s: FloatArray, north: FloatArray, east: FloatArray) -> Paths:
    """Runs (C, T) with the same beginning put in front."""
    shape = len(north), len(first.t_s)
    return Paths(
        np.concatenate((first.t_s, first.end_s + t_s)),
        np.hstack((np.broadcast_to(first.north_m, shape), north)),
        np.hstack((np.broadcast_to(first.east_m, shape), east)),
    )
