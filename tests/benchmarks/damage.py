"""Damaged frames by the million through every decoder, and what they decode to through a picture.

What must hold: nothing raises, no number is out of range, nothing grows without bound, and of frames under a
checksum nothing is heard that was not said.
"""

import math
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

from companion import config
from companion.instant import Instant, instant
from companion.messages import ContactReport, Frame, Heard, Link, OwnPosition, UtcTime
from companion.picture import Picture
from companion.utc import UtcClock
from companion.wire.aivdm import AivdmDecoder
from companion.wire.mavlink import MavlinkDecoder
from companion.wire.nmea2000 import Nmea2000Decoder
from sitl.bus import GnssReceiver
from tests.contact_reports import FRAME
from tests.fleet import Fleet

SHIPS = 40
MOST_INVENTED = 5  # 16 bits of checksum let one damaged packet in 65,536 through
Decoder = MavlinkDecoder | Nmea2000Decoder | AivdmDecoder
DAMAGED = {Link.MAVLINK: 0.98, Link.AIVDM: 0.98, Link.CAN: 0.1}  # a message on the bus is of many frames
Message = list[tuple[int, bytes]]


def decoder_of(link: Link, utc: UtcClock) -> Decoder:
    """The production decoder of a link."""
    if link is Link.MAVLINK:
        return MavlinkDecoder(system_id=1)
    return Nmea2000Decoder(utc) if link is Link.CAN else AivdmDecoder(utc)


def sound(link: Link) -> list[Message]:
    """Messages to be damaged: position reports, and on the bus our own position and the time."""
    fleet = Fleet(SHIPS)
    said = [fleet.say(link, ship, 1.0) for ship in range(SHIPS)]
    if link is Link.CAN:
        receiver = GnssReceiver()
        said += [receiver.say(Fleet.utc_ns + s * 10**9, 59.7, 24.7) for s in range(20)]
    return said


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """One to three bytes changed, a piece left out, doubled or cut off, or all of it noise."""
    spoilt = bytearray(data)
    match int(rng.integers(6)):
        case 0:
            return rng.bytes(len(data))
        case 1:
            at = int(rng.integers(len(spoilt)))
            del spoilt[at : at + int(rng.integers(1, 5))]
        case 2:
            at = int(rng.integers(len(spoilt)))
            spoilt[at:at] = spoilt[at : at + int(rng.integers(1, 9))]
        case 3:
            del spoilt[int(rng.integers(len(spoilt))) :]
        case _:
            for _ in range(int(rng.integers(1, 4))):
                spoilt[int(rng.integers(len(spoilt)))] = int(rng.integers(256))
    return bytes(spoilt)


def stream(link: Link, count: int, rng: np.random.Generator) -> Iterator[Frame]:
    """`count` frames, most of them damaged; on a bus identifiers too."""
    messages, number = sound(link), 0
    while number < count:
        for can_id, data in messages[int(rng.integers(len(messages)))]:
            spoil = rng.random() < DAMAGED[link]
            said, sent_as = (damaged(data, rng) if spoil else data), can_id
            if link is Link.CAN:
                said = said[:8]
                sent_as ^= (1 << int(rng.integers(29))) if rng.random() < 0.02 else 0
            number += 1
            yield Frame(instant(number * 1e-3), link, said, sent_as)


def is_sane(heard: Heard) -> bool:
    """Every number of it in its range."""
    if isinstance(heard, ContactReport):
        ranges = (
            (heard.mmsi, 0, 2**30 - 1),
            (heard.latitude_deg, -90, 90),
            (heard.longitude_deg, -180, 180),
            (heard.cog_rad, 0, 2 * math.pi),
            (heard.heading_rad, 0, 2 * math.pi),
            (heard.sog_mps, 0, 52.7),
            (heard.draught_m, 0, 655.3),
        )
        return all(value is None or low <= value <= high for value, low, high in ranges)
    if isinstance(heard, OwnPosition):
        return abs(heard.latitude_deg) <= 90 and abs(heard.longitude_deg) <= 180
    return True


def feed(link: Link, count: int, seed: int) -> tuple[int, int, Picture, Counter[str]]:
    """Frames heard as reports, those of ships nobody named, the picture and the decoder's counts."""
    utc = UtcClock()
    decoder = decoder_of(link, utc)
    known = {Fleet(SHIPS).mmsi(ship) for ship in range(SHIPS)}
    picture = Picture(config.Contacts(bounds_file="houston"))
    reports = invented = 0
    for number, frame in enumerate(stream(link, count, np.random.default_rng(seed))):
        for heard in decoder.decode(frame):
            assert is_sane(heard), heard
            if isinstance(heard, ContactReport):
                reports += 1
                invented += heard.mmsi not in known
                picture.observe(heard)
            elif isinstance(heard, OwnPosition):
                picture.observe_own(heard)
            elif isinstance(heard, UtcTime):
                utc.observe(heard)
        if number % 20_000 == 19_999:
            tracks = picture.tracks(Instant(frame.stamp), FRAME)
            assert np.isfinite(tracks.north_m).all()
            assert np.isfinite(tracks.spread_m).all()
    return reports, invented, picture, decoder.counts


def run(millions: float) -> None:
    """The figures."""
    for link in Link:
        begin, count = time.process_time(), round(millions * 1e6)
        reports, invented, picture, counts = feed(link, count, 1)
        spent = time.process_time() - begin
        share = 100 * DAMAGED[link]
        print(f"{link.value}: {count} frames, {share:g} % damaged, nothing raised")
        print(f"  {1e6 * spent / count:.1f} us each")
        print(f"  {reports} reports, {invented} of numbers nobody has, {len(picture)} contacts")
        print("  " + ", ".join(f"{key} {n}" for key, n in sorted(counts.items())))
