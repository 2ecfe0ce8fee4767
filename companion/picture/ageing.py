"""What the age of a contact's last report means.  Nothing is ever forgotten by time.

    fresh       heard within what its transponder's own interval allows for
    coasting    late: its set grows as recorded or configured
    stale       beyond half of its bounds' validity: the set is large
    unbounded   beyond its validity: it may do anything up to its top speed, and closes the water

A track ends in two ways only: its whole set has left the area of interest (it gets no row until it could
have come back), or the operator says so.
"""

from enum import StrEnum

from companion.instant import Instant
from companion.messages import Tracks

FRESH_S = 60.0  # three times the slowest interval under way of a class A, twice that of a class B
FRESH_AT_REST_S = 400.0  # at anchor or moored: every 3 minutes (ITU-R M.1371, table 1), and one lost
REST_MPS = 1.5  # 3 knots, where the interval changes


class AgeState(StrEnum):
    """How old a contact's information is, in words."""

    FRESH = "fresh"
    COASTING = "coasting"
    STALE = "stale"
    UNBOUNDED = "unbounded"


def age_states(tracks: Tracks, now: Instant) -> list[AgeState]:
    """One for each row."""
    rows = zip(tracks.age_s(now), tracks.validity_s, tracks.sog_mps, strict=True)
    return [age_state(float(age), float(valid), float(sog)) for age, valid, sog in rows]


def age_state(age_s: float, validity_s: float, sog_mps: float) -> AgeState:
    """The state of a contact reported `age_s` ago at `sog_mps`."""
    if age_s > validity_s:
        return AgeState.UNBOUNDED
    if age_s <= min(FRESH_AT_REST_S if sog_mps < REST_MPS else FRESH_S, validity_s):
        return AgeState.FRESH
    return AgeState.STALE if age_s > validity_s / 2 else AgeState.COASTING
