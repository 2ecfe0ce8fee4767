"""The bound of what is possible: a search in space and time over the sets of every moment.

Cells of `CELL_M`, ticks of the time a cell takes at full speed; in a tick the vehicle stays or moves to one
of four neighbours.  A cell is free in a tick when it is delta plus half a cell from everything a ship can
cover during it: then every point of a move is delta away at every instant.  The earliest crossing of the
channel is found by letting the set of reachable cells grow tick by tick.
"""

from dataclasses import dataclass, replace

import numpy as np

from companion import reach
from companion.instant import Instant, after, elapsed_s
from companion.messages import BoolArray, FloatArray, IntArray, Tracks
from companion.reach import choose_kernel
from companion.reach.kernel import Kernel
from companion.reach.shapes import only
from sitl.studies.case import Crossing
from sitl.studies.wish import Wish

CELL_M = 5.0
BEFORE_M = 50.0  # the grid begins this far before the channel, and ends as far behind it
ASIDE_M = 60.0  # and reaches this far to both sides
NEAR_M = 400.0  # ships whose reported way is farther off are not looked at


@dataclass(frozen=True, slots=True)
class Search:
    """Follows the ways found for each vehicle: `way_m` (ticks, m, 2), one place a tick from `since` on."""

    case: Crossing
    way_m: FloatArray
    since: Instant
    tick_s: float

    @classmethod
    def of(cls, case: Crossing, tracks: Tracks, vehicles: int, kernel: str) -> "Search":
        """Plans for all of them; ships do not change on the way, so once is enough."""
        k = len(tracks) // vehicles
        compute = choose_kernel("numba" if kernel == "numba" else "numpy")
        tick_s = CELL_M / case.max_speed_mps
        since = Instant(round(case.information_s * 1e9))
        ways = [
            _way(case, only(tracks, np.arange(v * k, (v + 1) * k)), since, tick_s, compute)
            for v in range(vehicles)
        ]
        return cls(case, np.stack(ways, axis=1), since, tick_s)

    def only(self, vehicles: IntArray) -> "Search":
        """For some of the vehicles."""
        return replace(self, way_m=self.way_m[:, vehicles])

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:  # noqa: ARG002
        """See `Planner`: to where the way is one step from now."""
        at = (elapsed_s(self.since, now) + self.case.dt_s) / self.tick_s
        k = min(int(at), len(self.way_m) - 2)
        share = min(at - k, 1.0)
        target = (1 - share) * self.way_m[k] + share * self.way_m[k + 1]
        velocity = (target - position_m) / self.case.dt_s
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        limit = self.case.max_speed_mps
        return Wish(
            velocity * (limit / np.maximum(speed, limit))[:, None], np.ones(len(position_m), dtype=np.bool_)
        )


def _way(case: Crossing, tracks: Tracks, since: Instant, tick_s: float, kernel: Kernel) -> FloatArray:
    """(ticks, 2) north and east: straight to the grid, the earliest way through it, straight to the goal.

    Without a way through, it waits before the grid.
    """
    ticks = int(case.under_way_s / tick_s) + 2
    run_in = round((case.before_m - BEFORE_M) / CELL_M)
    columns = round((case.channel_m + 2 * BEFORE_M) / CELL_M) + 1
    rows = 2 * round(ASIDE_M / CELL_M) + 1
    north = (np.arange(rows) - rows // 2) * CELL_M
    east = -BEFORE_M + np.arange(columns) * CELL_M
    cells = np.stack(np.meshgrid(north, east, indexing="ij"), axis=-1)
    reached = np.zeros((rows, columns), dtype=np.bool_)
    reached[rows // 2, 0] = True
    past: list[BoolArray] = [reached]
    run_out = max((case.goal_m[1] - float(east[-1])) / CELL_M, 0.0)
    for tick in range(run_in, ticks - round(run_out)):
        free = _free(case, tracks, after(since, tick * tick_s), tick_s, cells, kernel)
        here = past[-1] & free  # who leaves a cell is in it first
        reached = here.copy()
        for ahead, behind in ((np.s_[1:, :], np.s_[:-1, :]), (np.s_[:, 1:], np.s_[:, :-1])):
            reached[ahead] |= here[behind]
            reached[behind] |= here[ahead]
        past.append(reached & free)
        if past[-1][:, -1].any() or not past[-1].any():
            break
    way = np.empty((ticks, 2))
    run = np.arange(min(run_in, ticks)) * CELL_M
    way[: len(run), 0], way[: len(run), 1] = case.start_m[0], case.start_m[1] + run
    way[len(run) :] = cells[rows // 2, 0]
    if past[-1][:, -1].any():
        inside = _back(past, cells)
        end = len(run) + len(inside)
        way[len(run) : end] = inside
        way[end:] = _straight(inside[-1], np.array(case.goal_m), ticks - end)
    return way


def _free(
    case: Crossing, tracks: Tracks, t: Instant, tick_s: float, cells: FloatArray, kernel: Kernel
) -> BoolArray:
    along = tracks.north_m + tracks.age_s(t) * tracks.sog_mps * np.cos(tracks.cog_rad)
    near = np.flatnonzero(np.abs(along) < NEAR_M)
    free = np.ones(cells.shape[:2], dtype=np.bool_)
    if near.size:
        some = only(tracks, near)
        sets = reach.tube(some, t, some.age_s(t) + tick_s, kernel)
        distance, _ = sets.nearest_many(cells.reshape(-1, 2))
        free = (distance.min(axis=1) >= case.delta_m + CELL_M / 2).reshape(free.shape)
    return free


def _back(past: list[BoolArray], cells: FloatArray) -> FloatArray:
    """The way that ends nearest to the line, one place a tick, moving late rather than early."""
    rows = cells.shape[0]
    ends = np.flatnonzero(past[-1][:, -1])
    place = (int(ends[np.argmin(np.abs(ends - rows // 2))]), cells.shape[1] - 1)
    way = [place]
    for reached in past[-2::-1]:
        i, j = place
        for step in ((i, j - 1), (i, j), (i - 1, j), (i + 1, j), (i, j + 1)):
            if 0 <= step[0] < rows and 0 <= step[1] < cells.shape[1] and reached[step]:
                place = step
                break
        way.append(place)
    return np.array([cells[p] for p in reversed(way)])


def _straight(start: FloatArray, goal: FloatArray, ticks: int) -> FloatArray:
    length = float(np.hypot(*(goal - start)))
    share = np.minimum(np.arange(1, ticks + 1) * CELL_M / max(length, CELL_M), 1.0)
    return np.asarray(start + share[:, None] * (goal - start))
