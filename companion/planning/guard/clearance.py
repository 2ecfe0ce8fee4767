"""Room between planned paths and everywhere ships can be, sound at every instant in between.

A path is checked at the points of its grid of times, each for the half cells before and behind it: the
distance there is bounded by its tangent in time (`reach.slices`).  Discs around the sets sort out
what cannot matter; the exact distance answers for the rest.
"""

from dataclasses import dataclass

import numpy as np

from companion.instant import Instant
from companion.messages import FloatArray, IntArray
from companion.planning.guard.margins import Margins
from companion.planning.guard.vertical import Dive
from companion.reach import Slices

Places = FloatArray | float
LONGEST_S = 3600.0  # nothing is claimed beyond an hour, whatever validity a track states


@dataclass(frozen=True, slots=True)
class Paths:
    """C paths on one grid: `t_s` (T,) from now, north and east (C, T) metres, straight in between."""

    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray

    def __len__(self) -> int:
        return len(self.north_m)


class Clearance:
    """Asks one picture, at one instant, for the room of paths and of places to stay.

    `until_s` (n,) is the age up to which each ship counts: its validity, or `lookahead_s` from now
    where that ends later.  Beyond it the ship may be anywhere, and no way out can be promised.
    `unknown` (n,): ships that expire within the lookahead and can then be where the vehicle is; nothing
    outruns them, so they count only while their bounds hold.  With `dive` a ship counts only while the
    vehicle may be in its draught.
    """

    def __init__(
        self,
        slices: Slices,
        now: Instant,
        margins: Margins,
        speed_mps: float,
        lookahead_s: float,
        position_m: FloatArray,
        dive: Dive | None = None,
    ) -> None:
        self._dive = dive
        self._slices = slices
        self._margins = margins
        self._speed = speed_mps
        self._lookahead_s = lookahead_s
        self.age_s = slices.age_s(now)
        validity = np.minimum(slices.tracks.validity_s, self.age_s + (LONGEST_S + lookahead_s))
        self.until_s = np.maximum(validity, self.age_s + lookahead_s)
        self.unknown = np.zeros(len(slices), dtype=np.bool_)
        ending = np.flatnonzero(self.until_s > validity)
        if len(ending):
            here = np.broadcast_to(position_m, (len(ending), 2))
            distance, _, _ = slices.distances(
                ending, self.age_s[ending], self.until_s[ending], here[:, 0], here[:, 1]
            )
            self.unknown[ending] = distance < margins.localised(lookahead_s)
            if dive is not None:
                self.unknown &= dive.counts(np.zeros(1))[0]
            self.until_s = np.where(self.unknown, validity, self.until_s)

    def unchanged_s(self) -> float:
        """For how long every ship goes on to count up to the same time; 0 where that is not known."""
        validity = self._slices.tracks.validity_s
        left = validity - self.age_s - self._lookahead_s
        return 0.0 if (self.until_s != validity).any() else float(left.min(initial=LONGEST_S))

    # ------------------------------------------------------------ under way

    def room(self, paths: Paths, beyond_m: float = 0.0) -> FloatArray:
        """(C, T) room beyond the margins in each cell, from below; positive says just that.

        What is infinite is more than `beyond_m`.
        """
        room = np.full(paths.north_m.shape, np.inf)
        rows = self._ships_near(paths, beyond_m)
        if not len(rows):
            return room
        step = np.diff(paths.t_s, append=paths.t_s[-1:])
        after = 0.5 * step
        before = np.concatenate((np.zeros(1), after[:-1]))
        margin = self._margins.at(paths.t_s + after)
        path, time, ship = self._near(paths, rows, margin + beyond_m, np.maximum(before, after))
        if not len(path):
            return room
        lower = self._lower_bound(paths, path, time, rows[ship], before[time], after[time])
        np.minimum.at(room, (path, time), lower - margin[time])
        return room

    def _ships_near(self, paths: Paths, beyond_m: float) -> IntArray:
        """Rows whose disc can meet the disc around all paths within their time."""
        tracks, slices = self._slices.tracks, self._slices
        north, east = paths.north_m[0, 0], paths.east_m[0, 0]
        way = np.hypot(paths.north_m - north, paths.east_m - east).max()
        length_s = float(paths.t_s[-1])
        start = np.minimum(np.maximum(self.age_s, 0.0), tracks.validity_s)
        end = np.minimum(np.maximum(self.age_s + length_s, 0.0), tracks.validity_s)
        all_rows = np.arange(len(tracks))
        radius = slices.spread_mps * end + slices.size_m + slices.grown_m(all_rows, self.age_s + length_s)
        x = north - tracks.north_m - slices.drift_mps[:, 0] * start
        y = east - tracks.east_m - slices.drift_mps[:, 1] * start
        reach = radius + way + float(self._margins.at(length_s)) + beyond_m
        distance = _to_segment(x, y, slices.drift_mps * (end - start)[:, None])
        return np.flatnonzero(distance < reach)

    def _near(
        self, paths: Paths, rows: IntArray, margin: FloatArray, half: FloatArray
    ) -> tuple[IntArray, IntArray, IntArray]:
        """Path, time and ship (m,) each, of all cells in which the ship's disc can be too near."""
        slices, tracks = self._slices, self._slices.tracks
        age = self.age_s[rows] + paths.t_s[:, None]  # (T, n)
        validity = tracks.validity_s[rows]
        valid_age = np.minimum(np.maximum(age, 0.0), validity)
        drift, spread = slices.drift_mps[rows], slices.spread_mps[rows]
        late = age + half[:, None] > validity
        coming = np.where(late, tracks.top_speed_mps[rows], np.hypot(drift[:, 0], drift[:, 1]) + spread)
        grown = np.where(
            late, tracks.top_speed_mps[rows] * np.maximum(age - validity, 0) + slices.turned_m[rows], 0.0
        )
        reach = spread * valid_age + slices.size_m[rows] + grown + margin[:, None]
        reach += (self._speed + coming) * half[:, None]
        reach[age > self.until_s[rows] + half[:, None]] = -1.0
        if self._dive is not None:
            reach[~self._dive.counts(paths.t_s - half)[:, rows]] = -1.0
        north = tracks.north_m[rows] + drift[:, 0] * valid_age
        east = tracks.east_m[rows] + drift[:, 1] * valid_age
        x = paths.north_m[:, :, None] - north
        y = paths.east_m[:, :, None] - east
        return np.nonzero((x * x + y * y < reach * reach) & (reach > 0))  # type: ignore[return-value]

    def _lower_bound(
        self,
        paths: Paths,
        path: IntArray,
        time: IntArray,
        ship: IntArray,
        before_s: FloatArray,
        after_s: FloatArray,
    ) -> FloatArray:
        """(m,) least distance in the half cells around a grid point, from below."""
        slices, tracks = self._slices, self._slices.tracks
        age = self.age_s[ship] + paths.t_s[time]
        north, east = paths.north_m[path, time], paths.east_m[path, time]
        distance, away_north, away_east = slices.distances(ship, age, age, north, east)
        advance = slices.advance_mps(ship, age, away_north, away_east)
        last = len(paths.t_s) - 1
        following, earlier = np.minimum(time + 1, last), np.maximum(time - 1, 0)
        # what the path itself contributes in half a cell, positive away from the ship
        ahead = away_north * (paths.north_m[path, following] - north)
        ahead += away_east * (paths.east_m[path, following] - east)
        behind = away_north * (paths.north_m[path, earlier] - north)
        behind += away_east * (paths.east_m[path, earlier] - east)
        forward = 0.5 * ahead - advance * after_s
        backward = 0.5 * behind + slices.retreat_mps(ship, age, advance) * before_s
        tangent = distance + np.minimum(np.minimum(forward, backward), 0.0)
        half = np.maximum(before_s, after_s)
        validity = tracks.validity_s[ship]
        turns = (age - before_s <= validity) & (age + after_s > validity)
        # where the bounds end within the cell the distance has a kink and a step: the plain bound
        plain = distance - (self._speed + tracks.top_speed_mps[ship]) * half - slices.turned_m[ship]
        return np.where(turns, plain, tangent)

    # ------------------------------------------------------------ at rest

    def room_to_stay(
        self, t_s: FloatArray, north_m: FloatArray, east_m: FloatArray, beyond_m: float = 0.0
    ) -> FloatArray:
        """(m,) room at places (m,) from `t_s` (m,) on until the information ends, least over all ships.

        Up to `beyond_m` it is exact from below; what is infinite is more than that.  Not positive says just
        that: of the ships in the way one answers.
        """
        slices, tracks = self._slices, self._slices.tracks
        room = np.full(len(t_s), np.inf)
        if not len(t_s):
            return room
        validity = tracks.validity_s
        valid_end = np.minimum(self.until_s, validity)
        margin = self._margins.tracking_m + self._margins.localised(self.until_s - self.age_s)
        reach = slices.spread_mps * valid_end + slices.size_m + margin
        reach += slices.grown_m(np.arange(len(tracks)), self.until_s)

        def away_m(rows: IntArray, start: FloatArray, north: Places, east: Places) -> FloatArray:
            """From the middle of the ships' tubes, which begin at the ages `start`."""
            drift, begun = slices.drift_mps[rows], np.minimum(np.maximum(start, 0.0), validity[rows])
            x = north - tracks.north_m[rows] - drift[:, 0] * begun
            y = east - tracks.east_m[rows] - drift[:, 1] * begun
            return _to_segment(x, y, drift * np.maximum(valid_end[rows] - begun, 0.0)[..., None])

        # ships that cannot be near any of the places, first
        north, east = float(north_m.mean()), float(east_m.mean())
        wide = float(np.hypot(north_m - north, east_m - east).max()) + beyond_m
        soonest = self.age_s + float(t_s.min())
        rows = np.flatnonzero(away_m(np.arange(len(tracks)), soonest, north, east) < reach + wide)
        if not len(rows):
            return room
        start = self.age_s[rows] + t_s[:, None]  # (m, n)
        least = away_m(rows, start, north_m[:, None], east_m[:, None]) - reach[rows]
        counts = (least < beyond_m) & (start < self.until_s[rows])
        if self._dive is not None:
            counts &= self._dive.counts(t_s)[:, rows]
        least[~counts] = np.inf
        # the ship that is likely to be in the way may be enough; of the others those that can be nearer
        likely = np.argmin(least, axis=1)
        place = np.flatnonzero(counts.any(axis=1))
        ship = likely[place]
        while len(place):
            exact, _, _ = slices.distances(
                rows[ship], start[place, ship], self.until_s[rows[ship]], north_m[place], east_m[place]
            )
            np.minimum.at(room, place, exact - margin[rows[ship]])
            least[place, ship] = np.inf
            place, ship = np.nonzero((least < room[:, None]) & (room > 0)[:, None])
        return room


def _to_segment(x: FloatArray, y: FloatArray, run: FloatArray) -> FloatArray:
    """Distance from points to segments that begin at the origin and run along `run` (..., 2)."""
    along = x * run[..., 0] + y * run[..., 1]
    length = run[..., 0] ** 2 + run[..., 1] ** 2
    share = np.clip(along / np.maximum(length, 1e-12), 0.0, 1.0)
    return np.asarray(np.hypot(x - share * run[..., 0], y - share * run[..., 1]))
