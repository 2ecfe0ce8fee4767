"""The guard: holds a way out at every step, and passes only what leaves one.

At a step at t the wanted velocity would act until the next step's own takes effect: first the last
one sent for the declared delay, then the wanted one for a period.  If from there a way out is found
that stays clear of every ship's set at every time, it is stored and the velocity passes.  Else the
stored one is flown: it was checked for all times when it was found, and time alone takes nothing from it.
Where the water around is free (`berth`), stopping is the way out, and it is rolled out only if it is needed.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from companion.config import Config
from companion.instant import Instant, after, elapsed_s
from companion.messages import AutopilotHeartbeat, OwnState, Reason, Tracks
from companion.planning.creep import creep
from companion.planning.guard.beginning import Beginning, begin
from companion.planning.guard.berth import Berth, to_stop_m
from companion.planning.guard.beside import MOST_M, Beside
from companion.planning.guard.clearance import Clearance
from companion.planning.guard.limits import limited
from companion.planning.guard.margins import Margins
from companion.planning.guard.preconditions import SteadyClock, is_prestream, missing
from companion.planning.guard.search import WAITS_S, Search
from companion.planning.guard.verdict import Velocity, Verdict
from companion.planning.guard.vertical import Dive
from companion.planning.guard.watch import Watch
from companion.planning.guard.way_out import WayOut
from companion.reach import Slices
from companion.reach.kernel import Kernel, nearest

CHANGE_TOLERANCE_MPS = 1e-6  # below this a velocity counts as let through unchanged
SEARCH_AGAIN_S = 0.4  # after a search found nothing


class Guard:
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
        self._searched_at: Instant | None = None
        self._waits = 0  # searches in vain

    def check(
        self,
        now: Instant,
        own: OwnState | None,
        heartbeat: AutopilotHeartbeat | None,
        tracks: Tracks,
        reports_heard: int,
        wanted_ned_mps: Velocity | None,
    ) -> Verdict:
        """Judge one wanted velocity (NED, m/s)."""
        reasons = self._clock.missing(now)
        if is_prestream(now, heartbeat, self._config.autopilot):
            self._hands_off()
            text = "zero velocity so that PX4 admits OFFBOARD (autopilot.prestream_offboard)"
            return Verdict((0.0, 0.0, 0.0), False, (Reason("guard.prestream", text),))
        reasons += missing(now, own, heartbeat, reports_heard, self._config.autopilot)
        wanted, unplanned = _finite(wanted_ned_mps)
        if wanted is None and self._way_out is None and self._stopping is None:
            reasons += unplanned
        if reasons or own is None:
            self._hands_off()
            return Verdict(None, False, tuple(reasons + [r for r in unplanned if r not in reasons]))
        reasons += unplanned
        self._take(tracks)
        reasons += self._watch.look(now, own, self._flown, self._sent[:2])
        within, cut = limited(wanted or (0.0, 0.0, 0.0), own, self._config.vehicle)
        reasons += cut
        flown = self._judge(now, own, within, wanted is not None, reasons)
        self._sent = flown
        changed = wanted is None or math.dist(flown, wanted) > CHANGE_TOLERANCE_MPS
        verified = self._way_out is None or self._way_out.verified  # in an empty sea every way is out
        return Verdict(flown, changed, tuple(reasons), verified)

    def _hands_off(self) -> None:
        """We do not steer: what was planned is void."""
        self._way_out = self._flown = self._stopping = self._beside = None
        self._sent = (0.0, 0.0, 0.0)

    def _judge(
        self, now: Instant, own: OwnState, wanted: Velocity, is_wanted: bool, reasons: list[Reason]
    ) -> Velocity:
        """The velocity to fly."""
        self._flown = None
        renewed = self._new_information or self._watch.has_jumped
        if renewed:  # what was proven cheaply was proven of other sets, whatever is wanted now
            self._berth = self._beside = None
        slices = self._slices
        if slices is None or not len(slices):
            self._way_out = self._stopping = None
            return wanted
        if is_wanted and self._lies_free(now, own, slices):
            self._way_out, self._stopping = None, partial(self._stop, now, own, wanted, self._sent)
            self._beside = None
            return wanted
        if is_wanted and self._stays_beside(now, own, wanted):
            return wanted
        if self._stopping is not None:
            self._way_out, self._stopping = self._stopping(), None
        clearance = self._clearance(now, own, wanted[2], slices)
        if clearance.unknown.any():
            text = f"{int(clearance.unknown.sum())} ships silent for too long can be here: holding"
            reasons.append(Reason("guard.unknown_water", text))
            wanted = (*self._creep((0.0, 0.0), own), wanted[2])
        if self._way_out is not None and renewed:
            self._reverify(now, clearance, reasons)
        if is_wanted and self._leaves_a_way_out(now, own, wanted, clearance):
            return wanted
        if self._way_out is None or not self._way_out.verified:
            self._look_for_one(now, own, wanted, clearance)
        elif self._way_out.deviation_m(own) > self._config.guard.tracking_error_m:
            self._anchor_again(now, own, clearance)
        assert self._way_out is not None
        self._flown = self._way_out
        if not self._way_out.verified:
            text = "no way out stays clear of every ship: flying the least bad"
            reasons.append(Reason("guard.no_way_out", text))
        elif is_wanted:
            reasons.append(Reason("guard.way_out", "what is wanted leaves no way out: flying the stored one"))
        guard, limit = self._config.guard, self._config.vehicle.max_speed_mps
        command = self._way_out.command(now, own, guard.setpoint_delay_s, limit)
        down = wanted[2] if self._dive is None else self._dive.command_mps(own.depth_m)
        return (*self._creep(command, own), down)

    def _creep(self, velocity_mps: tuple[float, float], own: OwnState) -> tuple[float, float]:
        """Zero velocity has a direction to a boat, and the guard's own zero is no exception."""
        north, east = creep(np.array(velocity_mps), own, self._config.vehicle)
        return float(north), float(east)

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
        planned = self._search.toward(now, first, verified.end_m, verified.speed_mps, verified.wait_s(now))
        covered = self._beside.covers(planned)
        if covered:
            self._way_out = planned
        return covered

    def _leaves_a_way_out(self, now: Instant, own: OwnState, wanted: Velocity, clearance: Clearance) -> bool:
        """Whether a way out follows after `wanted`; it is then the stored one."""
        first = self._beginning(now, own, self._sent, wanted[:2], self._period_s)
        stored = self._way_out
        self._beside = None
        if stored is not None and stored.verified:
            planned = self._search.toward(now, first, stored.end_m, stored.speed_mps, stored.wait_s(now))
            room_m = self._search.room(planned, now, clearance, MOST_M)
            if room_m.min() > 0:
                self._way_out = planned
                if self._dive is None:  # else what counts depends on how deep it will be
                    self._beside = Beside.of(planned, room_m, after(now, clearance.unchanged_s()))
                return True
        found = None
        if self._may_search(now):
            found, _ = self._search.best(now, first, wanted[:2], clearance, self._wait_s())
            self._searched_at = now if found is None else None
            self._waits = 0 if found is not None else self._waits + 1
        if found is not None:
            self._way_out = found
        return found is not None

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
        found = self._search.toward(now, first, stored.end_m, stored.speed_mps, stored.wait_s(now))
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

    def _take(self, tracks: Tracks) -> None:
        """The picture of this step."""
        self._new_information = self._slices is not None and self._slices.tracks is not tracks
        if self._slices is None or self._new_information:
            if self._slices is not None:
                self._watch.compare(self._slices.tracks, tracks)
            self._slices = Slices.of(tracks, self._kernel)


def _finite(wanted: Velocity | None) -> tuple[Velocity | None, list[Reason]]:
    if wanted is None:
        return None, [Reason("guard.no_plan", "the planner gave no velocity")]
    if not all(map(math.isfinite, wanted)):
        return None, [Reason("guard.plan_invalid", "the planner's velocity is no number")]
    return wanted, []
