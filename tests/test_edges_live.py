"""A clock that only moves when it is waited on, and links that speak at given times."""

import os
import select
from collections.abc import Sequence
from itertools import islice, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.edges.live import LinkSink, LiveSource, MonotonicClock
from companion.instant import NS_PER_S, Instant, instant
from companion.loop import Tick
from companion.messages import Frame, Link


class Timeline:
    """Time, what arrives when, and a stop switch.  Also a Clock."""

    def __init__(self, arrivals: Sequence[float] = (), stop_at_s: float = 1e6) -> None:
        self.t = instant(1.0)
        self.arrivals = sorted(instant(1.0 + s) for s in arrivals)
        self.stop_at = instant(1.0 + stop_at_s)
        self.waited_on: list[int] = []

    def now(self) -> Instant:
        return self.t

    def wait(self, readers: Sequence[int], until: Instant) -> None:
        self.waited_on = list(readers)
        coming = [t for t in (*self.arrivals, self.stop_at) if t > self.t]
        self.t = min([until, *coming]) if readers else until

    def is_set(self) -> bool:
        return self.t >= self.stop_at


class FakeLink:
    """Each arrival is one datagram that says when it was due."""

    def __init__(self, timeline: Timeline, fd: int = 3) -> None:
        self._timeline = timeline
        self._fd = fd
        self.sent: list[bytes] = []

    def fileno(self) -> int:
        return self._fd

    def receive(self) -> list[bytes]:
        due = [t for t in self._timeline.arrivals if t <= self._timeline.t]
        del self._timeline.arrivals[: len(due)]
        return [str(t).encode() for t in due]

    def send(self, data: bytes) -> None:
        self.sent.append(data)


class FakeCan:
    """One frame at every look."""

    def fileno(self) -> int:
        return -1

    def receive(self) -> list[tuple[int, bytes]]:
        return [(0x09F80114, b"can")]


def source(timeline: Timeline, rate_hz: float = 10.0) -> LiveSource:
    return LiveSource(FakeLink(timeline), [], rate_hz, clock=timeline, stop=timeline)


def test_ticks_come_at_the_rate_without_drift() -> None:
    ticks = list(islice(source(Timeline(), rate_hz=3.0), 3000))
    assert [tick.t for tick in ticks] == [instant(1.0) + round(k * NS_PER_S / 3) for k in range(1, 3001)]


def test_frames_are_stamped_when_they_arrive_and_belong_to_the_next_tick() -> None:
    timeline = Timeline([0.01, 0.02, 0.15, 0.31])
    ticks = list(islice(source(timeline), 4))
    assert [[frame.stamp for frame in tick.frames] for tick in ticks] == [
        [instant(1.01), instant(1.02)],
        [instant(1.15)],
        [],
        [instant(1.31)],
    ]
    first = ticks[0].frames[0]
    assert first == Frame(instant(1.01), Link.MAVLINK, str(instant(1.01)).encode())


def test_a_bus_that_cannot_be_waited_on_is_looked_at_every_tick() -> None:
    timeline = Timeline()
    live = LiveSource(FakeLink(timeline), [FakeCan()], 10.0, clock=timeline, stop=timeline)
    for tick in islice(live, 5):
        assert Frame(tick.t, Link.CAN, b"can", 0x09F80114) in tick.frames
        assert timeline.waited_on == [3]


def test_a_slow_step_leaves_ticks_out_counts_them_and_keeps_the_beat() -> None:
    timeline = Timeline()
    live = source(timeline)
    ticks: list[Tick] = []
    for tick in islice(live, 6):
        ticks.append(tick)
        if len(ticks) == 2:
            timeline.t = Instant(timeline.t + 350_000_000)  # the step took 0.35 s
    seconds = [(tick.t - instant(1.0)) / NS_PER_S for tick in ticks]
    assert seconds == pytest.approx([0.1, 0.2, 0.55, 0.6, 0.7, 0.8])
    assert live.skipped == 2


@given(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=30), st.sampled_from([1.0, 10.0, 33.0]))
def test_whatever_the_steps_take_time_only_grows_and_no_tick_is_early(
    steps_s: list[float], rate_hz: float
) -> None:
    timeline = Timeline()
    live = source(timeline, rate_hz)
    ticks = []
    for step_s, tick in zip(steps_s, live, strict=False):
        ticks.append(tick)
        timeline.t = Instant(timeline.t + round(step_s * NS_PER_S))
    for number, (earlier, later) in enumerate(pairwise(ticks), 2):
        assert earlier.t < later.t
        assert later.t >= instant(1.0) + round(number * NS_PER_S / rate_hz)
    beats = (ticks[-1].t - instant(1.0)) * rate_hz / NS_PER_S
    assert abs(len(ticks) + live.skipped - beats) < 1 + 1e-6  # the last one may be late by less than a beat


def test_no_frame_is_lost_or_later_than_its_tick() -> None:
    arrivals = [0.013 * k for k in range(1, 200)]
    timeline = Timeline(arrivals)
    live = source(timeline)
    heard = []
    for k, tick in enumerate(islice(live, 28)):
        assert all(frame.stamp <= tick.t for frame in tick.frames)
        heard += [int(frame.data) for frame in tick.frames]
        if k % 5 == 0:
            timeline.t = Instant(timeline.t + 130_000_000)
    assert heard == [instant(1.0 + s) for s in arrivals]


def test_it_ends_when_it_is_told_to_stop_without_one_more_tick() -> None:
    timeline = Timeline(stop_at_s=0.55)
    assert [round((tick.t - instant(1.0)) / 1e9, 6) for tick in source(timeline)] == [0.1, 0.2, 0.3, 0.4, 0.5]


def test_an_expired_setpoint_is_not_sent_and_counted() -> None:
    timeline = Timeline()
    link = FakeLink(timeline)
    sink = LinkSink(link, timeline)
    sink.send(instant(1.0), b"in time", instant(1.5))
    timeline.t = instant(1.6)
    sink.send(instant(1.0), b"too late", instant(1.5))
    sink.send(instant(1.0), b"heartbeat", None)
    sink.send(instant(1.7), b"decided after it expired", instant(1.65))
    assert link.sent == [b"in time", b"heartbeat"]
    assert sink.counts["sink.expired"] == 2


def test_the_monotonic_clock_runs_faster_by_its_speedup_and_waits_shorter() -> None:
    clock = MonotonicClock(speedup=1000.0)
    start = clock.now()
    clock.wait([], Instant(start + 20 * NS_PER_S))
    assert 20.0 <= (clock.now() - start) / NS_PER_S < 4000.0


def test_the_monotonic_clock_returns_as_soon_as_there_is_input() -> None:
    reading, writing = os.pipe()
    try:
        os.write(writing, b"x")
        clock = MonotonicClock()
        clock.wait([reading], instant(3600.0))
        assert clock.now() < instant(60.0)
        assert select.select([reading], [], [], 0)[0]
        clock.wait([reading], instant(-1.0))
    finally:
        os.close(reading)
        os.close(writing)
    clock.wait([reading], Instant(clock.now() + 1_000_000))  # closed meanwhile: no exception
