"""What was foretold of a ship, and what it did: every report is held against those 1 to 10 minutes older.

A forecast is a believed report with what was known then.  When a later report of the same ship comes in,
the forecasts that are about one of the watched ages old are scored, each once per age.  This is what
`companion calibrate` learns from, and what adapts the bounds at run time.
"""

from collections import deque
from functools import lru_cache
from typing import NamedTuple, Protocol

import msgspec

from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport
from companion.picture.behaviour import KEPT_EVERY_NS, Behaviour, Features, Fix

SHARE, LEAST_S = 0.1, 15.0  # how far from the watched age a score may lie
THINNED_NS = 10 * NS_PER_S
NEVER_YET, NOT_DUE = Instant(-(2**62)), Instant(2**62)


class Forecast(msgspec.Struct, frozen=True, gc=False):
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
    sort: int  # of `SORTS`


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


@lru_cache
def _windows_ns(ages_s: tuple[float, ...]) -> tuple[tuple[int, int], ...]:
    """Between which ages a report counts for each watched one."""
    return tuple(
        (round((age_s - tolerance_s(age_s)) * NS_PER_S), round((age_s + tolerance_s(age_s)) * NS_PER_S))
        for age_s in ages_s
    )


class History:
    """One ship's behaviour and its pending forecasts.

    Thousands of reports a second come by: what is only needed now and then is made when it is.  The
    behaviour looks at one every 10 s, and a forecast is made of one every 20 s.
    """

    __slots__ = (
        "_at",
        "_behaved",
        "_behaviour",
        "_craft",
        "_due",
        "_features",
        "_kept",
        "_pending",
        "_report",
    )

    def __init__(self, ages: int) -> None:
        self._behaviour = Behaviour()
        self._behaved = NEVER_YET  # when the behaviour last took a report
        self._features: Features | None = None  # as of then
        self._pending: tuple[deque[Forecast], ...] = tuple(deque() for _ in range(ages))
        self._kept = NEVER_YET
        self._due = NOT_DUE  # the first instant at which a pending forecast may be scored
        self._at = NEVER_YET
        self._report: ContactReport | None = None
        self._craft: Craft | None = None

    def take(self, report: ContactReport, craft: Craft, watch: Watch) -> None:
        """Score what is due against a believed report, then foretell from it."""
        at = report.measured_at
        if at < self._at:
            return
        self._at, self._report = at, report
        is_due, is_seen = at >= self._due, at - self._behaved >= THINNED_NS
        is_kept = at - self._kept >= KEPT_EVERY_NS
        if not (is_due or is_seen or is_kept):
            self._craft = craft
            return
        fix = Fix.of(report)
        if is_due:
            self._score(fix, craft.mmsi, watch)
        self._craft = craft
        if is_seen:
            self._behaved = at
            self._behaviour.take(fix)
            self._features = None
        if is_kept:
            self._kept = at
            known = self.known()
            if known is not None:
                forecast = Forecast(fix, *known)
                for pending in self._pending:
                    pending.append(forecast)
        if is_due or is_kept:
            self._due = self._next_due(watch)

    def known(self) -> tuple[Features, int] | None:
        """What the bounds of the newest report are conditioned on, and which of `SORTS` it is."""
        craft, report = self._craft, self._report
        if craft is None or report is None:
            return None
        if self._features is None:
            self._features = self._behaviour.features(
                Fix.of(report),
                report.heading_rad is not None,
                craft.is_class_b,
                craft.ship_type,
                craft.length_m,
            )
        return self._features, craft.sort

    def move_clock(self, step_ns: int) -> None:
        """The source's clock was set: what was foretold on the old one is not scored on the new one."""
        self.known()  # keeps what the old behaviour says
        self._behaviour, self._behaved, self._kept, self._due = Behaviour(), NEVER_YET, NEVER_YET, NOT_DUE
        for pending in self._pending:
            pending.clear()
        self._at = Instant(self._at + step_ns)

    def _next_due(self, watch: Watch) -> Instant:
        due = NOT_DUE
        for (youngest_ns, _), pending in zip(_windows_ns(watch.ages_s), self._pending, strict=True):
            if pending and (first := pending[0].fix.at + youngest_ns) < due:
                due = Instant(first)
        return due

    def _score(self, fix: Fix, mmsi: int, watch: Watch) -> None:
        for k, (youngest_ns, oldest_ns) in enumerate(_windows_ns(watch.ages_s)):
            pending = self._pending[k]
            while pending:
                forecast = pending[0]
                since_ns = fix.at - forecast.fix.at
                if since_ns < youngest_ns:
                    break
                pending.popleft()
                if since_ns <= oldest_ns:
                    ahead, aside = forecast.fix.strayed_m(fix)
                    watch.take(Outcome(mmsi, fix.at, forecast, k, since_ns / NS_PER_S, ahead, aside))
