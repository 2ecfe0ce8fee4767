"""AIVDM and AIVDO sentences (NMEA 0183, IEC 61162-1) to contact reports; pyais decodes the payloads.

Bytes come as they crossed the link: datagrams with several lines or one unended, or a stream cut
anywhere.  Tag blocks and whatever else stands before the `!` are passed over.  Parts of a message may
arrive interleaved with others', not out of order.  AIVDO is our own transponder: an own position.  pyais
takes 34 us a message, of which a full AIS channel pair has 75 a second: no reason to decode by hand.
"""

import math
from collections import Counter
from typing import Any

from pyais.exceptions import AISBaseException
from pyais.messages import AISSentence, NMEASentenceFactory

from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, Frame, Heard, Hull, OwnPosition, Source, TargetKind
from companion.utc import UtcClock
from companion.wire import ais_rules
from companion.wire.n2k_ais import measured

LONGEST_LINE = 1024  # a sentence has 82 characters, a tag block some more
MOST_PENDING = 64  # messages of several sentences under way at once
PENDING_S = 5.0
KNOT_MPS = 1852 / 3600
_AIRCRAFT, _CLASS_B_EXTENDED, _STATIC_B = 9, 19, 24
_SHIPS = {1: TargetKind.CLASS_A, 2: TargetKind.CLASS_A, 3: TargetKind.CLASS_A, 18: TargetKind.CLASS_B}
_SHIPS[_CLASS_B_EXTENDED] = TargetKind.CLASS_B
# base stations, aircraft and aids to navigation too: the picture tells them by their numbers
_POSITIONS = _SHIPS | {4: TargetKind.UNKNOWN, _AIRCRAFT: TargetKind.UNKNOWN, 21: TargetKind.UNKNOWN}
_STATICS = {5: TargetKind.CLASS_A, _STATIC_B: TargetKind.CLASS_B}
_FASTEST_TURN_DEG_PER_MIN = 708.0

Key = tuple[str, int | None, str, int]


