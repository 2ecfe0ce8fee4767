"""Where our own platforms were: a bounded ring of positions for each source."""

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import NamedTuple

from companion.instant import Instant, after, elapsed_s
from companion.messages import OwnPosition

_SAMPLE_GAP_S = 0.2
_STALE_S = 2.0
_SAMPLES = 400


class Place(NamedTuple):
    """A platform at one instant; the speed is None where the source has none."""

    latitude_deg: float
    longitude_deg: float
    speed_mps: float | None


@dataclass(slots=True)
class Trail:
    """One platform's samples, strictly later each."""

    stamps: list[Instant] = field(default_factory=list)
    samples: list[OwnPosition] = field(default_factory=list)

    def add(self, own: OwnPosition) -> None:
        """Take a position; more often than needed they are thinned."""
        if self.stamps and own.stamp < self.stamps[-1]:
            self.stamps.clear()  # the clock was set back: what went before means nothing now
            self.samples.clear()
        if self.stamps and elapsed_s(self.stamps[-1], own.stamp) < _SAMPLE_GAP_S:
            return
        self.stamps.append(own.stamp)
        self.samples.append(own)
        if len(self.stamps) > _SAMPLES:
            del self.stamps[: _SAMPLES // 2], self.samples[: _SAMPLES // 2]

    def at(self, t: Instant, error_s: float) -> Place | None:
        """The place at `t`, or as near to `t` as its error allows; None when no sample is near in time."""
        if not self.stamps:
            return None
        t = _drawn_to(t, error_s, self.stamps[0], self.stamps[-1])
        i = bisect_left(self.stamps, t)
        near = [s for s in self.samples[max(i - 1, 0) : i + 1] if abs(elapsed_s(s.stamp, t)) <= _STALE_S]
        if not near:
            return None
        before, behind = near[0], near[-1]
        span_s = elapsed_s(before.stamp, behind.stamp)
        if span_s <= 0.0 or abs(behind.longitude_deg - before.longitude_deg) > 180.0:
            return Place(behind.latitude_deg, behind.longitude_deg, _speed_mps(behind))
        part = elapsed_s(before.stamp, t) / span_s
        return Place(
            before.latitude_deg + part * (behind.latitude_deg - before.latitude_deg),
            before.longitude_deg + part * (behind.longitude_deg - before.longitude_deg),
            _speed_mps(behind),
        )


def _drawn_to(t: Instant, error_s: float, first: Instant, last: Instant) -> Instant:
    """The instant within `error_s` of `t` that is nearest to [first, last], and to `t` inside it."""
    if t < first:
        return min(first, after(t, error_s))
    return max(last, after(t, -error_s)) if t > last else t


def _speed_mps(own: OwnPosition) -> float | None:
    if own.velocity_ned_mps is None:
        return None
    north, east, _ = own.velocity_ned_mps
    return float((north**2 + east**2) ** 0.5)
