from collections import Counter
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nmea2000 import _canboat

from companion.instant import Instant, instant
from companion.wire.fast_packet import LONGEST, MOST_OPEN, TIMEOUT_S, FastPackets

CAN_ID = 0x11F80E2B  # PGN 129038 from 0x2B


def split(payload: bytes, sequence: int) -> list[bytes]:
    """The frames of one message, by an encoder that is not ours."""
    return [bytes(frame) for frame in _canboat.fast_packet_fragment(sequence, payload)]


def push_all(
    packets: FastPackets, frames: list[bytes], can_id: int = CAN_ID, t_s: float = 0.0
) -> list[bytes]:
    done = [packets.push(instant(t_s + 0.001 * k), can_id, frame) for k, frame in enumerate(frames)]
    return [payload for payload in done if payload is not None]


def wire(payload: bytes, sequence: int) -> list[bytes]:
    """Frames written down from the definition, so that the test does not hang on one encoder."""
    rest = payload[6:]
    bodies = [rest[k : k + 7] for k in range(0, len(rest), 7)]
    head = bytes((sequence << 5, len(payload))) + payload[:6]
    frames = [head, *(bytes((sequence << 5 | k + 1,)) + body for k, body in enumerate(bodies))]
    return [frame.ljust(8, b"\xff") for frame in frames]


@given(st.binary(min_size=1, max_size=LONGEST), st.integers(0, 7))
def test_what_was_split_comes_back_whole(payload: bytes, sequence: int) -> None:
    packets = FastPackets()
    assert push_all(packets, wire(payload, sequence)) == [payload]
    assert len(packets) == 0
    assert not packets.counts


@given(st.binary(min_size=9, max_size=LONGEST), st.integers(0, 7))
def test_the_librarys_frames_come_back_whole(payload: bytes, sequence: int) -> None:
    assert push_all(FastPackets(), split(payload, sequence)) == [payload]


def test_frames_after_the_first_may_come_in_any_order() -> None:
    payload = bytes(range(30))
    first, *others = wire(payload, 3)
    for order in permutations(others):
        assert push_all(FastPackets(), [first, *order]) == [payload]


@given(st.data())
def test_messages_of_many_talkers_may_interleave(data: st.DataObject) -> None:
    talkers = data.draw(st.lists(st.binary(min_size=7, max_size=60), min_size=2, max_size=8))
    queues = {source: wire(payload, source % 8) for source, payload in enumerate(talkers)}
    packets = FastPackets()
    heard: dict[int, bytes] = {}
    k = 0
    while queues:
        source = data.draw(st.sampled_from(sorted(queues)))
        payload = packets.push(instant(0.0001 * k), 0x11F80E00 | source, queues[source].pop(0))
        k += 1
        if payload is not None:
            heard[source] = payload
        if not queues[source]:
            del queues[source]
    assert heard == dict(enumerate(talkers))


def test_two_sequences_of_one_talker_do_not_mix() -> None:
    a, b = bytes(20), bytes(range(20))
    frames = [frame for pair in zip(wire(a, 1), wire(b, 2), strict=True) for frame in pair]
    assert push_all(FastPackets(), frames) == [a, b]


def test_a_new_first_frame_is_never_glued_to_an_old_body() -> None:
    old, new = b"A" * 20, b"B" * 20
    packets = FastPackets()
    assert push_all(packets, wire(old, 5)[:-1] + wire(new, 5)) == [new]
    assert packets.counts == Counter({"n2k.incomplete": 1})


def test_a_body_before_its_first_frame_is_dropped() -> None:
    old, new = b"A" * 20, b"B" * 20
    packets = FastPackets()
    # the old message lost frame 0, the new one uses the same sequence and lost its last frame
    assert push_all(packets, wire(old, 5)[1:] + wire(new, 5)[:-1]) == []
    assert packets.counts["n2k.orphan_frame"] == 2


@pytest.mark.parametrize("lost", range(5))
def test_a_lost_frame_loses_the_message_and_no_other(lost: int) -> None:
    messages = [bytes((k,)) * 33 for k in range(24)]  # three times round the sequence counter
    packets = FastPackets()
    heard = []
    for k, message in enumerate(messages):
        frames = wire(message, k % 8)
        if k == 9:
            del frames[lost]
        heard += push_all(packets, frames, t_s=0.1 * k)
    assert heard == messages[:9] + messages[10:]


def test_a_talker_that_does_not_count_its_sequence_gets_no_glued_message() -> None:
    a, b, c = b"A" * 27, b"B" * 27, b"C" * 27
    frames = wire(a, 0)
    frames += [frame for k, frame in enumerate(wire(b, 0)) if k != 1]
    frames += [frame for k, frame in enumerate(wire(c, 0)) if k != 0]
    packets = FastPackets()
    assert push_all(packets, frames) == [a]
    assert packets.counts["n2k.out_of_order"] == 1