class AivdmDecoder:
    """Decodes one stream of sentences, or several that share a clock.

    `utc` gives the reports their age; it is only read here.
    """

    def __init__(self, utc: UtcClock) -> None:
        self.counts: Counter[str] = Counter()
        self._utc = utc
        self._rest = b""
        self._pending: dict[Key, tuple[Instant, list[AISSentence]]] = {}

    def decode(self, frame: Frame) -> list[Heard]:
        """What the lines that end in this frame say."""
        heard = []
        between = b"\n" if self._rest and frame.data[:1] in (b"!", b"$", b"\\") else b""  # a bare datagram
        *lines, self._rest = (self._rest + between + frame.data).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            self.counts["aivdm.bad_line"] += 1
            self._rest = b""
        for line in lines:
            one = self._line(line, frame.stamp)
            if one is not None:
                heard.append(one)
        return heard

    def _line(self, line: bytes, stamp: Instant) -> Heard | None:
        start = line.find(b"!")
        if start < 0 or line[start + 3 : start + 5] != b"VD":
            if line.strip():
                self.counts["aivdm.other_line"] += 1
            return None
        sentence = self._sentence(line[start:].strip())
        whole = None if sentence is None else self._assembled(sentence, stamp)
        if whole is None:
            return None
        try:
            field: dict[str, Any] = whole.decode().asdict()
            self.counts["aivdm.messages"] += 1
            if sentence is not None and sentence.type == "VDO":
                return self._own(field, stamp) if sentence.talker == "AI" else None
            return self._report(field, stamp)
        except (AISBaseException, ArithmeticError, LookupError, TypeError, ValueError):
            self.counts["aivdm.undecodable"] += 1
            return None

    def _sentence(self, text: bytes) -> AISSentence | None:
        """A sentence whose checksum holds."""
        body, _, checksum = text[1:].rpartition(b"*")
        total = 0
        for byte in body:
            total ^= byte
        try:
            holds = int(checksum[:2], 16) == total
            sentence = NMEASentenceFactory.produce(text) if holds else None
        except (AISBaseException, ArithmeticError, LookupError, TypeError, ValueError):
            holds, sentence = False, None
        if not isinstance(sentence, AISSentence):
            self.counts["aivdm.bad_checksum" if not holds else "aivdm.bad_line"] += 1
            return None
        return sentence

    def _assembled(self, sentence: AISSentence, stamp: Instant) -> AISSentence | None:
        """The whole message, once its last part is here."""
        count, number = sentence.frag_cnt, sentence.frag_num
        if count == 1:
            return sentence
        key = (sentence.talker + sentence.type, sentence.seq_id, sentence.channel or "", count)
        if number == 1:
            if self._pending.pop(key, None) is not None:
                self.counts["aivdm.incomplete"] += 1
            self._pending[key] = stamp, [sentence]
            if len(self._pending) > MOST_PENDING:
                del self._pending[next(iter(self._pending))]
                self.counts["aivdm.incomplete"] += 1
            return None
        since, parts = self._pending.pop(key, (stamp, []))
        if number != len(parts) + 1 or not 0 <= stamp - since <= PENDING_S * NS_PER_S:
            self.counts["aivdm.incomplete"] += 1  # never glued to another message's body
            return None
        parts.append(sentence)
        if number < count:
            self._pending[key] = since, parts
            return None
        whole: AISSentence = AISSentence.assemble_from_iterable(parts)
        return whole

    def _report(self, field: dict[str, Any], stamp: Instant) -> ContactReport | None:
        message = field["msg_type"]
        if message in _POSITIONS:
            return self._position(field, stamp, _POSITIONS[message])
        if message in _STATICS:
            return self._without_position(field, stamp, _STATICS[message])
        self.counts["aivdm.not_needed"] += 1
        return None

    def _position(self, field: dict[str, Any], stamp: Instant, kind: TargetKind) -> ContactReport:
        latitude, longitude = field["lat"], field["lon"]
        placed = ais_rules.is_position(latitude, longitude)
        if not placed:
            self.counts["aivdm.no_position"] += 1
        second = int(field.get("second", 60))
        measured_at, age_error_s = measured(stamp, second, self._utc)
        speed, course, heading = field.get("speed"), field.get("course"), field.get("heading")
        aircraft = field["msg_type"] == _AIRCRAFT  # whole knots, up to 1022
        status = int(field.get("status", ais_rules.NAVIGATIONAL_STATUS_UNKNOWN))
        return ContactReport(
            mmsi=int(field["mmsi"]),
            source=Source.AIVDM,
            received_at=stamp,
            measured_at=measured_at,
            age_error_s=age_error_s,
            kind=kind,
            latitude_deg=latitude if placed else None,
            longitude_deg=longitude if placed else None,
            accurate=bool(field.get("accuracy")) and second <= 60,
            cog_rad=math.radians(course) if course is not None and course < 360.0 else None,
            sog_mps=speed * KNOT_MPS if speed is not None and not aircraft and speed < 102.3 else None,
            heading_rad=math.radians(heading) if heading is not None and heading < 360 else None,
            turn_rate_radps=_turn_radps(field["turn"]) if "turn" in field else None,
            navigational_status=status if status < ais_rules.NAVIGATIONAL_STATUS_UNKNOWN else None,
            **(_static(field) if field["msg_type"] == _CLASS_B_EXTENDED else {}),
        )

    def _without_position(self, field: dict[str, Any], stamp: Instant, kind: TargetKind) -> ContactReport:
        return ContactReport(
            mmsi=int(field["mmsi"]),
            source=Source.AIVDM,
            received_at=stamp,
            measured_at=stamp,
            age_error_s=ais_rules.UNSTAMPED_AGE_ERROR_S,
            kind=kind,
            **_static(field),
        )

    def _own(self, field: dict[str, Any], stamp: Instant) -> OwnPosition | None:
        """Our own transponder's report; one without a position, or of no ship, says nothing."""
        if field["msg_type"] not in _SHIPS or not 200_000_000 <= int(field["mmsi"]) < 800_000_000:
            self.counts["aivdm.not_needed"] += 1
            return None
        report = self._position(field, stamp, TargetKind.UNKNOWN)
        if report.latitude_deg is None or report.longitude_deg is None:
            return None
        velocity = None
        if report.sog_mps is not None and report.cog_rad is not None:
            north, east = math.cos(report.cog_rad), math.sin(report.cog_rad)
            velocity = (report.sog_mps * north, report.sog_mps * east, 0.0)
        return OwnPosition(
            stamp=report.measured_at,
            source=Source.AIVDM,
            latitude_deg=report.latitude_deg,
            longitude_deg=report.longitude_deg,
            velocity_ned_mps=velocity,
            heading_rad=report.heading_rad,
        )


def _turn_radps(turn: Any) -> float | None:
    """Degrees a minute; +-720 and the like only say which way, -128 nothing."""
    value = float(turn)
    if abs(value) > _FASTEST_TURN_DEG_PER_MIN or value in (-128.0, 127.0, -127.0):
        return None
    return math.radians(value) / 60.0


def _static(field: dict[str, Any]) -> dict[str, Any]:
    """What the message says of the ship itself; part A of type 24 has the name, part B the rest."""
    said: dict[str, Any] = {}
    name = field.get("shipname")
    if name:
        said["name"] = ais_rules.text(str(name).encode("ascii", "replace"))
    if field.get("ship_type"):
        said["ship_type"] = int(field["ship_type"])
    if field.get("draught"):  # 0 is "not available"
        said["draught_m"] = float(field["draught"])
    # a craft of a mother ship sends that ship's number in place of its own size
    of_mothership = int(field["mmsi"]) // 10_000_000 == ais_rules.CRAFT_OF_MOTHERSHIP
    sides = [field.get(f"to_{side}") for side in ("bow", "stern", "port", "starboard")]
    if None not in sides and not (of_mothership and field["msg_type"] == _STATIC_B):
        hull: Hull | None = ais_rules.hull(*(float(side or 0) for side in sides))
        said["hull"] = hull
    return said
