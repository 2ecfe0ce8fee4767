"""Bounds that learn at run time: adaptive conformal inference for every age, of all ships and of each sort.

Every outcome is scored against the set that foretold it.  A miss raises the logarithm of the sets at that
age by `rate * level`, a hit lowers it by `rate * (1 - level)`: whatever the water is like, the share of hits
tends to the level (quantile tracking; Gibbs and Candes 2021, Angelopoulos et al. 2023).  Half of the step is
taken by all ships under way alike, so that a new water is learned soon, half by the ship's sort.  The steps
are large at first and then fall; and smaller at greater ages, for forecasts of one ship overlap.  A ship
under way that left her sets has still larger ones, which her hits bring back, never below those of her sort:
a ferry that turned round will turn round again.
"""

import math
from collections import Counter, deque
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from companion.instant import Instant, elapsed_s
from companion.messages import SPREAD_AGES_S, FloatArray, IntArray, Reason
from companion.picture.behaviour import UNDER_WAY_MPS
from companion.picture.forecast import SORTS, Outcome
from companion.picture.learned import STILL_MPS, LearnedBounds

RATE = 0.1  # at the shortest age, in natural logarithms of size; falls with the root of the age
RATES = tuple(RATE * math.sqrt(SPREAD_AGES_S[0] / age_s) for age_s in SPREAD_AGES_S)
EAGER, EAGER_FOR = 8.0, 30.0  # times as large at first, half as much after so many outcomes
LOWEST, HIGHEST = -1.5, 3.0
SHIP_RATE, SHIP_HIGHEST = 0.2, 3.0  # of the ship's own, at every age
MOST_SHIPS = 5000  # that have larger sets of their own
SHOWN_S = 60.0  # how long a miss stays an event
MOST_EVENTS = 50
MOST_WAITING = 1000
CELLS = (*SORTS, "still", "slow")
STILL, SLOW = len(SORTS), len(SORTS) + 1  # ships at rest: at berth; creeping, or swinging at anchor
UNDER_WAY = range(len(SORTS))
Cell = tuple[int, int]  # of CELLS, stated age
ENOUGH, SHORTFALL = 200, 0.05  # outcomes; how far below the level is a doubt


@dataclass(frozen=True, slots=True)
class Miss:
    """A report outside the set that should have held it."""

    at: Instant
    mmsi: int
    age_s: float
    ahead_m: float
    aside_m: float

    def text(self) -> str:
        """For a person."""
        way = "ahead" if self.ahead_m >= 0 else "astern"
        side = "starboard" if self.aside_m >= 0 else "port"
        return (
            f"MMSI {self.mmsi} left its set of {self.age_s:.0f} s ago: "
            f"{abs(self.ahead_m):.0f} m {way}, {abs(self.aside_m):.0f} m to {side}"
        )


def cell_of(outcome: Outcome) -> Cell:
    """Which controller an outcome belongs to."""
    fix = outcome.forecast.fix
    rest = STILL if (fix.sog_mps or 0.0) < STILL_MPS else SLOW
    return (outcome.forecast.sort if fix.is_under_way else rest), outcome.watch


