"""Looks for a verified way out: many headings and speeds rolled out at once, each with places to stop."""

import math

import numpy as np

from companion.config import Vehicle
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray
from companion.planning.guard.beginning import Beginning
from companion.planning.guard.clearance import Clearance, Paths
from companion.planning.guard.course import course_to, following, joined
from companion.planning.guard.intended import Intended
from companion.planning.guard.rollout import Runner
from companion.planning.guard.way_out import WayOut, stopped

HEADINGS = 16
SLOW_HEADINGS = 8
SLOWER = 0.5  # the second speed tried, a share of the first
STOPS_S = (8.0, 15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 300.0)
TURN_COST_S = 60.0  # a way out against the wanted direction counts as this much longer
WAITS_S = (15.0, 30.0, 60.0, 90.0)  # before a run, where none can begin at once
TRIES = 3  # best candidates verified to the end
STOP_EVERY = 5  # of the points of a course, where it may stop
SOON_S = 1e-3  # a moment this short before stopping is no point of its own


class Search:
    """Finds ways out for one vehicle; `speed_mps` is what it makes good in any declared current."""

    def __init__(self, vehicle: Vehicle, speed_mps: float, length_s: float) -> None:
        self._vehicle = vehicle
        self._lag_s = vehicle.speed_lag_s
        self._length_s = length_s
        self._speed = speed_mps
        self._runner = Runner(vehicle, length_s)
        stops = [s for s in STOPS_S if s < length_s] + [length_s]
        self._stops = np.unique(np.searchsorted(self._runner.t_s, np.array(stops) - 1e-9)).clip(
            max=len(self._runner.t_s) - 1
        )
        turns = [np.arange(k) * (2 * math.pi / k) for k in (HEADINGS, SLOW_HEADINGS)]
        self._turn = np.concatenate(turns)
        self._speeds = np.repeat((speed_mps, SLOWER * speed_mps), (HEADINGS, SLOW_HEADINGS))

    def again(self, now: Instant, first: Beginning, stored: WayOut) -> WayOut:
        """The stored way out, after `first`; whether it is clear is another question."""
        if stored.orders is None:
            return self.toward(now, first, stored.end_m, stored.speed_mps, stored.wait_s(now))
        if stored.stop_s - elapsed_s(stored.begin, now) <= first.end_s + SOON_S:
            return self.stop(now, first)
        return joined(now, first, stored, self._speed, self._vehicle)

    def course(
        self, now: Instant, first: Beginning, intended: Intended, clearance: Clearance
    ) -> WayOut | None:
        """What is intended, followed from `first` as far as it is clear; to be verified to the end."""
        rolled = following(now, first, intended, self._length_s, self._speed, self._vehicle)
        if rolled is None:
            return None
        paths = _after(first, rolled.t_s - first.end_s, rolled.north_m[None], rolled.east_m[None])
        clear = np.minimum.accumulate(clearance.room(paths)[0])[len(first.t_s) :] > 0
        stops = np.flatnonzero(clear[1:])[::-STOP_EVERY] + 1
        rest = self._lag_s * rolled.moving_mps[stops]
        stay = clearance.room_to_stay(
            rolled.t_s[stops], rolled.north_m[stops] + rest[:, 0], rolled.east_m[stops] + rest[:, 1]
        )
        good = stops[stay > 0]
        return course_to(now, first, rolled, int(good[0]), self._lag_s) if len(good) else None

    def toward(
        self,
        now: Instant,
        first: Beginning,
        end_m: tuple[float, float],
        speed_mps: float,
        wait_s: float = 0.0,
    ) -> WayOut:
        """The way out from `first` to a place; whether it is clear is another question.

        It waits before if there is the time to turn on the spot meanwhile.
        """
        turned = wait_s - first.end_s >= self._runner.turn_s
        first = first.waiting(wait_s - first.end_s if turned else 0.0, self._lag_s)
        north, east = end_m[0] - first.end.north_m, end_m[1] - first.end.east_m
        distance = math.hypot(north, east)
        if speed_mps <= 0 or distance <= speed_mps * self._lag_s:
            return self.stop(now, first)
        direction = math.atan2(east, north)
        run = self._runner.paths(first.end, np.array((direction,)), np.array((speed_mps,)), turned=turned)
        along = (run[0][0] - first.end.north_m) * (north / distance)
        along += (run[1][0] - first.end.east_m) * (east / distance)
        stop_s = _first_s(self._runner.t_s, along + run[2][0] * self._lag_s, distance)
        return self._way_out(now, first, direction, speed_mps, stop_s, run, verified=True, turned=turned)

    def stop(self, now: Instant, first: Beginning) -> WayOut:
        """Stopping after `first`; who calls it knows that it is clear."""
        return self._straight(now, first, first.end.heading_rad, 0.0, STOPS_S[0], verified=True)

    def best(
        self,
        now: Instant,
        first: Beginning,
        wanted: tuple[float, float],
        clearance: Clearance,
        wait_s: float = 0.0,
    ) -> tuple[WayOut | None, WayOut]:
        """The verified way out nearest to what is wanted, if there is one; and the least bad one.

        With `wait_s` every run begins only after waiting so long, and turning on the spot.
        """
        toward = math.atan2(wanted[1], wanted[0]) if math.hypot(*wanted) > 0.1 else first.end.heading_rad
        turned = wait_s > 0
        first = first.waiting(wait_s + self._runner.turn_s if turned else 0.0, self._lag_s)
        direction = np.append(toward + self._turn, first.end.heading_rad)
        speeds = np.append(self._speeds, 0.0)
        north, east, speed = self._runner.paths(first.end, direction, speeds, turned=turned)
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
            stop_s = float(self._runner.t_s[index[k]])
            found = self._straight(
                now,
                first,
                float(direction[run[k]]),
                float(speeds[run[k]]),
                stop_s,
                verified=True,
                turned=turned,
            )
            if self.is_clear(found, now, clearance):
                return found, found
        return None, self._least_bad(now, first, direction, speeds, room)

    def is_clear(self, way_out: WayOut, now: Instant, clearance: Clearance) -> bool:
        """Whether what is still to come of a way out is clear of every set, to the end."""
        return bool(self.room(way_out, now, clearance).min() > 0)

    def room(self, way_out: WayOut, now: Instant, clearance: Clearance, beyond_m: float = 0.0) -> FloatArray:
        """(T,) room beyond the margins of what is still to come, at the end for as long as it stays."""
        t, north, east = way_out.rest(now)
        room: FloatArray = clearance.room(Paths(t, north[None], east[None]), beyond_m)[0]
        if room.min() > 0:  # else it is not clear, and nobody asks for how long it could stay
            room[-1] = min(room[-1], clearance.room_to_stay(t[-1:], north[-1:], east[-1:], beyond_m)[0])
        return room

    def _least_bad(
        self, now: Instant, first: Beginning, direction: FloatArray, speeds: FloatArray, room: FloatArray
    ) -> WayOut:
        """The run with the least time and depth inside the margins, soon before late."""
        t = np.concatenate((first.t_s, first.end_s + self._runner.t_s))
        weight = np.diff(t, append=t[-1:] + 4.0) * np.exp(-t / 60.0)
        bad = (np.minimum(room, 0.0) * weight).sum(axis=1)
        best = int(np.argmax(bad))
        end_s = float(self._runner.t_s[-1])
        return self._straight(now, first, float(direction[best]), float(speeds[best]), end_s, verified=False)

    def _straight(
        self,
        now: Instant,
        first: Beginning,
        direction: float,
        speed: float,
        stop_s: float,
        *,
        verified: bool,
        turned: bool = False,
    ) -> WayOut:
        """One run, and stopping `stop_s` after its begin."""
        run = self._runner.paths(first.end, np.array((direction,)), np.array((speed,)), turned=turned)
        return self._way_out(now, first, direction, speed, stop_s, run, verified=verified, turned=turned)

    def _way_out(
        self,
        now: Instant,
        first: Beginning,
        direction: float,
        speed: float,
        stop_s: float,
        run: tuple[FloatArray, FloatArray, FloatArray],
        *,
        verified: bool,
        turned: bool,
    ) -> WayOut:
        grid_s = self._runner.t_s
        until = int(np.searchsorted(grid_s, stop_s - SOON_S))
        north, east, speeds = (
            np.append(values[0, :until], np.interp(stop_s, grid_s, values[0])) for values in run
        )
        heading = self._runner.heading_rad(first.end, direction, speed, stop_s, turned=turned)
        run_s = np.append(grid_s[:until], stop_s)
        t, north, east = stopped(run_s, north, east, heading, float(speeds[-1]), self._lag_s)
        return WayOut(
            begin=now,
            t_s=np.concatenate((first.t_s, first.end_s + t)),
            north_m=np.concatenate((first.north_m, north)),
            east_m=np.concatenate((first.east_m, east)),
            velocity_mps=(speed * math.cos(direction), speed * math.sin(direction)),
            stop_s=first.end_s + stop_s,
            verified=verified,
            run_s=first.end_s,
            turn_s=self._runner.turn_s if turned else 0.0,
        )


def _first_s(t_s: FloatArray, values: FloatArray, wanted: float) -> float:
    """When `values` (T,) first reach what is wanted, straight between the times; the end if never."""
    k = int(np.argmax(values >= wanted))
    if values[k] < wanted:
        return float(t_s[-1])
    if k == 0:
        return float(t_s[0])
    share = (wanted - values[k - 1]) / (values[k] - values[k - 1])
    return float(t_s[k - 1] + share * (t_s[k] - t_s[k - 1]))


def _after(first: Beginning, t_s: FloatArray, north: FloatArray, east: FloatArray) -> Paths:
    """Runs (C, T) with the same beginning put in front."""
    shape = len(north), len(first.t_s)
    return Paths(
        np.concatenate((first.t_s, first.end_s + t_s)),
        np.hstack((np.broadcast_to(first.north_m, shape), north)),
        np.hstack((np.broadcast_to(first.east_m, shape), east)),
    )
