"""Several receivers tell where we are: one is followed, all are watched.

Of the receivers of one source (the talkers of a bus, say) the one followed is, in this order: fresh, with a
velocity, with a heading, and of the lowest address; it is kept as long as it stays fresh.  The others are
held against it.  Receivers of different sources are not compared: in a replay the autopilot's vehicle and
the ship that recorded the bus are not the same.
"""

from companion.geodesy import wrap_pi
from companion.instant import Instant, elapsed_s
from companion.messages import OwnPosition, Reason, Source
from companion.picture.area import distance_m

FRESH_S = 2.0
APART_M, TURNED_RAD, EVIDENCE = 50.0, 0.35, 5  # metres, 20 degrees; positions in a row
SHOWN_S = 10.0
MOST_TALKERS = 64


class OwnSources:
    """The newest position of every receiver, and the one followed of each source."""

    def __init__(self) -> None:
        self._newest: dict[tuple[Source, int], OwnPosition] = {}
        self._followed: dict[Source, int] = {}
        self._apart: dict[tuple[Source, int], int] = {}
        self._doubts: dict[tuple[Source, int], tuple[Instant, str]] = {}

    def observe(self, own: OwnPosition) -> bool:
        """Take a position; whether it is the one to follow."""
        key = own.source, own.talker
        before = self._newest.get(key)
        if before is None and len(self._newest) >= MOST_TALKERS:
            return False
        self._newest[key] = own
        followed = self._newest.get((own.source, self._followed.get(own.source, -1)))
        if followed is None or not 0.0 <= elapsed_s(followed.stamp, own.stamp) <= FRESH_S:
            fresh = [
                o
                for (source, _), o in self._newest.items()
                if source is own.source and abs(elapsed_s(o.stamp, own.stamp)) <= FRESH_S
            ]
            followed = min(fresh, key=_rank)
            self._followed[own.source] = followed.talker
        if followed.talker == own.talker:
            return True
        self._compare(key, followed, own)
        return False

    def doubts(self, now: Instant) -> list[Reason]:
        """Receivers that lately disagreed with the one followed."""
        texts = [text for at, text in self._doubts.values() if 0.0 <= elapsed_s(at, now) <= SHOWN_S]
        return [Reason("own.sources_disagree", "; ".join(sorted(texts)[:3]))] if texts else []

    def _compare(self, key: tuple[Source, int], followed: OwnPosition, own: OwnPosition) -> None:
        off_m = distance_m(followed.latitude_deg, followed.longitude_deg, own.latitude_deg, own.longitude_deg)
        speed = followed.velocity_ned_mps or (0.0, 0.0, 0.0)
        slack_m = FRESH_S * (speed[0] ** 2 + speed[1] ** 2) ** 0.5
        turned = 0.0
        if followed.heading_rad is not None and own.heading_rad is not None:
            turned = abs(wrap_pi(own.heading_rad - followed.heading_rad))
        apart = off_m > APART_M + slack_m or turned > TURNED_RAD
        self._apart[key] = self._apart.get(key, 0) + 1 if apart else 0
        if self._apart[key] >= EVIDENCE:
            said = f"{off_m:.0f} m" if off_m > APART_M + slack_m else f"{turned:.2f} rad of heading"
            text = f"own position of {own.source.value} {own.talker} is {said} from {followed.talker}'s"
            self._doubts[key] = own.stamp, text


def _rank(own: OwnPosition) -> tuple[bool, bool, int]:
    return own.velocity_ned_mps is None, own.heading_rad is None, own.talker
