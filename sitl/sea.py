"""The world: one vehicle with its autopilot, antenna and bus, among ships that sail on regardless."""

import math
from dataclasses import dataclass
from typing import Protocol

from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, Instant, after
from companion.messages import OwnState, Tracks
from sitl.ais import AisReport
from sitl.autopilot import Autopilot
from sitl.bus import AisReceiver, GnssReceiver
from sitl.vehicle import Dynamics, VehicleState

LONGEST_STEP_S = 0.1  # of the vehicle's dynamics


class Traffic(Protocol):
    """Ships, and how they can be heard.  All of it is a function of time.

    `known_until_s`: when the truth ends, for a sea that does (a log); else None.
    """

    known_until_s: float | None

    def truth(self, t: Instant) -> Tracks:
        """Every hull known at `t`, without doubt."""
        ...

    def on_the_air(self, since: Instant, until: Instant) -> list[tuple[Instant, AisReport]]:
        """AIS reports sent in (since, until]."""
        ...

    def on_the_bus(self, since: Instant, until: Instant) -> list[tuple[Instant, int, bytes]]:
        """Recorded CAN frames of (since, until]."""
        ...


@dataclass(frozen=True, slots=True)
class Heard:
    """What left the world for the companion in one step: MAVLink bytes now, CAN frames with their times."""

    mavlink: bytes
    can: list[tuple[Instant, int, bytes]]


@dataclass(frozen=True, slots=True)
class Finish:
    """When a run is over: `goal_m` (north, east) reached at the surface, or `limit` reached."""

    goal_m: tuple[float, float]
    radius_m: float
    surfaced_depth_m: float
    limit: Instant


class Sea:
    """Advances by `advance`; between two calls nothing moves.  Instant 0 is the start.

    `gnss_on_bus`: the vehicle has a GNSS receiver on its bus (a recorded bus brings its own).
    Under water nothing is heard: no AIS, no GNSS, a silent bus.
    """

    def __init__(
        self,
        *,
        frame: LocalFrame,
        traffic: Traffic,
        dynamics: Dynamics,
        start: VehicleState,
        autopilot: Autopilot,
        finish: Finish,
        utc_ns_at_zero: int,
        antenna_height_m: float,
        receiver_on_s: float = 0.0,
        gnss_on_bus: bool = True,
    ) -> None:
        self.frame = frame
        self.traffic = traffic
        self.autopilot = autopilot
        self.state = start
        self.finish = finish
        self.now = Instant(0)
        self.start_deg = frame.to_geodetic(start.north_m, start.east_m)
        self._dynamics = dynamics
        self._utc_ns_at_zero = utc_ns_at_zero
        self._antenna_height_m = antenna_height_m
        self._ais = AisReceiver()
        self._gnss = GnssReceiver() if gnss_on_bus else None
        for t, report in traffic.on_the_air(after(self.now, -receiver_on_s), self.now):
            autopilot.hear(t, report)

    @property
    def antenna_is_dry(self) -> bool:
        """Whether anything can be heard."""
        return self.state.depth_m < self._antenna_height_m

    @property
    def to_goal_m(self) -> float:
        """Horizontal distance left."""
        north, east = self.finish.goal_m
        return math.hypot(self.state.north_m - north, self.state.east_m - east)

    @property
    def arrived(self) -> bool:
        """At the goal and at the surface."""
        return self.to_goal_m <= self.finish.radius_m and self.state.depth_m <= self.finish.surfaced_depth_m

    @property
    def timed_out(self) -> bool:
        """The time limit is reached."""
        return self.now >= self.finish.limit

    @property
    def goal_deg(self) -> tuple[float, float]:
        """Latitude and longitude of the goal."""
        return self.frame.to_geodetic(*self.finish.goal_m)

    @property
    def position_deg(self) -> tuple[float, float]:
        """Latitude and longitude of the vehicle now."""
        return self.frame.to_geodetic(self.state.north_m, self.state.east_m)

    def truth(self, t: Instant) -> Tracks:
        """Every hull known at `t`, in `frame`."""
        return self.traffic.truth(t)

    def own_state(self) -> OwnState:
        """The vehicle as it truly is now, in `frame`."""
        state = self.state
        return OwnState(
            self.now, state.north_m, state.east_m, state.depth_m, state.velocity_ned_mps, state.heading_rad
        )

    def receive(self, data: bytes) -> None:
        """MAVLink bytes for the autopilot, now."""
        self.autopilot.receive(self.now, data)

    def advance(self, dt_s: float) -> Heard:
        """Let `dt_s` pass."""
        since = self.now
        until = after(since, dt_s)
        steps = max(math.ceil(dt_s / LONGEST_STEP_S - 1e-9), 1)
        for k in range(steps):
            demand = self.autopilot.demand(after(since, dt_s * k / steps))
            self.state = self._dynamics.step(self.state, demand, dt_s / steps)
        self.now = until
        can = self._listen(since, until) if self.antenna_is_dry else []
        return Heard(self.autopilot.step(until, self.state, has_gnss=self.antenna_is_dry), can)

    def _listen(self, since: Instant, until: Instant) -> list[tuple[Instant, int, bytes]]:
        can = list(self.traffic.on_the_bus(since, until))
        if self._gnss is not None:
            utc = self._utc_ns_at_zero
            for second in range((utc + since) // NS_PER_S + 1, (utc + until) // NS_PER_S + 1):
                t = Instant(second * NS_PER_S - utc)
                can += [(t, *frame) for frame in self._gnss.say(second * NS_PER_S, *self.position_deg)]
        for t, report in self.traffic.on_the_air(since, until):
            self.autopilot.hear(t, report)
            can += [(t, *frame) for frame in self._ais.say(report)]
        return sorted(can, key=lambda item: item[0])
