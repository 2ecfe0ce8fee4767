"""The paper's ships: two lanes, opposite directions, bounded noise on speed and course.

Noise is a process chosen by name.  Every process is piecewise constant, so that positions are
integrated exactly and the truth at any time is a formula, not the state of a stepping loop.
A ship *reports* its nominal speed and course and *sails* what the noise makes of them: the
paper's model, and the hard one, since a constant error is never seen in the reports.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from companion.geodesy import LocalFrame
from companion.instant import Instant, elapsed_s, instant
from companion.messages import FloatArray, Hull, Tracks
from sitl.ais import (
    STATIC_INTERVAL_S,
    AisReport,
    AisStatic,
    position_report,
    reporting_interval_s,
)
from sitl.sailing import Sailing
from sitl.truth import hull_array, true_tracks

NoiseKind = Literal["none", "constant", "interval", "white"]
_HOLD_S = {"none": math.inf, "constant": math.inf, "interval": 10.0, "white": 0.1}


@dataclass(frozen=True, slots=True)
class Ship:
    """One ship at the start: antenna position in the local frame, nominal motion, hull."""

    mmsi: int
    name: str
    north_m: float
    east_m: float
    course_rad: float
    speed_mps: float
    hull: Hull
    draught_m: float = 8.0


@dataclass(frozen=True, slots=True)
class Noise:
    """Bounds of the deviation from the nominal motion, and the process within them.

    `constant`: each ship keeps one corner of the bounds for ever, the worst case.  `interval`: a
    fresh uniform draw every 10 s.  `white`: the same every 0.1 s, which averages out.
    """

    kind: NoiseKind = "constant"
    speed_mps: float = 0.05
    course_rad: float = 0.01

    def draw(
        self, ships: int, span_s: float, rng: np.random.Generator
    ) -> tuple[float, FloatArray, FloatArray]:
        """Seconds each value holds, and (ships, k) deviations of speed and course that cover the span."""
        hold_s = _HOLD_S[self.kind]
        shape = (ships, 1 if math.isinf(hold_s) else math.ceil(span_s / hold_s) + 1)
        if self.kind == "none":
            return span_s, np.zeros(shape), np.zeros(shape)
        unit = rng.uniform(-1.0, 1.0, (2, *shape))
        if self.kind == "constant":
            unit, hold_s = np.sign(unit), span_s
        return hold_s, self.speed_mps * unit[0], self.course_rad * unit[1]


class Fleet:
    """Ships under way; `truth` and `on_the_air` are functions of time alone.

    `begin` to `end` is the span for which noise is drawn; the last values hold after it.
    """

    def __init__(
        self,
        ships: tuple[Ship, ...],
        noise: Noise,
        rng: np.random.Generator,
        frame: LocalFrame,
        *,
        utc_ns_at_zero: int,
        begin: Instant,
        end: Instant,
    ) -> None:
        self.known_until_s: float | None = None
        self.ships = tuple(sorted(ships, key=lambda ship: ship.mmsi))
        self.frame = frame
        self._utc_ns_at_zero = utc_ns_at_zero
        self._begin = begin
        n = len(self.ships)
        hold_s, dv, dth = noise.draw(n, elapsed_s(begin, end), rng)
        speed = np.array([s.speed_mps for s in self.ships])[:, None] + dv
        course = np.array([s.course_rad for s in self.ships])[:, None] + dth
        self._sailing = Sailing(hold_s, speed, course)
        start = np.array([(s.north_m, s.east_m) for s in self.ships]).reshape(n, 2)
        self._origin = start - self._sailing.run_m(elapsed_s(begin, Instant(0)))
        self._phases = rng.uniform(0.0, 1.0, (n, 2))
        self._hulls = hull_array([s.hull for s in self.ships])
        self._mmsi = np.array([s.mmsi for s in self.ships], dtype=np.int64)
        self._names = tuple(s.name for s in self.ships)

    def antenna_m(self, t: Instant) -> FloatArray:
        """(n, 2) north and east of every ship's GNSS antenna, exactly."""
        position: FloatArray = self._origin + self._sailing.run_m(elapsed_s(self._begin, t))
        return position

    def truth(self, t: Instant) -> Tracks:
        """Where every hull is at `t`: all bounds zero.  A hull points where it goes."""
        position = self.antenna_m(t)
        since_s = elapsed_s(self._begin, t)
        return true_tracks(
            t,
            mmsi=self._mmsi,
            position_m=position,
            course_rad=self._sailing.course_rad(since_s),
            speed_mps=self._sailing.speed_mps(since_s),
            hulls=self._hulls,
            names=self._names,
        )

    def on_the_air(self, since: Instant, until: Instant) -> list[tuple[Instant, AisReport]]:
        """The AIS reports sent after `since` and up to `until`, in order of time."""
        sent = chain.from_iterable(self._sent_by(i, since, until) for i in range(len(self.ships)))
        return sorted(sent, key=lambda item: (item[0], item[1].mmsi))

    def on_the_bus(self, since: Instant, until: Instant) -> list[tuple[Instant, int, bytes]]:  # noqa: ARG002
        """Nothing: these ships are heard by radio only."""
        return []

    def _sent_by(self, i: int, since: Instant, until: Instant) -> Iterator[tuple[Instant, AisReport]]:
        ship = self.ships[i]
        every = reporting_interval_s(ship.speed_mps)
        for t in _schedule(self._phases[i, 0] * every, every, since, until):
            yield t, self._position_report(ship, i, t)
        for t in _schedule(self._phases[i, 1] * STATIC_INTERVAL_S, STATIC_INTERVAL_S, since, until):
            yield (
                t,
                AisStatic(ship.mmsi, ship.name, f"SITL{i:03d}", 9_000_000 + i, 70, ship.hull, ship.draught_m),
            )

    def _position_report(self, ship: Ship, i: int, t: Instant) -> AisReport:
        utc_s = (self._utc_ns_at_zero + t) // 1_000_000_000
        fix = Instant(utc_s * 1_000_000_000 - self._utc_ns_at_zero)
        latitude, longitude = self.frame.to_geodetic(*self.antenna_m(fix)[i])
        # the frame's north is the origin's; a ship reports its course from its own meridian
        convergence = math.radians(longitude - self.frame.longitude_deg) * math.sin(math.radians(latitude))
        true = ship.course_rad + convergence
        return position_report(
            ship.mmsi,
            (latitude, longitude),
            utc_second=utc_s % 60,
            cog_rad=true,
            sog_mps=ship.speed_mps,
            heading_rad=true,
        )


def _schedule(phase_s: float, every_s: float, since: Instant, until: Instant) -> Iterator[Instant]:
    """The times phase + k * every in (since, until]."""
    phase, every = instant(phase_s), instant(every_s)
    k = (since - phase) // every + 1
    while phase + k * every <= until:
        yield Instant(phase + k * every)
        k += 1
