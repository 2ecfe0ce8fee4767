"""Proposes a crossing of the busiest lane in a recorded log.

There is no chart: where ships were seen sailing is where there is water, and a proposal keeps
close to their tracks.  Every ship under way is asked where it is while the vehicle would be in
mid-crossing; each such place is tried as the middle of a crossing at right angles to the ship's
course.  A crossing scores for every ship that passes it while the vehicle is on the way, and less
for every one whose course leads past it within an hour: that is what makes it a lane.  Courses
must agree up to their direction.  Ships of class A count more than yachts.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.errors import ConfigError
from companion.geodesy import LocalFrame
from companion.messages import BoolArray, FloatArray
from sitl.logbook import Logbook
from sitl.recorded import Path

UNDER_WAY_MPS = 1.5
ALIGNED_RAD = math.radians(25.0)
# from start and goal to any ship while the vehicle lies there: who has not told its size may be
# 200 m long with its antenna anywhere (a class B 25 m), and its report may be 30 m off
CLEAR_CLASS_A_M, CLEAR_CLASS_B_M = 300.0, 100.0
DETOUR = 0.75  # length of the crossing over the way there is time for: waiting and going round
SHORTEST_M = 100.0
LONGEST_M = 1500.0
_STEP_S = 10.0
_CLASS_B_WEIGHT = 0.2
_LANE_WITHIN_S = 3600.0
_LANE_WEIGHT = 0.3


@dataclass(frozen=True, slots=True)
class Crossing:
    """A proposal: from `start_deg` to `goal_deg` (latitude, longitude), across `ships` ships' way."""

    start_deg: tuple[float, float]
    goal_deg: tuple[float, float]
    length_m: float
    lane_course_rad: float
    ships: tuple[int, ...]  # MMSI of those that pass between start and goal meanwhile


@dataclass(frozen=True, slots=True)
class _Sea:
    """All ships under way on a grid of times: positions (n, k, 2), NaN where not known."""

    mmsi: tuple[int, ...]
    weight: FloatArray
    t_s: FloatArray
    position_m: FloatArray
    course_rad: FloatArray
    middle_m: FloatArray  # (n, 2) where each ship was in the middle of its record
    middle_mps: FloatArray  # (n, 2) and its velocity there
    anyone_m: FloatArray  # (m, k, 2) the same of all ships, those at rest too
    keep_off_m: FloatArray  # (m,) how far start and goal stay from each of them


def propose(
    log: Logbook, *, speed_mps: float = 2.5, before_s: float = 60.0, after_s: float = 60.0
) -> Crossing:
    """The crossing that meets most ships and fits in the log.

    `before_s` is spent at the start (listening, diving) and `after_s` at the goal (surfacing).
    Raises `ConfigError` when the log is too short or shows no lane.
    """
    remaining_s = log.duration_s - before_s - after_s
    length = min(remaining_s * speed_mps * DETOUR, LONGEST_M)
    if length < SHORTEST_M:
        raise ConfigError(
            f"the log lasts {log.duration_s:.0f} s: too short to listen, cross a lane and surface at "
            f"{speed_mps:g} m/s; give --start and --goal"
        )
    frame = _frame(log)
    sea = _sample(log, frame)
    crossing_s = length / speed_mps
    middle = (sea.t_s >= before_s + 0.25 * crossing_s) & (sea.t_s <= before_s + crossing_s)
    best: tuple[float, FloatArray, float, tuple[int, ...]] | None = None
    for i in range(len(sea.mmsi)):
        for k in np.flatnonzero(middle & np.isfinite(sea.position_m[i, :, 0])):
            centre, course = sea.position_m[i, k], float(sea.course_rad[i, k])
            score, passing = _passing(sea, centre, course, length, before_s)
            if (best is None or score > best[0]) and _ends_are_clear(
                sea, centre, course, length, before_s, crossing_s
            ):
                best = score, centre, course, passing
    if best is None:
        raise ConfigError("no lane: no ship under way passes open water in this log; give --start and --goal")
    _, centre, course, passing = best
    across = np.array((-math.sin(course), math.cos(course)))
    start, goal = centre - across * length / 2, centre + across * length / 2
    return Crossing(frame.to_geodetic(*start), frame.to_geodetic(*goal), length, course % math.tau, passing)


def _frame(log: Logbook) -> LocalFrame:
    if len(log.own_deg):
        return LocalFrame(float(log.own_deg[0, 1]), float(log.own_deg[0, 2]))
    if not log.ships:
        raise ConfigError("no lane: no AIS position report in this log; give --start and --goal")
    middle = np.median([(s.latitude_deg[0], s.longitude_deg[0]) for s in log.ships], axis=0)
    return LocalFrame(float(middle[0]), float(middle[1]))


