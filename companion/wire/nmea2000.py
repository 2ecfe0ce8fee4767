"""NMEA 2000 frames to messages: contact reports, own position, UTC.

Decoded by hand from the layouts of the public CANboat database: 4 us a message where the
general library takes 15, no clock, and payloads of any announced length.  The library is the
second path in the tests.
"""

from collections import Counter

from companion.instant import NS_PER_S, Instant
from companion.messages import Frame, Heard, OwnPosition, Source, UtcTime
from companion.utc import UtcClock
from companion.wire import n2k_ais, n2k_own
from companion.wire.fast_packet import FastPackets

POSITION = 129025
COURSE = 129026
HEADING = 127250
GNSS = 129029
SYSTEM_TIME = 126992
TIME_DATE = 129033

_FAST = frozenset((*n2k_ais.LAYOUTS, GNSS))
_SINGLE = frozenset((POSITION, COURSE, HEADING, SYSTEM_TIME, TIME_DATE))
_FRESH_NS = 2 * NS_PER_S  # a course or heading older than this does not join a position


class Nmea2000Decoder:
    """Decodes the frames of one bus, or of several that share a clock.

    `utc` gives the AIS reports their age; it is only read here.  Whoever drives the decoder feeds
    it with the statements of UTC that come out, this bus's and others'.

    Own positions: PGN 129025, and 129029 of receivers that send no 129025.
    """

    def __init__(self, utc: UtcClock) -> None:
        self.counts: Counter[str] = Counter()
        self._utc = utc
        self._packets = FastPackets(self.counts)
        self._position_at: dict[int, Instant] = {}  # of PGN 129025, by talker
        self._gnss_since: set[int] = set()  # talkers of PGN 129029 since their last 129025
        self._velocity: dict[int, tuple[Instant, tuple[float, float]]] = {}  # by talker
        self._heading: tuple[Instant, float] | None = None

    def decode(self, frame: Frame) -> list[Heard]:
        """What the frame completes; mostly nothing."""
        pgn = frame.can_id >> 8 & 0x3FFFF  # all ours are broadcasts: the low byte belongs to the PGN
        if pgn in _FAST:
            payload = self._packets.push(frame.stamp, frame.can_id, frame.data)
            if payload is None:
                return []
        elif pgn in _SINGLE:
            payload = frame.data
        else:
            return []
        self.counts["n2k.messages"] += 1
        talker = frame.can_id & 0xFF
        heard = self._read(pgn, talker, frame.stamp, payload)
        if pgn == GNSS and self._is_gnss_all_it_has(talker, frame.stamp):
            own = self._own(talker, frame.stamp, n2k_own.gnss_position_deg(payload))
            return [message for message in (heard, own) if message is not None]
        return [] if heard is None else [heard]

    def _is_gnss_all_it_has(self, talker: int, stamp: Instant) -> bool:
        """No rapid position lately, nor since its last GNSS position."""
        is_second = talker in self._gnss_since
        self._gnss_since.add(talker)
        return is_second and not _is_fresh(self._position_at.get(talker), stamp)

    def _read(self, pgn: int, talker: int, stamp: Instant, payload: bytes) -> Heard | None:
        if pgn in n2k_ais.LAYOUTS:
            return n2k_ais.read(pgn, payload, stamp, self._utc, self.counts)
        if pgn == POSITION:
            self._position_at[talker] = stamp
            self._gnss_since.discard(talker)
            return self._own(talker, stamp, n2k_own.position_deg(payload))
        if pgn == COURSE:
            velocity = n2k_own.velocity_mps(payload)
            if velocity is not None:
                self._velocity[talker] = stamp, velocity
            return None
        if pgn == HEADING:
            heading = n2k_own.heading_rad(payload)
            if heading is not None:
                self._heading = stamp, heading
            return None
        utc_ns = n2k_own.utc_ns(pgn, payload)
        if utc_ns is None:
            self.counts["n2k.no_utc"] += 1
            return None
        return UtcTime(stamp, Source.NMEA2000, utc_ns)

    def _own(self, talker: int, stamp: Instant, position: tuple[float, float] | None) -> OwnPosition | None:
        if position is None:
            self.counts["n2k.no_position"] += 1
            return None
        velocity = self._velocity.get(talker)
        heading = self._heading
        return OwnPosition(
            stamp=stamp,
            source=Source.NMEA2000,
            latitude_deg=position[0],
            longitude_deg=position[1],
            velocity_ned_mps=(*velocity[1], 0.0) if velocity and _is_fresh(velocity[0], stamp) else None,
            heading_rad=heading[1] if heading and _is_fresh(heading[0], stamp) else None,
            talker=talker,
        )


def _is_fresh(since: Instant | None, now: Instant) -> bool:
    return since is not None and 0 <= now - since <= _FRESH_NS
