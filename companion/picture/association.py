"""One ship, one number, and yet perhaps two places: which of them does a report belong to?

A report that the gate refuses is neither believed nor dropped: it opens a second *hypothesis*
beside the known one, and both get a row in the tracks until the ship's own later reports decide.

    one report                 tracked at once (waiting for a second would be silence)
    refused by all             a suspect: quarantined, kept beside what was known
    suspect, second report     confirmed; the old place is given up after `GIVE_UP` reports elsewhere
    older than what is known   left out if the ship can have come from there, else a suspect too
    old place goes on          the suspect is refuted after `REFUTE` reports elsewhere
    a place comes back         after another one was confirmed: two ships share the number, or one
                               is forged; from then on every place is kept

A refuted place is remembered as the `ghost`, without a row, so that a rare second sender under a
busy number is recognised when it speaks again.
"""

from dataclasses import dataclass, field
from enum import StrEnum

from msgspec.structs import replace

from companion.instant import Instant
from companion.messages import ContactReport
from companion.picture.forecast import History
from companion.picture.plausibility import Gate, Judgement
from companion.picture.reports import same_measurement
from companion.picture.straight_filter import Motion

REFUTE = 2
GIVE_UP = 3
MOST_PLACES = 4


class Placement(StrEnum):
    """What became of a report with a position; the values are the keys of `Picture.counts`."""

    FIRST = "picture.first"
    CONTINUED = "picture.continued"
    CONFIRMED = "picture.jump_confirmed"
    QUARANTINED = "picture.quarantined"
    DUPLICATE = "picture.duplicate"
    OLDER = "picture.older"


@dataclass(slots=True, eq=False)
class Hypothesis:
    """One place where the ship may be: its newest fix, reports from there, reports from elsewhere since."""

    motion: Motion
    hits: int = 1
    elsewhere: int = 0
    history: History | None = None  # while somebody watches

    @property
    def suspect(self) -> bool:
        """Told by one report only."""
        return self.hits == 1

    @property
    def report(self) -> ContactReport:
        """The newest report believed of it."""
        return self.motion.report


@dataclass(slots=True, eq=False)
class Places:
    """The hypotheses of one MMSI, oldest first."""

    held: list[Hypothesis] = field(default_factory=list)
    ghost: Hypothesis | None = None
    shared: bool = False  # two senders under one number
    newest: Hypothesis | None = None  # the one that took the last report

    def follow(self, report: ContactReport, gate: Gate) -> bool:
        """Take a report with a position if the only place foretold it; else say no and do nothing."""
        if len(self.held) != 1 or self.ghost is not None:
            return False
        only = self.held[0]
        motion = only.motion
        known = motion.report
        if known.measured_at >= report.measured_at or same_measurement(known, report):
            return False
        after = gate.follow(motion, report)
        if after is None:
            return False
        only.motion = after
        self.newest = only
        only.hits += 1
        only.elsewhere = 0
        return True

    def take(self, report: ContactReport, gate: Gate) -> Placement:
        """Place any report that has a position."""
        if not self.held:
            self.held.append(Hypothesis(gate.begin(report)))
            self.newest = self.held[0]
            return Placement.FIRST
        if any(same_measurement(h.report, report) for h in self.held):
            return Placement.DUPLICATE
        earlier = [h for h in self._known() if h.report.measured_at < report.measured_at]
        judged = [(gate.judge(h.motion, report), h) for h in earlier]
        # the ghost comes last: its uncertainty grows until it could explain every report
        fitting = [(h is self.ghost, j.surprise, i) for i, (j, h) in enumerate(judged) if j.plausible]
        if fitting:
            return self._continue(*judged[min(fitting)[-1]])
        later = [h.report for h in self.held if h.report.measured_at >= report.measured_at]
        if any(gate.can_lead_to(report, known) for known in later):
            return Placement.OLDER
        self._suspect(Hypothesis(gate.begin(report)))
        return Placement.QUARANTINED

    def move_clock(self, step_ns: int) -> None:
        """The source's clock was set: all that is known happened `step_ns` later on the new one."""
        for place in self._known():
            report = place.report
            moved = replace(
                report,
                received_at=Instant(report.received_at + step_ns),
                measured_at=Instant(report.measured_at + step_ns),
            )
            place.motion = replace(place.motion, report=moved)
            if place.history is not None:
                place.history.move_clock(step_ns)

    def _known(self) -> list[Hypothesis]:
        return [*self.held, self.ghost] if self.ghost else self.held

    def _continue(self, judgement: Judgement, hit: Hypothesis) -> Placement:
        was_suspect = hit.suspect
        others = [h for h in self.held if h is not hit]
        if hit.elsewhere and any(not h.suspect for h in others if h.elsewhere < hit.elsewhere):
            self.shared = True
        hit.motion = judgement.motion
        self.newest = hit
        hit.hits += 1
        hit.elsewhere = 0
        if hit is self.ghost:
            self.ghost = None
            self.held.append(hit)
        for other in others:
            other.elsewhere += 1
        if not self.shared:
            self._give_up(hit)
        self._limit()
        return Placement.CONFIRMED if was_suspect and others else Placement.CONTINUED

    def _suspect(self, new: Hypothesis) -> None:
        for other in self.held:
            other.elsewhere += 1
        self.held.append(new)
        self.newest = new
        self._limit()

    def _give_up(self, hit: Hypothesis) -> None:
        for other in list(self.held):
            if other is hit or hit.suspect:
                continue
            if other.elsewhere >= (REFUTE if other.suspect else GIVE_UP):
                self.held.remove(other)
                self.ghost = other

    def _limit(self) -> None:
        """Never more than `MOST_PLACES`: the suspect longest unheard goes first, then the place."""
        while len(self.held) > MOST_PLACES:
            suspects = [h for h in self.held[:-1] if h.suspect] or self.held[:-1]
            gone = max(suspects, key=lambda h: h.elsewhere)
            self.held.remove(gone)
            self.ghost = gone
