"""MAVLink 1 and 2 packets out of bytes, however the link cut them.

Our own search for packets, on the dialect's definitions: the library's parser gives up as many
bytes as a damaged header claims, and the good packets among them.  Here a packet that fails its
checksum costs one byte, and the search goes on inside it.

Signed packets are taken without checking the signature: no key is configured.
"""

import re
import struct
from collections import Counter
from collections.abc import Callable
from typing import Any

import msgspec
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.instant import NS_PER_S, Instant

MAGIC_V1, MAGIC_V2 = 0xFE, 0xFD
_SIGNED = 0x01  # the only incompatibility flag there is
_SIGNATURE = 13
_MAGIC = re.compile(rb"[\xfd\xfe]")
_FRAME = 12  # bytes around the payload of an unsigned MAVLink 2 packet
_START = struct.Struct("<BBBxxBBHB")  # of MAVLink 2: magic, length, flag, system, component, message
_CRC_EXTRA = {number: bytes((each.crc_extra,)) for number, each in dialect.mavlink_map.items()}
# the function behind the dialect's class, where it has the compiled one
_crc: Callable[[bytes], int] = getattr(dialect, "mcrf4xx", None) or (
    lambda data: int(dialect.x25crc(data).crc)
)
_STALLED_NS = NS_PER_S // 2  # a packet whose rest does not come by then never comes


class Packet(msgspec.Struct, frozen=True, gc=False):
    """One packet that passed its checksum."""

    system_id: int
    component_id: int
    message_id: int
    payload: bytes


def fields(message_id: int, payload: bytes) -> dict[str, Any]:
    """A message's fields by name, in the units of the definition; raw bytes for texts.

    MAVLink 2 leaves zeros at the end away; newer senders may append what we do not know.
    """
    definition = dialect.mavlink_map[message_id]
    size = definition.unpacker.size
    values = definition.unpacker.unpack(payload[:size].ljust(size, b"\0"))
    return dict(zip(definition.ordered_fieldnames, values, strict=True))


class MavlinkFrames:
    """Keeps the packet that is not complete yet: less than 300 bytes."""

    def __init__(self, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self._rest = b""
        self._rest_stamp = Instant(0)

    def push(self, stamp: Instant, data: bytes) -> list[Packet]:
        """The packets that `data` completes."""
        packets: list[Packet] = []
        at = 0
        if not self._rest:  # sound packets one behind the other, as nearly always
            while (packet := _next(data, at)) is not None:
                packets.append(packet)
                at += _FRAME + len(packet.payload)
            if packets:
                self.counts["mavlink.packets"] += len(packets)
                if at == len(data):
                    return packets
        old = len(self._rest)
        is_stalled = old > 0 and abs(stamp - self._rest_stamp) > _STALLED_NS
        data = self._rest + data
        while True:
            found = _MAGIC.search(data, at)
            start = found.start() if found else len(data)
            if start > at:
                self.counts["mavlink.skipped_bytes"] += start - at
                at = start
            length = _length(data, at)
            if at + length > len(data):
                if not (is_stalled and at < old):
                    break
                self.counts["mavlink.stalled"] += 1
                length = 0
            at += self._take(data, at, length, packets) if length else 1
        if at >= old:
            self._rest_stamp = stamp
        self._rest = data[at:]
        return packets

    def _take(self, data: bytes, at: int, length: int, packets: list[Packet]) -> int:
        """Judge the complete packet at `at`; return how many bytes are done with."""
        packet, is_sound = _packet(data, at)
        if is_sound is None:
            # not checkable: believed only if another packet, or nothing, follows, and none is inside
            follows = at + length == len(data) or data[at + length] in (MAGIC_V1, MAGIC_V2)
            if follows and not _hides_a_packet(data, at + 1, at + length):
                self.counts["mavlink.unknown"] += 1
                return length
        if not is_sound:
            self.counts["mavlink.bad_crc"] += 1
            return 1
        self.counts["mavlink.packets"] += 1
        packets.append(packet)
        return length


def _packet(data: bytes, at: int) -> tuple[Packet, bool | None]:
    """The complete packet at `at`, and whether its checksum is right; None for an unknown message."""
    if data[at] == MAGIC_V2:
        payload_at, system, component = at + 10, data[at + 5], data[at + 6]
        message_id = data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16
    else:
        payload_at, system, component, message_id = at + 6, data[at + 3], data[at + 4], data[at + 5]
    payload_end = payload_at + data[at + 1]
    packet = Packet(system, component, message_id, data[payload_at:payload_end])
    extra = _CRC_EXTRA.get(message_id)
    if extra is None:
        return packet, None
    crc = _crc(data[at + 1 : payload_end] + extra)
    return packet, crc == data[payload_end] | data[payload_end + 1] << 8


def _next(data: bytes, at: int) -> Packet | None:
    """The sound, unsigned MAVLink 2 packet that begins at `at`; None when there is anything else.

    What links carry, mostly.
    """
    if len(data) - at < _FRAME:
        return None
    magic, length, flags, system, component, low, high = _START.unpack_from(data, at)
    end = at + 10 + length
    if magic != MAGIC_V2 or flags or end + 2 > len(data):
        return None
    message_id = low | high << 16
    extra = _CRC_EXTRA.get(message_id)
    if extra is None or _crc(data[at + 1 : end] + extra) != data[end] | data[end + 1] << 8:
        return None
    return Packet(system, component, message_id, data[at + 10 : end])


def _hides_a_packet(data: bytes, start: int, end: int) -> bool:
    """Whether a sound packet lies inside these bytes: then what claims them is the rest of a cut one."""
    for found in _MAGIC.finditer(data, start, end):
        at = found.start()
        length = _length(data, at)
        if length and at + length <= end and _packet(data, at)[1]:
            return True
    return False


def _length(data: bytes, at: int) -> int:
    """Length of the packet that begins at `at`; 0 if none can, and more than there is if it is cut."""
    if len(data) - at < 3:
        return 3
    if data[at] == MAGIC_V1:
        return data[at + 1] + 8
    flags = data[at + 2]
    if flags & ~_SIGNED:
        return 0
    return data[at + 1] + 12 + (_SIGNATURE if flags else 0)
