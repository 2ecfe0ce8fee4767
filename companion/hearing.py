"""From frames to what was heard: one decoder a link, one UTC for all of them."""

from collections import Counter
from collections.abc import Iterator

from companion.config import Autopilot
from companion.loop import Tick
from companion.messages import Heard, Link, UtcTime
from companion.utc import UtcClock
from companion.wire.ais_vessel import AisQuirk
from companion.wire.aivdm import AivdmDecoder
from companion.wire.mavlink import MavlinkDecoder
from companion.wire.nmea2000 import Nmea2000Decoder


class Hearing:
    """Holds the decoders; a statement of UTC steers the clock that the next frames are dated by."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._utc = UtcClock()
        self._mavlink = MavlinkDecoder(
            system_id=autopilot.system_id,
            component_id=autopilot.component_id,
            quirk=AisQuirk(autopilot.ais_sender),
        )
        self._decoders: dict[Link, MavlinkDecoder | Nmea2000Decoder | AivdmDecoder] = {
            Link.MAVLINK: self._mavlink,
            Link.CAN: Nmea2000Decoder(self._utc),
            Link.AIVDM: AivdmDecoder(self._utc),
        }

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id, which is ours too; 0 until it is known."""
        return self._mavlink.system_id

    def heard(self, tick: Tick) -> Iterator[Heard]:
        """What the tick's frames say, in their order; bytes that say nothing are counted."""
        for frame in tick.frames:
            for heard in self._decoders[frame.link].decode(frame):
                if isinstance(heard, UtcTime):
                    self._utc.observe(heard)
                else:
                    yield heard

    def counts(self) -> Counter[str]:
        """Frames and messages dropped so far, by reason."""
        merged: Counter[str] = Counter()
        for decoder in self._decoders.values():
            merged.update(decoder.counts)
        merged["utc.steps"] = self._utc.steps
        return merged
