"""NMEA 2000 frames that are cut, damaged, lost or random."""

import math
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from companion.instant import instant
from companion.messages import (
    ContactReport,
    Frame,
    Heard,
    Link,
    OwnPosition,
)
from companion.utc import UtcClock
from companion.wire.nmea2000 import Nmea2000Decoder
from tests.bus_messages import (
    AIS_PGNS,
    OTHER_PGNS,
    Recording,
    clock_at,
    hear,
    sides,
)

WANTED_IDS = st.sampled_from([pgn << 8 | 7 for pgn in (*AIS_PGNS, *OTHER_PGNS, 126992, 129033)])


def assert_sane(heard: Heard) -> None:
    if isinstance(heard, ContactReport):
        assert 0 <= heard.mmsi < 2**30
        assert heard.measured_at <= heard.received_at
        for value, low, high in (
            (heard.latitude_deg, -90, 90),
            (heard.longitude_deg, -180, 180),
            (heard.cog_rad, 0, 2 * math.pi),
            (heard.heading_rad, 0, 2 * math.pi),
            (heard.sog_mps, 0, 52.6),
            (heard.turn_rate_radps, -0.21, 0.21),
        ):
            assert value is None or low <= value <= high
        if heard.hull is not None:
            assert min(sides(heard)) >= 0
    if isinstance(heard, OwnPosition):
        assert abs(heard.latitude_deg) <= 90
        assert abs(heard.longitude_deg) <= 180


@given(st.lists(st.tuples(WANTED_IDS | st.integers(0, 2**29 - 1), st.binary(max_size=8)), max_size=100))
def test_random_frames_never_raise_and_never_leave_the_ranges(frames: list[tuple[int, bytes]]) -> None:
    decoder = Nmea2000Decoder(UtcClock())
    for k, (can_id, data) in enumerate(frames):
        for heard in decoder.decode(Frame(instant(0.01 * k), Link.CAN, data, can_id)):
            assert_sane(heard)


@given(st.sampled_from(AIS_PGNS), st.binary(min_size=9, max_size=100), st.integers(0, 10**9))
def test_random_payloads_never_raise_and_never_leave_the_ranges(pgn: int, payload: bytes, t_s: int) -> None:
    for heard in hear(Nmea2000Decoder(clock_at(12.0)), pgn, payload, float(t_s)):
        assert_sane(heard)


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.sampled_from(["flip", "cut", "drop", "swap"]))
def test_a_recorded_bus_with_errors_never_raises(gulf: Recording, seed: int, error: str) -> None:
    random = Random(seed)
    start = random.randrange(len(gulf.frames) - 2000)
    decoder = Nmea2000Decoder(UtcClock())
    heard: list[Heard] = []
    frames = [mutated(frame, random, error) for frame in gulf.frames[start : start + 2000]]
    if error == "swap":
        for _ in range(100):
            k = random.randrange(len(frames) - 1)
            frames[k], frames[k + 1] = frames[k + 1], frames[k]
    for frame in frames:
        if error != "drop" or random.random() > 0.05:
            heard += decoder.decode(frame)
    assert heard
    for message in heard:
        assert_sane(message)


def mutated(frame: Frame, random: Random, error: str) -> Frame:
    data = bytearray(frame.data)
    if random.random() < 0.05 and data:
        if error == "flip":
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)
        if error == "cut":
            del data[random.randrange(len(data)) :]
    return Frame(frame.stamp, frame.link, bytes(data), frame.can_id)


def test_other_messages_are_ignored() -> None:
    decoder = Nmea2000Decoder(UtcClock())
    for pgn in (60416, 60160, 59904, 128259, 130306, 129041, 129793):
        assert decoder.decode(Frame(instant(0.0), Link.CAN, bytes(8), pgn << 8 | 7)) == []
    assert not decoder.counts


def test_the_same_frames_give_the_same_messages(gulf: Recording) -> None:
    def run() -> list[Heard]:
        decoder = Nmea2000Decoder(UtcClock())
        return [heard for frame in gulf.frames[:5000] for heard in decoder.decode(frame)]

    assert run() == run()
