"""Keeps a way out from step to step: proves it again after what is wanted, or looks for another.

The proofs come cheapest first: free water around (`berth`), nearness to a path verified in full (`beside`),
the stored way out again, what the planner intends, and a search.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from companion.config import Config
from companion.instant import Instant, after, elapsed_s
from companion.messages import OwnState, Reason, Tracks
from companion.planning.guard.beginning import Beginning, begin
from companion.planning.guard.berth import Berth, to_stop_m
from companion.planning.guard.beside import MOST_M, Beside
from companion.planning.guard.clearance import Clearance
from companion.planning.guard.intended import Intended
from companion.planning.guard.margins import Margins
from companion.planning.guard.preconditions import SteadyClock
from companion.planning.guard.search import WAITS_S, Search
from companion.planning.guard.verdict import Velocity
from companion.planning.guard.vertical import Dive
from companion.planning.guard.watch import Watch
from companion.planning.guard.way_out import WayOut
from companion.reach import Slices
from companion.reach.kernel import Kernel, nearest

SEARCH_AGAIN_S = 0.4  # after a search found nothing


class Keeper:
    """Keeps the way out, the last velocity sent and what the assumptions' watch has seen."""

    def __init__(self, config: Config, kernel: Kernel = nearest) -> None:
        self._config = config
        self._kernel = kernel
        speed = max(config.vehicle.max_speed_mps - config.guard.current_mps, 0.1)
        self._search = Search(config.vehicle, speed, config.guard.way_out_s)
        self._clock = SteadyClock()
        self._watch = Watch(config)
        self._period_s = 1.0 / config.timing.rate_hz
        self._slices: Slices | None = None
        self._new_information = False
        self._way_out: WayOut | None = None
        self._flown: WayOut | None = None  # the way out if the last step flew it
        self._berth: Berth | None = None
        self._beside: Beside | None = None
        self._stopping: Callable[[], WayOut] | None = None  # the way out, not rolled out yet
        self._dive: Dive | None = None
        self._sent: Velocity = (0.0, 0.0, 0.0)
        self._told: Intended | None = None
        self._intended: Intended | None = None  # what is intended, until it has been looked at
        self._searched_at: Instant | None = None
        self._waits = 0  # searches in vain

    @property
    def lies_free(self) -> bool:
        """Whether stopping was a way out at the last step: nobody need know what is intended."""
        return self._stopping is not None

    def _hands_off(self) -> None:
        """We do not steer: what was planned is void."""
        self._way_out = self._flown = self._stopping = self._beside = self._told = self._intended = None
        self._sent = (0.0, 0.0, 0.0)

    def _lies_free(self, now: Instant, own: OwnState, slices: Slices) -> bool:
        """Whether stopping is a way out, whatever is flown for a period."""
        needed_m = to_stop_m(now, own, self._config)
        berth = self._berth
        if berth is None or (not berth.holds(now, own, needed_m) and berth.may_be_better(now, own, needed_m)):
            self._berth = berth = Berth.around(own, slices, now, self._margins(now), self._config)
        return berth.holds(now, own, needed_m)

    def _stop(self, now: Instant, own: OwnState, wanted: Velocity, sent: Velocity) -> WayOut:
        """Stopping after `wanted`, as seen at `now`."""
        return self._search.stop(now, self._beginning(now, own, sent, wanted[:2], self._period_s))

    def _margins(self, now: Instant) -> Margins:
        return Margins.of(self._config, self._watch.submerged_s(now), self._watch.unexplained_m)

    def _clearance(self, now: Instant, own: OwnState, down_mps: float, slices: Slices) -> Clearance:
        """What to check against."""
        config = self._config
        self._dive = None
        if config.guard.vertical == "clear_below":
            self._dive = Dive.of(config, slices.tracks, own, (down_mps, self._sent[2]))
        limit, lookahead = config.vehicle.max_speed_mps, config.guard.lookahead_s
        return Clearance(slices, now, self._margins(now), limit, lookahead, own.position_m, self._dive)

    def _stays_beside(self, now: Instant, own: OwnState, wanted: Velocity) -> bool:
        """Whether the way out after `wanted` is so near to one verified in full that it is verified too."""
        if self._beside is None:
            return False
        verified = self._beside.way_out
        first = self._beginning(now, own, self._sent, wanted[:2], self._period_s)
        planned = self._search.again(now, first, verified)
        covered = self._beside.covers(planned)
        if covered:
            self._way_out = planned
        return covered

    def _leaves_a_way_out(self, now: Instant, own: OwnState, wanted: Velocity, clearance: Clearance) -> bool:
        """Whether a way out follows after `wanted`; it is then the stored one."""
        first = self._beginning(now, own, self._sent, wanted[:2], self._period_s)
        self._beside = None
        intended, self._intended = self._intended, None
        none = self._way_out is None or not self._way_out.verified
        for planned in self._known(now, first, intended, clearance):
            room_m = self._search.room(planned, now, clearance, MOST_M)
            if room_m.min() > 0:
                self._way_out = planned
                if self._dive is None:  # else what counts depends on how deep it will be
                    self._beside = Beside.of(planned, room_m, after(now, clearance.unchanged_s()))
                return True
        found = None
        if (none or intended is None) and self._may_search(now):  # with one to fly, one of the two will do
            found, _ = self._search.best(now, first, wanted[:2], clearance, self._wait_s())
            self._searched_at = now if found is None else None
            self._waits = 0 if found is not None else self._waits + 1
        if found is not None:
            self._way_out = found
        return found is not None

    def _known(
        self, now: Instant, first: Beginning, intended: Intended | None, clearance: Clearance
    ) -> Iterator[WayOut]:
        """Ways out that need no search: what is newly intended, then the stored one."""
        stored = self._way_out
        if intended is not None:
            course = self._search.course(now, first, intended, clearance)
            if course is not None:
                yield course
        if stored is not None and stored.verified:
            yield self._search.again(now, first, stored)

    def _wait_s(self) -> float:
        """A run at once and runs after waiting, in turns: one search a step has to do."""
        return 0.0 if self._waits % 2 == 0 else WAITS_S[self._waits // 2 % len(WAITS_S)]

    def _may_search(self, now: Instant) -> bool:
        return self._searched_at is None or elapsed_s(self._searched_at, now) >= SEARCH_AGAIN_S - 1e-6

    def _look_for_one(self, now: Instant, own: OwnState, wanted: Velocity, clearance: Clearance) -> None:
        """Replace a way out that is none, from where the vehicle is now."""
        if self._way_out is not None and not self._may_search(now) and self._searched_at != now:
            return
        self._searched_at = now
        first = self._beginning(now, own, self._sent, wanted[:2], 0.0)
        found, least_bad = self._search.best(now, first, wanted[:2], clearance)
        self._way_out = least_bad if found is None else found

    def _anchor_again(self, now: Instant, own: OwnState, clearance: Clearance) -> None:
        """The vehicle is not where it should be: the same way out from here, if it is clear."""
        stored = self._way_out
        assert stored is not None
        first = self._beginning(now, own, self._sent, stored.velocity_mps, 0.0)
        found = self._search.again(now, first, stored)
        if self._search.is_clear(found, now, clearance):
            self._way_out = found

    def _reverify(self, now: Instant, clearance: Clearance, reasons: list[Reason]) -> None:
        """New reports came: is the stored way out clear of the new sets too?"""
        stored = self._way_out
        if stored is None or not stored.verified or self._search.is_clear(stored, now, clearance):
            return
        if self._watch.is_foretold and not self._watch.has_jumped:
            # the ship is in the old set and in the new one: what was clear of the old set stays so
            reasons.append(Reason("note.guard_older_report", "way out rests on an older report's set"))
            return
        self._way_out = replace(stored, verified=False)

    def _beginning(
        self, now: Instant, own: OwnState, sent: Velocity, command: tuple[float, float], period_s: float
    ) -> Beginning:
        return begin(now, own, sent[:2], command, period_s, self._config)

    def _hear(self, intended: Intended | None) -> None:
        """What the planner means to do, looked at once."""
        if intended is not self._told:
            self._told = intended
            self._intended = intended if intended is not None and intended.is_sound else None

    def _take(self, tracks: Tracks) -> None:
        """The picture of this step."""
        self._new_information = self._slices is not None and self._slices.tracks is not tracks
        if self._slices is None or self._new_information:
            if self._slices is not None:
                self._watch.compare(self._slices.tracks, tracks)
            self._slices = Slices.of(tracks, self._kernel)
