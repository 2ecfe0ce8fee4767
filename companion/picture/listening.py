"""When a report could have come at all: an antenna under water hears nothing, and that is nobody's loss.

Silence while we listened says that a ship is out of range, or its transponder or ours off; silence under
water says nothing.  Ages run on either way: a set grows whether we could have heard of it or not.
"""

from collections import deque

from companion.instant import Instant, elapsed_s
from companion.messages import OwnPosition

MOST_DIVES = 64


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


def _overlap_s(dive: tuple[Instant, Instant], since: Instant, now: Instant) -> float:
    return max(elapsed_s(max(dive[0], since), min(dive[1], now)), 0.0)
