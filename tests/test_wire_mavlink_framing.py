"""MAVLink packets in streams and datagrams: cut, damaged, unknown, signed, of either version."""

from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import (
    Heard,
)
from tests.mavlink_talker import (
    Talker,
    decoder,
    global_position,
    hear,
    heartbeat,
    local_position,
    vessel,
)

STREAM = [heartbeat(), global_position(), vessel(), mav.MAVLink_system_time_message(1_669_809_600_000_000, 1)]


def stream(times: int = 1) -> list[bytes]:
    talker = Talker()
    return [talker.say(message) for _ in range(times) for message in STREAM]


def kinds(heard: list[Heard]) -> Counter[str]:
    return Counter(type(message).__name__ for message in heard)


@given(st.data())
def test_a_stream_may_be_cut_anywhere(data: st.DataObject) -> None:
    whole = b"".join(stream())
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=8)))
    to = decoder()
    heard: list[Heard] = []
    for k, (start, end) in enumerate(zip([0, *cuts], [*cuts, len(whole)], strict=True)):
        heard += hear(to, whole[start:end], 0.01 * k)
    assert len(heard) == len(STREAM)
    assert to.counts == {"mavlink.packets": len(STREAM)}


def test_mavlink_1_is_read_too() -> None:
    talker = Talker()
    data = b"".join(talker.say(message, v1=True) for message in (heartbeat(), global_position()))
    assert kinds(hear(decoder(), data)) == {"AutopilotHeartbeat": 1, "OwnPosition": 1}


def test_signed_packets_are_read_without_checking_the_signature() -> None:
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    packer.signing.secret_key = bytes(32)
    packer.signing.sign_outgoing = True
    data = b"".join(bytes(message.pack(packer)) for message in (heartbeat(), global_position()))
    assert kinds(hear(decoder(), data)) == {"AutopilotHeartbeat": 1, "OwnPosition": 1}


def test_a_newer_definitions_extra_bytes_are_left() -> None:
    packet = bytearray(Talker().say(global_position()))
    packet[1] += 3
    packet[-2:] = b"\1\2\3"
    crc = mav.x25crc(packet[1:])
    crc.accumulate(bytes((mav.MAVLink_global_position_int_message.crc_extra,)))
    assert len(hear(decoder(), bytes(packet) + crc.crc.to_bytes(2, "little"))) == 1


@pytest.mark.parametrize("flaw", range(39))
def test_one_damaged_byte_costs_one_message_and_no_other(flaw: int) -> None:
    before, damaged, *after = [Talker().say(global_position()) for _ in range(12)]
    broken = bytearray(damaged)
    broken[flaw] ^= 0x40
    to = decoder()
    heard = hear(to, before + bytes(broken) + b"".join(after))
    heard += hear(to, Talker().say(heartbeat()), 1.0)  # a length too large ends here
    # a damaged system or component id would still need its checksum
    assert kinds(heard)["OwnPosition"] == 11


def test_noise_between_packets_is_skipped_and_counted() -> None:
    to = decoder()
    first, *others = stream()
    noise = bytes(range(200))
    heard = hear(to, noise + first + noise + b"".join(others) + noise)
    assert len(heard) == len(STREAM)
    assert to.counts["mavlink.skipped_bytes"] == 600


def test_a_packet_we_do_not_know_is_stepped_over() -> None:
    unknown = bytes((0xFD, 4, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0xEE, 1, 2, 3, 4, 0, 0))
    first, *others = stream()
    to = decoder()
    assert len(hear(to, first + unknown + b"".join(others))) == len(STREAM)
    assert to.counts["mavlink.unknown"] == 1


def test_the_rest_of_a_cut_packet_does_not_swallow_the_good_ones_behind_it() -> None:
    """Three bytes of a header and what follows make an unknown message that ends where the data ends."""
    first, second = Talker().say(heartbeat()), Talker().say(heartbeat())
    cut = bytes((0xFD, 3 + len(first + second) - 12, 0))
    to = decoder()
    assert len(hear(to, cut + first + second)) == 2
    assert to.counts["mavlink.unknown"] == 0


def test_a_packet_that_never_ends_does_not_hold_up_the_next_ones() -> None:
    to = decoder()
    hear(to, b"\xfd\xff\0" + bytes(20), 0.0)
    assert len(hear(to, Talker().say(heartbeat()), 1.0)) == 1
    assert to.counts["mavlink.stalled"] == 1


@given(st.lists(st.binary(max_size=400), max_size=20))
def test_random_bytes_never_raise_and_are_not_hoarded(chunks: list[bytes]) -> None:
    to = decoder()
    for k, chunk in enumerate(chunks):
        assert hear(to, chunk, 0.1 * k) == []
        assert len(to._frames._rest) < 300
    hear(to, bytes(300), 100.0)
    assert len(hear(to, b"".join(stream()), 200.0)) == len(STREAM)


@given(st.integers(0, 2**32), st.sampled_from(["flip", "cut", "insert", "swap"]))
def test_a_damaged_stream_never_raises_and_loses_little(seed: int, damage: str) -> None:
    random = Random(seed)
    packets = stream(10)
    damaged = set(random.sample(range(len(packets)), 5))
    data = [spoil(packet, random, damage) if k in damaged else packet for k, packet in enumerate(packets)]
    to = decoder()
    heard: list[Heard] = []
    for k, packet in enumerate(data):
        heard += hear(to, packet, 0.01 * k)
    heard += hear(to, b"".join(stream()), 10.0)  # whatever was held back comes out
    assert len(heard) >= len(packets) - 5 + len(STREAM)


def spoil(packet: bytes, random: Random, damage: str) -> bytes:
    spoilt = bytearray(packet)
    at = random.randrange(len(packet))
    if damage == "flip":
        spoilt[at] ^= 1 << random.randrange(8)
    elif damage == "cut":
        del spoilt[at:]
    elif damage == "insert":
        spoilt[at:at] = random.randbytes(3)
    else:
        spoilt[at:] = spoilt[at:][::-1]
    return bytes(spoilt)


@given(st.lists(st.sampled_from([0, 1, 2, 3]), min_size=1, max_size=6), st.booleans())
def test_a_datagram_of_one_packet_is_read_as_in_a_stream(kinds: list[int], v1: bool) -> None:
    """The short cut for a whole packet and the search find the same messages, and as many as pymavlink."""
    talker, makers = Talker(), (heartbeat, global_position, vessel, local_position)
    packets = [talker.say(makers[kind](), v1=v1 and kind != 2) for kind in kinds]
    single, stream = decoder(), decoder()
    one_by_one = [each for data in packets for each in hear(single, data)]
    assert one_by_one == hear(stream, b"".join(packets))
    assert single.counts == stream.counts
    assert single.counts["mavlink.packets"] == len(mav.MAVLink(None).parse_buffer(b"".join(packets)) or [])
