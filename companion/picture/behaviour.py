"""What a ship's own reports say of how it moves: the numbers that bounds are conditioned on.

Some ships hold their course for hours, some shuttle and turn all day, and each is recognised by what it
did before.  *Deviation* is how far a ship was from where its present course and speed, run backward, put
it, per second: 0 for a straight steady run.  It is taken over a report at least `BACK_S` old, so that a
transponder heard every two seconds and one heard every minute are measured alike.
"""

import math
from collections import deque

import msgspec

from companion.instant import NS_PER_S, Instant, elapsed_s
from companion.messages import ContactReport
from companion.picture.area import offset_m

BACK_S, LONG_BACK_S, TOO_LONG_S = 45.0, 240.0, 600.0
KEPT_EVERY_NS = 20 * NS_PER_S
_BACK_NS, _LONG_BACK_NS = round(BACK_S * NS_PER_S), round(LONG_BACK_S * NS_PER_S)
_TOO_LONG_NS = round(TOO_LONG_S * NS_PER_S)
UNDER_WAY_MPS = 0.5
AT_REST_MPS = 0.3
MEAN_MEMORY_S, WORST_MEMORY_S = 900.0, 1800.0
LARGEST_MPS = 3.0  # deviations above are all alike: wild

_NO_TIME = math.log(0.1)

FEATURES = (
    "log_speed",  # ln((sog + 0.5 m/s) / 4 m/s)
    "no_history",  # 1 when nothing was heard 45 to 600 s before
    "log_deviation",  # ln of the last deviation + 0.05 m/s, over 0.15 m/s
    "turn_deg_per_s",  # of the course since then, 0 to 1
    "acceleration",  # of the speed since then, per 0.05 m/s2, 0 to 1.5
    "log_under_way",  # ln((time under way + 60 s) / 600 s)
    "no_heading",  # 1 when the heading is not reported
    "shuttle",  # 1 for pilots, rescue, port tenders, law enforcement, passenger ships
    "merchant",  # 1 for cargo ships and tankers
    "log_mean_deviation",  # as log_deviation, mean over some 15 minutes
    "log_worst_deviation",  # the worst, fading over 30 minutes, over 0.3 m/s
    "log_fastest",  # as log_speed, of the greatest speed, fading over 30 minutes
    "log_heard",  # ln((time since the first report + 60 s) / 600 s)
    "class_b",  # 1 for a class B transponder
    "log_length",  # ln(length / 50 m), 0 while not known
    "no_long_history",  # 1 when nothing was heard 240 to 600 s before
    "log_long_deviation",  # as log_deviation, over 240 s and more, over 0.5 m/s
    "log_worst_long_deviation",  # the worst of them, fading over 30 minutes, over 1 m/s
    "working",  # 1 for fishing vessels, tows, dredgers, divers, tugs
)
Features = tuple[float, ...]


class Fix(msgspec.Struct, frozen=True, gc=False):
    """One believed report, as much of it as is looked back upon."""

    at: Instant
    latitude_deg: float
    longitude_deg: float
    sog_mps: float | None
    cog_rad: float | None

    @classmethod
    def of(cls, report: ContactReport) -> "Fix":
        """The position must be there."""
        lat, lon, sog = report.latitude_deg, report.longitude_deg, report.sog_mps
        assert lat is not None
        assert lon is not None
        return cls(report.measured_at, lat, lon, sog, None if sog is None else report.cog_rad)

    @property
    def is_under_way(self) -> bool:
        """Fast enough for its course to mean something, and both known."""
        return self.sog_mps is not None and self.sog_mps >= UNDER_WAY_MPS and self.cog_rad is not None

    def strayed_m(self, later: "Fix") -> tuple[float, float]:
        """How far ahead and to starboard of this fix's straight prediction a later one is.

        A ship not under way is predicted to stay; "ahead" is then north.
        """
        north, east = offset_m(self.latitude_deg, self.longitude_deg, later.latitude_deg, later.longitude_deg)
        sog, cog = self.sog_mps, self.cog_rad
        if sog is None or cog is None or sog < UNDER_WAY_MPS:
            return north, east
        cos, sin = math.cos(cog), math.sin(cog)
        return north * cos + east * sin - sog * elapsed_s(self.at, later.at), east * cos - north * sin