@pytest.mark.parametrize("also_lost", [None, 3, 4, 5])
def test_a_round_of_the_sequence_counter_later_nothing_is_glued(also_lost: int | None) -> None:
    messages = [bytes((k,)) * 27 for k in range(9)]
    frames = []
    for k, message in enumerate(messages):
        lost = {0: 1, 8: 0, also_lost: 0}.get(k)
        frames += [frame for n, frame in enumerate(wire(message, k % 8)) if n != lost]
    assert push_all(FastPackets(), frames) == [
        m for k, m in enumerate(messages) if k not in {0, 8, also_lost}
    ]


@given(st.sets(st.integers(0, 20 * 4 - 1), max_size=4))
def test_whichever_four_frames_are_lost_only_whole_messages_come_out(lost: set[int]) -> None:
    messages = [bytes((k,)) * 27 for k in range(20)]
    frames = [frame for k, message in enumerate(messages) for frame in wire(message, k % 8)]
    heard = push_all(FastPackets(), [frame for k, frame in enumerate(frames) if k not in lost])
    assert heard == [m for k, m in enumerate(messages) if k not in {n // 4 for n in lost}]


def test_a_repeated_index_gives_the_message_up() -> None:
    frames = wire(bytes(27), 0)
    packets = FastPackets()
    assert push_all(packets, [frames[0], frames[1], frames[1], frames[2], frames[3]]) == []
    assert packets.counts["n2k.repeated_frame"] == 1


def test_an_index_beyond_the_announced_length_gives_the_message_up() -> None:
    frames = wire(bytes(27), 0)
    packets = FastPackets()
    assert push_all(packets, [frames[0], b"\x04" + bytes(7), *frames[1:]]) == []
    assert packets.counts["n2k.index_beyond_length"] == 1


@pytest.mark.parametrize(("gap_s", "is_heard"), [(TIMEOUT_S - 0.01, True), (TIMEOUT_S + 0.01, False)])
def test_frames_too_far_apart_do_not_belong_together(gap_s: float, is_heard: bool) -> None:
    payload = bytes(range(13))
    first, second = wire(payload, 0)
    packets = FastPackets()
    packets.push(instant(10.0), CAN_ID, first)
    assert packets.push(instant(10.0 + gap_s), CAN_ID, second) == (payload if is_heard else None)


def test_a_clock_that_jumps_back_parts_frames_too() -> None:
    first, second = wire(bytes(13), 0)
    packets = FastPackets()
    packets.push(instant(1_200_960.0), CAN_ID, first)
    assert packets.push(instant(0.0), CAN_ID, second) is None


@pytest.mark.parametrize("length", [224, 255])
def test_a_length_that_no_fast_packet_has_is_refused(length: int) -> None:
    packets = FastPackets()
    assert push_all(packets, [bytes((0, length)) + bytes(6)]) == []
    assert packets.counts["n2k.bad_length"] == 1
    assert len(packets) == 0


def test_the_last_frame_may_be_unpadded_but_not_shorter_than_announced() -> None:
    payload = bytes(range(1, 16))
    frames = wire(payload, 0)
    assert push_all(FastPackets(), [*frames[:-1], frames[-1][:3]]) == [payload]
    packets = FastPackets()
    assert push_all(packets, [*frames[:-1], frames[-1][:2]]) == []
    assert packets.counts["n2k.short_frame"] == 1


def test_the_priority_does_not_tell_messages_apart() -> None:
    payload = bytes(range(13))
    first, second = wire(payload, 0)
    packets = FastPackets()
    packets.push(instant(0.0), CAN_ID, first)
    assert packets.push(instant(0.0), CAN_ID ^ 0x0C000000, second) == payload


def test_memory_stays_bounded_whatever_is_begun() -> None:
    packets = FastPackets()
    for k in range(20 * MOST_OPEN):
        packets.push(Instant(k), 0x01F80E00 | k % 256 | (k // 256) << 16, bytes((0, 200)) + bytes(6))
        assert len(packets) <= MOST_OPEN
    assert packets.counts["n2k.incomplete"] == 19 * MOST_OPEN


@given(st.lists(st.tuples(st.integers(0, 3), st.binary(max_size=8)), max_size=300))
def test_random_frames_never_raise(frames: list[tuple[int, bytes]]) -> None:
    packets = FastPackets()
    for k, (source, data) in enumerate(frames):
        payload = packets.push(instant(0.01 * k), 0x11F80E00 | source, data)
        assert payload is None or len(payload) <= LONGEST
    assert len(packets) <= MOST_OPEN
