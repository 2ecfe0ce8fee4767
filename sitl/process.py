"""`companion sitl`: the same sea as a process of its own, in real time or faster, over UDP and a CAN bus."""

import time
from argparse import Namespace
from contextlib import ExitStack
from dataclasses import dataclass
from math import inf
from threading import Event

import numpy as np
from rich.console import Console

from companion.edges.can_bus import CanBus
from companion.edges.mavlink import MavlinkLink
from companion.edges.stopping import stop_on_signals
from companion.instant import NS_PER_S, Instant, elapsed_s
from sitl import logbook
from sitl.closest import to_hulls
from sitl.launch import recorded_sea, scenario_sea
from sitl.scenario import load
from sitl.sea import Sea

EXIT_ARRIVED, EXIT_NOT_ARRIVED = 0, 1
_STEP_S = 0.02  # wall time between two steps; world time while the speedup allows it
_LONGEST_STEP_S = 0.1  # world time: the telemetry's period
_BEHIND_S = 1.0  # world time this far behind the clock is given up, not caught up with
_LINGER_S = 3.0  # world time after arrival, for the companion to notice it
_LINE_EVERY_S = 30.0


@dataclass(slots=True)
class Closest:
    """The smallest distance to any true hull so far, looked at every second of world time."""

    distance_m: float = inf
    name: str = ""
    at_s: float = 0.0
    looked_s: float = -inf

    def look(self, sea: Sea) -> None:
        """Compare with the hulls of this second."""
        now_s = sea.now / NS_PER_S
        if now_s - self.looked_s < 1.0:
            return
        self.looked_s = now_s
        truth = sea.truth(sea.now)
        if not len(truth):
            return
        distances = to_hulls(truth, np.array((sea.state.north_m, sea.state.east_m)))
        nearest = int(np.argmin(distances))
        if distances[nearest] < self.distance_m:
            self.distance_m, self.at_s = float(distances[nearest]), now_s
            self.name = truth.names[nearest] or str(truth.mmsi[nearest])


def run(options: Namespace) -> int:
    """Sail until the vehicle has arrived, time is up, or a signal ends it.

    `options`: `scenario`, `traffic`, `start`, `goal`, `mavlink`, `can`, `speedup`, `seed` as the
    command line has them.  Raises `CompanionError` before the start only.
    """
    console = Console(stderr=True, highlight=False)
    sea = _sea(options)
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals())
        link = MavlinkLink.open(options.mavlink)
        stack.callback(link.close)
        bus = CanBus.open(options.can)
        stack.callback(bus.close)
        console.print(_greeting(sea, options), soft_wrap=True)
        closest = _sail(sea, link, bus, stop, options.speedup, console)
        console.print(_farewell(sea, closest), soft_wrap=True)
    return EXIT_ARRIVED if sea.arrived or stop.is_set() else EXIT_NOT_ARRIVED


def _sea(options: Namespace) -> Sea:
    scenario = load(options.scenario)
    if options.traffic is None:
        return scenario_sea(scenario, seed=options.seed, start=options.start, goal=options.goal)
    log = logbook.read(options.traffic)
    return recorded_sea(scenario, log, start=options.start, goal=options.goal)


def _sail(
    sea: Sea,
    link: MavlinkLink,
    bus: CanBus,
    stop: Event,
    speedup: float,
    console: Console,
) -> Closest:
    closest = Closest()
    pace = Pace(speedup)
    arrived_at: Instant | None = None
    said_s = 0.0
    with console.status("") as status:
        while not stop.wait(pace.until_next_s(sea.now)) and not sea.timed_out:
            for data in link.receive():
                sea.receive(data)
            bus.receive()  # nobody here listens, but a full queue would hold everybody up
            heard = sea.advance(pace.step_s)
            if heard.mavlink:
                link.send(heard.mavlink)
            for _, can_id, data in heard.can:
                bus.send(can_id, data)
            closest.look(sea)
            if sea.now / NS_PER_S - said_s >= (1.0 if console.is_terminal else _LINE_EVERY_S):
                said_s = sea.now / NS_PER_S
                status.update(_line(sea))
                if not console.is_terminal:
                    console.print(_line(sea), soft_wrap=True)
            if not sea.arrived:
                arrived_at = None
            elif arrived_at is None:
                arrived_at = sea.now
            if arrived_at is not None and elapsed_s(arrived_at, sea.now) >= _LINGER_S:
                break
    return closest


class Pace:
    """World time against the wall clock, `speedup` times as fast, without drift."""

    def __init__(self, speedup: float) -> None:
        self.step_s = min(_STEP_S * max(speedup, 1.0), _LONGEST_STEP_S)
        self.slipped_s = 0.0
        self._speedup = speedup
        self._zero = time.monotonic()

    def until_next_s(self, now: Instant) -> float:
        """How long to wait, in wall time, before the world's next step."""
        due = self._zero + (now / NS_PER_S + self.step_s) / self._speedup
        late_s = time.monotonic() - due
        if late_s * self._speedup > _BEHIND_S:
            self._zero += late_s
            self.slipped_s += late_s * self._speedup
        return max(-late_s, 0.0)


def _greeting(sea: Sea, options: Namespace) -> str:
    start, goal = sea.start_deg, sea.goal_deg
    return (
        f"start {start[0]:.6f},{start[1]:.6f}  goal {goal[0]:.6f},{goal[1]:.6f}  "
        f"MAVLink {options.mavlink}  CAN {options.can}  {options.speedup:g} x real time"
    )


def _line(sea: Sea) -> str:
    state = sea.state
    setpoints = sea.autopilot.counts
    return (
        f"{sea.now / NS_PER_S:7.1f} s  {sea.autopilot.mode.name}"
        f"{'' if sea.autopilot.armed else ' (disarmed)'}  depth {state.depth_m:4.1f} m  "
        f"{state.speed_mps:4.2f} m/s  {sea.to_goal_m:6.0f} m to go  "
        f"{setpoints['setpoint.taken']} setpoints taken"
    )


def _farewell(sea: Sea, closest: Closest) -> str:
    end = "arrived" if sea.arrived else "time is up" if sea.timed_out else "stopped"
    near = "no ship was near"
    if closest.distance_m < inf:
        near = f"closest hull {closest.distance_m:.1f} m ({closest.name} at {closest.at_s:.0f} s)"
    dropped = {key: n for key, n in sorted(sea.autopilot.counts.items()) if key != "setpoint.taken"}
    return (
        f"{end} after {sea.now / NS_PER_S:.1f} s, {sea.to_goal_m:.1f} m from the goal, "
        f"depth {sea.state.depth_m:.1f} m; {near}; "
        f"{sea.autopilot.counts['setpoint.taken']} setpoints taken, dropped: {dropped or 'none'}"
    )