class Behaviour:
    """The memory of one ship's motion, from its reports in the order they were measured."""

    __slots__ = (
        "_fastest",
        "_first",
        "_last",
        "_long",
        "_mean",
        "_past",
        "_recent",
        "_under_way_since",
        "_worst",
        "_worst_long",
    )

    def __init__(self) -> None:
        self._past: deque[Fix] = deque()  # no closer than KEPT_EVERY_NS, the last TOO_LONG_S
        self._first: Instant | None = None
        self._last: Instant | None = None
        self._under_way_since: Instant | None = None
        self._recent: tuple[float, float, float] | None = None  # deviation, turn, acceleration
        self._mean: float | None = None
        self._worst = 0.0
        self._long: float | None = None  # deviation over a longer time
        self._worst_long = 0.0
        self._fastest = 0.0

    def take(self, fix: Fix) -> None:
        """Take the next report."""
        since = 0.0 if self._last is None else max(elapsed_s(self._last, fix.at), 0.0)
        self._first = fix.at if self._first is None else self._first
        self._last = fix.at
        faded = math.exp(-since / WORST_MEMORY_S)
        self._fastest = max(self._fastest * faded, fix.sog_mps or 0.0)
        self._worst *= faded
        self._worst_long *= faded
        if not fix.is_under_way:
            self._under_way_since = None
        elif self._under_way_since is None:
            self._under_way_since = fix.at
        self._recent = None
        self._long = None
        past = self._past
        while past and not 0 <= fix.at - past[0].at < _TOO_LONG_NS:
            past.popleft()
        if past and (back := _youngest(past, fix.at - _BACK_NS)) is not None:
            self._compare(back, fix, since)
            if (long_back := _youngest(past, fix.at - _LONG_BACK_NS)) is not None:
                self._long = _deviation_mps(long_back, fix)
                self._worst_long = max(self._worst_long, min(self._long, LARGEST_MPS))
        if not past or fix.at - past[-1].at >= KEPT_EVERY_NS:
            past.append(fix)

    def _compare(self, back: Fix, fix: Fix, since_s: float) -> None:
        deviation = _deviation_mps(back, fix)
        if fix.is_under_way:
            gap_s = elapsed_s(back.at, fix.at)
            turn = 0.0
            if back.is_under_way:
                assert back.cog_rad is not None
                assert fix.cog_rad is not None
                turn = abs(math.remainder(fix.cog_rad - back.cog_rad, math.tau)) / gap_s
            faster = abs((fix.sog_mps or 0.0) - (back.sog_mps or 0.0)) / gap_s
            self._recent = deviation, turn, faster
            kept = math.exp(-since_s / MEAN_MEMORY_S)
            self._mean = deviation if self._mean is None else kept * self._mean + (1 - kept) * deviation
        self._worst = max(self._worst, min(deviation, LARGEST_MPS))

    def features(
        self, fix: Fix, has_heading: bool, is_class_b: bool, ship_type: int | None, length_m: float
    ) -> Features:
        """The numbers named in `FEATURES`, for the newest report taken."""
        deviation, turn, faster = self._recent or (0.0, 0.0, 0.0)
        known = self._recent is not None
        sort = ship_type or 0
        heard_s = elapsed_s(self._first, fix.at) if self._first is not None else 0.0
        way_s = elapsed_s(self._under_way_since, fix.at) if self._under_way_since is not None else 0.0
        return (
            _log_speed(fix.sog_mps or 0.0),
            0.0 if known else 1.0,
            _log_deviation(deviation, 0.15) if known else 0.0,
            min(math.degrees(turn), 1.0),
            min(faster / 0.05, 1.5),
            _log_time(way_s),
            0.0 if has_heading else 1.0,
            1.0 if sort in (50, 51, 53, 55) or 60 <= sort <= 69 else 0.0,
            1.0 if 70 <= sort <= 89 else 0.0,
            _log_deviation(self._mean or 0.0, 0.15) if known else 0.0,
            _log_deviation(self._worst, 0.3) if heard_s > 60.0 else 0.0,
            _log_speed(self._fastest),
            _log_time(heard_s),
            1.0 if is_class_b else 0.0,
            math.log(max(length_m, 5.0) / 50.0) if length_m > 0.0 else 0.0,
            0.0 if self._long is not None else 1.0,
            _log_deviation(self._long, 0.5) if self._long is not None else 0.0,
            _log_deviation(self._worst_long, 1.0) if heard_s > LONG_BACK_S else 0.0,
            1.0 if 30 <= sort <= 35 or sort == 52 else 0.0,
        )


def _youngest(past: deque[Fix], until_ns: int) -> Fix | None:
    """The youngest fix that is no younger than an instant."""
    for back in reversed(past):
        if back.at <= until_ns:
            return back
    return None


def _deviation_mps(back: Fix, fix: Fix) -> float:
    """How far off the present course and speed, run backward, put the ship, per second."""
    gap_s = elapsed_s(back.at, fix.at)
    if fix.is_under_way:
        return math.hypot(*fix.strayed_m(back)) / gap_s
    if (fix.sog_mps or 0.0) < AT_REST_MPS and (back.sog_mps or 0.0) < AT_REST_MPS:
        return 0.0
    moved = offset_m(back.latitude_deg, back.longitude_deg, fix.latitude_deg, fix.longitude_deg)
    return math.hypot(*moved) / gap_s


def _log_speed(mps: float) -> float:
    found = math.log((mps + 0.5) / 4.0)
    return 1.2 if found > 1.2 else max(found, -1.5)


def _log_deviation(mps: float, over_mps: float) -> float:
    return math.log((0.05 + (LARGEST_MPS if mps > LARGEST_MPS else mps)) / over_mps)


def _log_time(seconds: float) -> float:
    found = math.log((60.0 + seconds) / 600.0) if seconds > 0.0 else _NO_TIME
    return 2.0 if found > 2.0 else max(found, -2.3)
