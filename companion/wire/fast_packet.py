"""NMEA 2000 fast packets: messages of up to 223 bytes out of 8-byte CAN frames.

Byte 0 holds a 3-bit sequence and a 5-bit frame index.  Frame 0 announces the length in byte 1
and carries 6 bytes, the others 7.  Nothing is acknowledged and nothing is sent again, so when
frames are lost the one thing that must not happen is a message made of two: one ship's
identity on another's position.

- Frame 0 always starts anew; whatever was there under its key is given up.
- Later frames may come in any order, but only after their frame 0.
- An index that repeats or lies beyond the announced length, or a frame too short for its place,
  gives the message up.
- A message whose frames lie more than `TIMEOUT_S` apart is given up, and so is one whose talker
  has gone on by half the sequence counter: the same number would soon mean another message.
- Of a talker that does not count its sequence, frames are taken in order only.
- At most `MOST_OPEN` messages are open; the oldest is given up.
"""

from collections import Counter
from itertools import islice

from companion.instant import NS_PER_S, Instant

LONGEST = 6 + 31 * 7
TIMEOUT_S = 1.5  # our choice: frames come milliseconds apart, but a recorded bus paused for 1.2 s
MOST_OPEN = 256  # 44 talkers with several PGNs each stay well below
_TIMEOUT_NS = round(TIMEOUT_S * NS_PER_S)
_NO_PRIORITY = (1 << 26) - 1
_HALF_ROUND = (3, 4, 5)  # sequence numbers back; three, since a first frame may have been lost
_MOST_TALKERS = 4096  # of which the last sequence is remembered


class _Open:
    """A message that waits for frames."""

    __slots__ = ("in_order", "length", "missing", "parts", "stamp")

    def __init__(self, stamp: Instant, length: int, first: bytes, *, in_order: bool) -> None:
        self.stamp = stamp
        self.length = length
        self.missing = length // 7  # ceil((length - 6) / 7)
        self.parts: list[bytes] = [first] + [b""] * self.missing
        self.in_order = in_order

    def take(self, stamp: Instant, index: int, data: bytes) -> str:
        """Put a frame in its place; return why that is wrong, or an empty string."""
        if abs(stamp - self.stamp) > _TIMEOUT_NS:
            return "n2k.late_frame"
        if index >= len(self.parts):
            return "n2k.index_beyond_length"
        if self.parts[index]:
            return "n2k.repeated_frame"
        if len(data) <= min(7, self.length - 7 * index + 1):
            return "n2k.short_frame"
        if self.in_order and not self.parts[index - 1]:
            return "n2k.out_of_order"
        self.parts[index] = data[1:8]
        self.missing -= 1
        self.stamp = stamp
        return ""

    def whole(self) -> bytes:
        """The payload, once nothing is missing."""
        return b"".join(self.parts)[: self.length]


class FastPackets:
    """Reassembles the fast packets of all talkers on one bus."""

    def __init__(self, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self._open: dict[int, _Open] = {}
        self._sequence: dict[int, int] = {}  # the last of each talker's PGN

    def __len__(self) -> int:
        """How many messages are open."""
        return len(self._open)

    def push(self, stamp: Instant, can_id: int, data: bytes) -> bytes | None:
        """Take a frame; return the whole message when this was its last one, else None.

        Only for identifiers of fast-packet PGNs: the caller knows which those are.
        """
        if len(data) < 2:
            self.counts["n2k.short_frame"] += 1
            return None
        index = data[0] & 0x1F
        # PGN, destination and source: all of the identifier but the priority; then the sequence
        key = (can_id & _NO_PRIORITY) << 3 | data[0] >> 5
        if index == 0:
            return self._start(stamp, key, data)
        message = self._open.get(key)
        if message is None:
            self.counts["n2k.orphan_frame"] += 1
            return None
        wrong = message.take(stamp, index, data)
        if wrong:
            self._give_up(key, wrong)
        elif not message.missing:
            del self._open[key]
            return message.whole()
        return None

    def _start(self, stamp: Instant, key: int, data: bytes) -> bytes | None:
        talker, sequence = key >> 3, key & 7
        for overtaken in (key, *(talker << 3 | (sequence - back) & 7 for back in _HALF_ROUND)):
            if overtaken in self._open:
                self._give_up(overtaken, "n2k.incomplete")
        does_not_count = self._sequence.get(talker) == sequence
        if len(self._sequence) >= _MOST_TALKERS:
            self._sequence.clear()
        self._sequence[talker] = sequence
        length = data[1]
        if length > LONGEST or len(data) - 2 < min(6, length):
            self.counts["n2k.bad_length"] += 1
            return None
        if length <= 6:
            return data[2 : 2 + length]
        if len(self._open) >= MOST_OPEN:
            self._make_room(stamp)
        self._open[key] = _Open(stamp, length, data[2:8], in_order=does_not_count)
        return None

    def _give_up(self, key: int, why: str) -> None:
        del self._open[key]
        self.counts[why] += 1

    def _make_room(self, now: Instant) -> None:
        stale = [key for key, message in self._open.items() if abs(now - message.stamp) > _TIMEOUT_NS]
        for key in stale or list(islice(self._open, 1)):
            self._give_up(key, "n2k.incomplete")