def _sample(log: Logbook, frame: LocalFrame) -> _Sea:
    t_s = np.arange(0.0, log.duration_s, _STEP_S)
    ships, states, anyone, keep_off = [], [], [], []
    for ship in log.ships:
        path = Path(ship, frame)
        rows = np.array([path.at(t) if path.known(t) else (math.nan,) * 6 for t in t_s.tolist()])
        anyone.append(rows[:, :2].copy())
        keep_off.append(CLEAR_CLASS_A_M if ship.class_a else CLEAR_CLASS_B_M)
        rows[~(rows[:, 3] >= UNDER_WAY_MPS)] = np.nan
        if np.isfinite(rows[:, 0]).any():
            ships.append(ship)
            states.append(rows)
    table = np.array(states).reshape(len(ships), len(t_s), 6)
    middle = np.array([_middle(rows) for rows in table]).reshape(-1, 6)
    north, east, course, speed = middle.T[:4]
    return _Sea(
        mmsi=tuple(ship.mmsi for ship in ships),
        weight=np.array([1.0 if ship.class_a else _CLASS_B_WEIGHT for ship in ships]),
        t_s=t_s,
        position_m=table[..., :2],
        course_rad=table[..., 2],
        middle_m=np.stack((north, east), axis=-1),
        middle_mps=np.stack((speed * np.cos(course), speed * np.sin(course)), axis=-1),
        anyone_m=np.array(anyone).reshape(len(anyone), len(t_s), 2),
        keep_off_m=np.array(keep_off),
    )


def _middle(rows: FloatArray) -> FloatArray:
    known = rows[np.isfinite(rows[:, 0])]
    middle: FloatArray = known[len(known) // 2]
    return middle


def _passing(
    sea: _Sea, centre: FloatArray, course: float, length_m: float, from_s: float
) -> tuple[float, tuple[int, ...]]:
    """How busy a crossing is, and who crosses its line while the vehicle is on the way."""
    relative = sea.position_m - centre
    along = relative @ np.array((math.cos(course), math.sin(course)))
    across = relative @ np.array((-math.sin(course), math.cos(course)))
    aligned = np.abs(np.sin(sea.course_rad - course)) <= math.sin(ALIGNED_RAD)
    inside = np.abs(across) <= 0.45 * length_m
    late = sea.t_s[None, 1:] >= from_s
    crosses = (along[:, :-1] * along[:, 1:] <= 0.0) & inside[:, 1:] & aligned[:, 1:] & late
    # who has not been heard of before the dive is no part of what is to be shown
    heard = np.isfinite(sea.position_m[:, sea.t_s <= from_s, 0]).any(axis=1)
    passing = crosses.any(axis=1) & heard
    # a ship in the middle of the line is better than one at its end
    central = np.where(crosses, 1.0 - np.abs(across[:, 1:]) / length_m, 0.0).max(axis=1, initial=0.0)
    lane = _leads_past(sea, centre, course, length_m)
    mmsi = tuple(sea.mmsi[i] for i in np.flatnonzero(passing))
    return float(np.sum(sea.weight * (passing * (1.0 + central) + _LANE_WEIGHT * lane))), mmsi


def _leads_past(sea: _Sea, centre: FloatArray, course: float, length_m: float) -> BoolArray:
    """(n,) whether a ship, sailing straight on or back, passes within a length of the middle."""
    forward = np.array((math.cos(course), math.sin(course)))
    aside = np.array((-forward[1], forward[0]))
    relative, velocity = sea.middle_m - centre, sea.middle_mps
    speed = velocity @ forward
    passes_s = -(relative @ forward) / np.where(np.abs(speed) < 0.1, math.inf, speed)
    aligned = np.abs(velocity @ aside) <= math.tan(ALIGNED_RAD) * np.abs(speed)
    off_m = np.abs(relative @ aside + velocity @ aside * passes_s)
    leads: BoolArray = aligned & (np.abs(passes_s) <= _LANE_WITHIN_S) & (off_m <= length_m)
    return leads


def _ends_are_clear(
    sea: _Sea, centre: FloatArray, course: float, length_m: float, before_s: float, crossing_s: float
) -> bool:
    """Nobody is near the start until the vehicle has left, nor near the goal from when it can be there."""
    across = np.array((-math.sin(course), math.cos(course)))
    leaving, arriving = sea.t_s <= before_s + 2 * _STEP_S, sea.t_s >= before_s + crossing_s
    for side, while_there in ((-0.5, leaving), (0.5, arriving)):
        offset = sea.anyone_m[:, while_there] - (centre + side * length_m * across)
        if (np.hypot(offset[..., 0], offset[..., 1]) < sea.keep_off_m[:, None]).any():
            return False
    return True
