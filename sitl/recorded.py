"""A recorded log as the sea: its frames are what can be heard, its ships are what is true.

A ship's place is known between its reports and a little beyond the first and the last; where
reports are too far apart it is *not known* then, and not in the truth: nothing is made up.
"""

import bisect
import math

import numpy as np

from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, Instant
from companion.messages import FloatArray, Hull, Tracks
from sitl.ais import AisReport
from sitl.logbook import Logbook, LoggedShip
from sitl.truth import hull_array, true_tracks

BEYOND_S = 10.0  # how far a ship is carried on before its first and after its last report
LONGEST_GAP_S = 60.0  # between two reports of a ship under way
_UNDER_WAY_MPS = 1.0
NO_HULL = Hull(0.0, 0.0, 0.0, 0.0)  # where the log never tells a ship's size: its antenna is measured


class Recording:
    """The traffic of a log in a local frame; instant 0 is its first frame."""

    def __init__(self, log: Logbook, frame: LocalFrame) -> None:
        self.log = log
        self.frame = frame
        self.known_until_s: float | None = log.duration_s
        self.own_mmsi = log.own_mmsi
        zero = log.frames[0].unix_ns
        self._bus = [(Instant(f.unix_ns - zero), f.can_id, f.data) for f in log.frames]
        self._stamps = [t for t, _, _ in self._bus]
        self._paths = [Path(ship, frame) for ship in log.ships]
        self._hulls = hull_array([ship.hull or NO_HULL for ship in log.ships])
        self._mmsi = np.array([ship.mmsi for ship in log.ships], dtype=np.int64)

    def on_the_bus(self, since: Instant, until: Instant) -> list[tuple[Instant, int, bytes]]:
        """The frames recorded after `since` and up to `until`; the very first one counts at 0."""
        first = 0 if since <= 0 < until else bisect.bisect_right(self._stamps, since)
        return self._bus[first : bisect.bisect_right(self._stamps, until)]

    def on_the_air(self, since: Instant, until: Instant) -> list[tuple[Instant, AisReport]]:  # noqa: ARG002
        """Nothing: the radio's reports are on the recorded bus already."""
        return []

    def truth(self, t: Instant) -> Tracks:
        """Where the ships are at `t` that the log knows then.

        A hull without a reported heading lies along its course when it moves, and any way
        (`heading_error_rad` = pi) when it does not.
        """
        seconds = t / NS_PER_S
        rows = [i for i, path in enumerate(self._paths) if path.known(seconds)]
        states = np.array([self._paths[i].at(seconds) for i in rows]).reshape(-1, 6)
        return true_tracks(
            t,
            mmsi=self._mmsi[rows],
            position_m=states[:, :2],
            course_rad=states[:, 2],
            speed_mps=states[:, 3],
            hulls=self._hulls[rows],
            names=tuple(self.log.ships[i].name for i in rows),
            heading_rad=states[:, 4],
            heading_error_rad=states[:, 5],
        )


class Path:
    """Where one recorded ship was, in metres north and east."""

    def __init__(self, ship: LoggedShip, frame: LocalFrame) -> None:
        self.ship = ship
        self.t_s = ship.t_s
        places = [
            frame.to_local(lat, lon)
            for lat, lon in zip(ship.latitude_deg, ship.longitude_deg, strict=True)
        ]  # fmt: skip
        self.position_m: FloatArray = np.array(places).reshape(-1, 2)
        self._times: list[float] = ship.t_s.tolist()

    def known(self, t_s: float) -> bool:
        """Whether the log says where the ship is at `t_s`."""
        times = self._times
        if not times[0] - BEYOND_S <= t_s <= times[-1] + BEYOND_S:
            return False
        k = bisect.bisect_right(times, t_s)
        if k in {0, len(times)} or times[k] - times[k - 1] <= LONGEST_GAP_S:
            return True
        run = self.position_m[k] - self.position_m[k - 1]
        return bool(math.hypot(*run) <= _UNDER_WAY_MPS * (times[k] - times[k - 1]))

    def at(self, t_s: float) -> tuple[float, float, float, float, float, float]:
        """North, east, course, speed, heading and its error, of a time at which it is `known`."""
        after = bisect.bisect_right(self._times, t_s)
        last = max(after - 1, 0)
        since = t_s - self._times[last]
        north, east = self.position_m[last]
        if 0 < after < len(self._times):
            run = self.position_m[after] - self.position_m[last]
            velocity = run / (self._times[after] - self._times[last])
        else:
            velocity = self._reported_velocity(last)
        speed, course = math.hypot(*velocity), math.atan2(velocity[1], velocity[0])
        heading = self.ship.heading_rad[last]
        known_heading = math.isfinite(heading)
        moving = speed >= _UNDER_WAY_MPS
        return (
            north + velocity[0] * since,
            east + velocity[1] * since,
            course,
            speed,
            heading if known_heading else course,
            0.0 if known_heading or moving else math.pi,
        )

    def _reported_velocity(self, k: int) -> FloatArray:
        """(2,) what the ship said of its motion; at rest if it said nothing."""
        speed, course = self.ship.sog_mps[k], self.ship.cog_rad[k]
        if not math.isfinite(speed) or not math.isfinite(course):
            return np.zeros(2)
        return np.array((speed * math.cos(course), speed * math.sin(course)))