class Adaptation:
    """Scores outcomes, raises or lowers the sets, and knows the running coverage."""

    def __init__(self, bounds: LearnedBounds) -> None:
        self._bounds = bounds
        self._shared = [[0.0] * len(SPREAD_AGES_S) for _ in range(2)]  # of ships under way, and at rest
        self._own = [[0.0] * len(SPREAD_AGES_S) for _ in CELLS]
        self._ships: dict[int, FloatArray] = {}  # (K,) of an MMSI, none where it is 0
        self._steps: Counter[Cell] = Counter()  # of the shared ones
        self._misses: deque[Miss] = deque(maxlen=MOST_EVENTS)
        self._waiting: list[Outcome] = []  # scored together, before anybody looks
        self._scored: Counter[Cell] = Counter()
        self._missed: Counter[Cell] = Counter()

    @property
    def ages_s(self) -> tuple[float, ...]:
        """See `Watch`."""
        return SPREAD_AGES_S

    @property
    def raised(self) -> FloatArray:
        """(CELLS, K) what is added to the logarithms of the sizes of each sort of ship."""
        self._settle()
        shared: FloatArray = np.repeat(self._shared, (len(SORTS), 2), axis=0)
        return shared + self._own

    def raised_of(self, cells: Sequence[int] | IntArray, numbers: Iterable[int]) -> FloatArray:
        """(n, K) the same of single ships, by their cells and MMSIs."""
        found: FloatArray = self.raised[cells]
        if self._ships:
            for i, mmsi in enumerate(numbers):
                own = self._ships.get(mmsi)
                if own is not None:
                    found[i] += own
        return found

    @property
    def scored(self) -> Counter[Cell]:
        """Outcomes of each sort and age."""
        self._settle()
        return self._scored

    @property
    def missed(self) -> Counter[Cell]:
        """Those of them outside their sets."""
        self._settle()
        return self._missed

    def take(self, outcome: Outcome) -> None:
        """Score one outcome of a ship whose speed was known, and its course if it had way on."""
        fix = outcome.forecast.fix
        if fix.is_under_way or (fix.sog_mps is not None and fix.sog_mps < UNDER_WAY_MPS):
            self._waiting.append(outcome)
            if len(self._waiting) >= MOST_WAITING:
                self._settle()

    def _settle(self) -> None:
        """Score what waits, in the order it came."""
        if not self._waiting:
            return
        outcomes, self._waiting = self._waiting, []
        for outcome, score in zip(outcomes, self._bounds.scores(outcomes).tolist(), strict=True):
            self._judge(outcome, score)

    def _judge(self, outcome: Outcome, score: float) -> None:
        sort, age = cell = cell_of(outcome)
        shared = int(sort >= STILL), age
        raised_all, raised_own = self._shared[shared[0]], self._own[sort]
        ship = self._ships.get(outcome.mmsi) if sort < STILL else None
        own = 0.0 if ship is None else float(ship[age])
        missed = score > raised_all[age] + raised_own[age] + own
        self._scored[cell] += 1
        self._steps[shared] += 1
        step = RATES[age] / 2 * (missed - (1.0 - self._bounds.level))
        for raised, count in ((raised_all, self._steps[shared]), (raised_own, self._scored[cell])):
            eager = max(EAGER / (1.0 + count / EAGER_FOR), 1.0)
            raised[age] = min(max(raised[age] + eager * step, LOWEST), HIGHEST)
        if sort < STILL and (missed or ship is not None):
            self._judge_ship(outcome, missed)
        if missed:
            self._missed[cell] += 1
            self._misses.append(
                Miss(outcome.at, outcome.mmsi, outcome.age_s, outcome.ahead_m, outcome.aside_m)
            )

    def _judge_ship(self, outcome: Outcome, missed: bool) -> None:
        own = self._ships.pop(outcome.mmsi, None)
        own = np.zeros(len(SPREAD_AGES_S)) if own is None else own
        higher = own[outcome.watch] + SHIP_RATE * (float(missed) - (1.0 - self._bounds.level))
        own[outcome.watch] = min(max(higher, 0.0), SHIP_HIGHEST)
        if own.any():
            self._ships[outcome.mmsi] = own  # the newest last
            if len(self._ships) > MOST_SHIPS:
                del self._ships[next(iter(self._ships))]

    def coverage(self, sorts: Collection[int] = UNDER_WAY, age: int | None = None) -> tuple[float, int]:
        """Share of outcomes inside their sets, and how many there were; NaN for none."""
        self._settle()
        cells = [c for c in self._scored if c[0] in sorts and (age is None or c[1] == age)]
        scored = sum(self._scored[c] for c in cells)
        missed = sum(self._missed[c] for c in cells)
        return (1.0 - missed / scored if scored else float("nan")), scored

    def notes(self, now: Instant) -> list[Reason]:
        """The running coverage, and the newest miss."""
        share, scored = self.coverage()
        at_rest, resting = self.coverage((STILL, SLOW))
        if not scored:
            return []
        wanted = self._bounds.level
        text = f"{100 * share:.1f} % of {scored} forecasts held, wanted {100 * wanted:g} %"
        if resting:
            text += f"; of {resting} of ships at rest {100 * at_rest:.1f} %"
        low = scored >= ENOUGH and share < wanted - SHORTFALL
        notes = [Reason("picture.coverage_low" if low else "note.coverage", text)]
        fresh = [m for m in self._misses if 0.0 <= elapsed_s(m.at, now) <= SHOWN_S]
        if fresh:
            more = f" and {len(fresh) - 1} more" if len(fresh) > 1 else ""
            notes.append(Reason("note.outside_set", fresh[-1].text() + more))
        return notes
