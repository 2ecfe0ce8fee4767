"""The guard: holds a way out at every step, and passes only what leaves one.

At a step at t the wanted velocity would act until the next step's own takes effect: first the last
one sent for the declared delay, then the wanted one for a period.  If from there a way out is found
that stays clear of every ship's set at every time, it is stored and the velocity passes.  Else the
stored one is flown: it was checked for all times when it was found, and time alone takes nothing from it.
Where the water around is free (`berth`), stopping is the way out, and it is rolled out only if it is needed.
"""

import math
from functools import partial

import numpy as np

from companion.instant import Instant
from companion.messages import AutopilotHeartbeat, OwnState, Reason, Tracks
from companion.planning.creep import creep
from companion.planning.guard.intended import Intended
from companion.planning.guard.keeper import Keeper
from companion.planning.guard.limits import limited
from companion.planning.guard.preconditions import is_prestream, missing
from companion.planning.guard.verdict import Velocity, Verdict

CHANGE_TOLERANCE_MPS = 1e-6  # below this a velocity counts as let through unchanged


class Guard(Keeper):
    """Says what is flown: what is wanted, or the way out that is kept."""

    def check(
        self,
        now: Instant,
        own: OwnState | None,
        heartbeat: AutopilotHeartbeat | None,
        tracks: Tracks,
        reports_heard: int,
        wanted_ned_mps: Velocity | None,
        intended: Intended | None = None,
    ) -> Verdict:
        """Judge one wanted velocity (NED, m/s).

        `intended`: what the planner means to do after it, where that is known; it is one more way out to look
        at, and nothing of it is believed.
        """
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
        self._hear(intended)
        reasons += self._watch.look(now, own, self._flown, self._sent[:2])
        within, cut = limited(wanted or (0.0, 0.0, 0.0), own, self._config.vehicle)
        reasons += cut
        flown = self._judge(now, own, within, wanted is not None, reasons)
        self._sent = flown
        changed = wanted is None or math.dist(flown, wanted) > CHANGE_TOLERANCE_MPS
        verified = self._way_out is None or self._way_out.verified  # in an empty sea every way is out
        return Verdict(flown, changed, tuple(reasons), verified)

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
        if is_wanted and self._intended is None and self._stays_beside(now, own, wanted):
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


def _finite(wanted: Velocity | None) -> tuple[Velocity | None, list[Reason]]:
    if wanted is None:
        return None, [Reason("guard.no_plan", "the planner gave no velocity")]
    if not all(map(math.isfinite, wanted)):
        return None, [Reason("guard.plan_invalid", "the planner's velocity is no number")]
    return wanted, []
