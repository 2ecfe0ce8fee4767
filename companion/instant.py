"""Time as an argument.

An `Instant` is an integer number of nanoseconds on the clock of whoever owns time: the live
source's monotonic clock, a simulated world, or a recorded log.  Durations are float seconds.
Integers keep replays bit-exact; nothing in the core ever asks what time it is.
"""

from typing import NewType

Instant = NewType("Instant", int)

NS_PER_S = 1_000_000_000


def instant(seconds: float) -> Instant:
    """The instant `seconds` after the clock's zero."""
    return Instant(round(seconds * NS_PER_S))


def after(t: Instant, seconds: float) -> Instant:
    """The instant `seconds` (may be negative) after `t`."""
    return Instant(t + round(seconds * NS_PER_S))


def elapsed_s(since: Instant, now: Instant) -> float:
    """Seconds from `since` to `now`; negative when `now` comes first."""
    return (now - since) / NS_PER_S
