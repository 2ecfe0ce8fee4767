"""When a report could have come at all: an antenna under water hears nothing, and that is nobody's loss.

Silence while we listened says that a ship is out of range, or its transponder or ours off; silence under
water says nothing.  Ages run on either way: a set grows whether we could have heard of it or not.
"""

from collections import deque
from collections.abc import Iterable

from companion.instant import Instant, elapsed_s
from companion.messages import OwnPosition, Reason
from companion.picture.ageing import REST_MPS
from companion.picture.contact import Contact

MOST_DIVES = 64
SILENT_S = 180.0
LOOK_S = 1.0
_NAMED = 3


class Listening:
    """Our dives, from our own depth."""

    def __init__(self, surfaced_depth_m: float) -> None:
        self._surfaced_depth_m = surfaced_depth_m
        self._dives: deque[tuple[Instant, Instant]] = deque(maxlen=MOST_DIVES)  # ended ones
        self._under_since: Instant | None = None
        self._last: Instant | None = None

    def observe_own(self, own: OwnPosition) -> None:
        """Take a position; one without a depth says nothing."""
        if own.depth_m is None:
            return
        if self._last is not None and own.stamp < self._last:
            self._dives.clear()  # the clock was set back
            self._under_since = None
        self._last = own.stamp
        under = own.depth_m > self._surfaced_depth_m
        if under and self._under_since is None:
            self._under_since = own.stamp
        elif not under and self._under_since is not None:
            self._dives.append((self._under_since, own.stamp))
            self._under_since = None

    def is_deaf(self) -> bool:
        """Under water, as far as known."""
        return self._under_since is not None

    def listened_s(self, since: Instant, now: Instant) -> float:
        """Seconds between two instants in which a report could have come."""
        deaf_s = sum(_overlap_s(dive, since, now) for dive in self._dives)
        if self._under_since is not None:
            deaf_s += _overlap_s((self._under_since, now), since, now)
        return max(elapsed_s(since, now) - deaf_s, 0.0)


class Silence:
    """Who fell silent while we listened; when it is everybody, our receiver may be dead."""

    def __init__(self, listening: Listening) -> None:
        self._listening = listening
        self._looked: Instant | None = None
        self._told: list[Reason] = []

    def silent(self, contacts: Iterable[Contact], now: Instant) -> list[int]:
        """The ships under way not heard of for `SILENT_S` in which we listened, in MMSI order."""
        gone = []
        for contact in contacts:
            held = contact.places.held
            if held and (held[-1].report.sog_mps or 0.0) > REST_MPS and not contact.echo.hides(now):
                since = held[-1].report.measured_at
                if elapsed_s(since, now) > SILENT_S and self._listening.listened_s(since, now) > SILENT_S:
                    gone.append(contact.mmsi)
        return sorted(gone)

    def notes(self, contacts: Iterable[Contact], last_heard: Instant | None, now: Instant) -> list[Reason]:
        """Looked up once in `LOOK_S`."""
        if self._looked is None or not 0.0 <= elapsed_s(self._looked, now) < LOOK_S:
            self._looked = now
            self._told = self._look(contacts, last_heard, now)
        return self._told

    def _look(self, contacts: Iterable[Contact], last_heard: Instant | None, now: Instant) -> list[Reason]:
        found = []
        if self._listening.is_deaf():
            found.append(
                Reason("note.deaf", "the antenna is under water: no report can come, none is missed")
            )
        gone = self.silent(contacts, now)
        if gone:
            more = f" and {len(gone) - _NAMED} more" if len(gone) > _NAMED else ""
            named = ", ".join(str(mmsi) for mmsi in gone[:_NAMED]) + more
            found.append(Reason("note.silent", f"not heard for {SILENT_S:.0f} s of listening: {named}"))
        if gone and last_heard is not None and self._listening.listened_s(last_heard, now) > SILENT_S:
            text = f"nothing was heard of anybody for {SILENT_S:.0f} s of listening: is the receiver alive?"
            found.append(Reason("picture.receiver_silent", text))
        return found


def _overlap_s(dive: tuple[Instant, Instant], since: Instant, now: Instant) -> float:
    return max(elapsed_s(max(dive[0], since), min(dive[1], now)), 0.0)
