"""What was foretold of a ship, and what it did: every report is held against those 1 to 10 minutes older.

A forecast is a believed report with what was known then.  When a later report of the same ship comes in,
the forecasts that are about one of the watched ages old are scored, each once per age.  This is what
`companion calibrate` learns from, and what adapts the bounds at run time.
"""

from collections import deque
from typing import NamedTuple, Protocol

from companion.instant import Instant, elapsed_s
from companion.messages import ContactReport
from companion.picture.behaviour import KEPT_EVERY_S, Behaviour, Features, Fix

SHARE, LEAST_S = 0.1, 15.0  # how far from the watched age a score may lie


class Forecast(NamedTuple):
    """A report that was believed, what was known of the ship then, and which sort it is."""

    fix: Fix
    features: Features
    sort: int  # of `SORTS`


class Outcome(NamedTuple):
    """Where a ship was, seen from a forecast `age_s` before."""

    mmsi: int
    at: Instant
    forecast: Forecast
    watch: int  # which of the watched ages
    age_s: float
    ahead_m: float
    aside_m: float  # to starboard


class Watch(Protocol):
    """Whoever wants to know outcomes."""

    @property
    def ages_s(self) -> tuple[float, ...]:
        """The ages to score."""
        ...

    def take(self, outcome: Outcome) -> None:
        """One outcome."""
        ...


SORTS = ("merchant", "shuttle", "working", "other")


class Craft(NamedTuple):
    """What is known of the ship itself."""

    mmsi: int
    is_class_b: bool
    ship_type: int | None
    length_m: float  # 0 while not known


def sort_of(ship_type: int | None) -> int:
    """Which of `SORTS`, whose bounds adapt separately, a ship is."""
    kind = ship_type or 0
    if 70 <= kind <= 89:
        return 0
    if 60 <= kind <= 69 or kind in (50, 51, 53, 55):
        return 1
    return 2 if 30 <= kind <= 35 or kind == 52 else 3


def tolerance_s(age_s: float) -> float:
    """A report this much younger or older than a watched age still counts for it."""
    return max(LEAST_S, SHARE * age_s)


class History:
    """One ship's behaviour and its pending forecasts."""

    __slots__ = ("_behaviour", "_kept", "_pending", "newest")

    def __init__(self, ages: int) -> None:
        self._behaviour = Behaviour()
        self._pending: tuple[deque[Forecast], ...] = tuple(deque() for _ in range(ages))
        self._kept: Instant | None = None
        self.newest: Forecast | None = None

    def take(self, report: ContactReport, craft: Craft, watch: Watch) -> None:
        """Score what is due against a believed report, then foretell from it."""
        fix = Fix.of(report)
        if self.newest is not None and fix.at < self.newest.fix.at:
            return
        self._score(fix, craft.mmsi, watch)
        self._behaviour.take(fix)
        features = self._behaviour.features(
            fix, report.heading_rad is not None, craft.is_class_b, craft.ship_type, craft.length_m
        )
        self.newest = Forecast(fix, features, sort_of(craft.ship_type))
        if self._kept is None or elapsed_s(self._kept, fix.at) >= KEPT_EVERY_S:
            self._kept = fix.at
            for pending in self._pending:
                pending.append(self.newest)

    def move_clock(self, step_ns: int) -> None:
        """The source's clock was set: what was foretold on the old one is not scored on the new one."""
        self._behaviour, self._kept = Behaviour(), None
        for pending in self._pending:
            pending.clear()
        if self.newest is not None:
            fix = self.newest.fix
            self.newest = self.newest._replace(fix=fix._replace(at=Instant(fix.at + step_ns)))

    def _score(self, fix: Fix, mmsi: int, watch: Watch) -> None:
        for k, age_s in enumerate(watch.ages_s):
            pending, slack_s = self._pending[k], tolerance_s(age_s)
            while pending:
                forecast = pending[0]
                since_s = elapsed_s(forecast.fix.at, fix.at)
                if since_s < age_s - slack_s:
                    break
                pending.popleft()
                if since_s <= age_s + slack_s:
                    ahead, aside = forecast.fix.strayed_m(fix)
                    watch.take(Outcome(mmsi, fix.at, forecast, k, since_s, ahead, aside))
