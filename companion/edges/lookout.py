"""`companion picture`: the contacts of a recording or of a live link, as a table and a chart."""

from argparse import Namespace
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from companion import config
from companion.edges.can_bus import CanBus
from companion.edges.connection import parse
from companion.edges.live import MonotonicClock
from companion.edges.lookout_chart import draw
from companion.edges.mavlink import MavlinkLink
from companion.edges.traffic import read
from companion.errors import ConfigError
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, Instant, after
from companion.messages import ContactReport, Frame, Heard, Link, OwnPosition, Source, Tracks, UtcTime
from companion.picture import Picture
from companion.picture.ageing import AgeState
from companion.picture.view import Line, lines
from companion.utc import UtcClock
from companion.wire.aivdm import AivdmDecoder
from companion.wire.mavlink import MavlinkDecoder
from companion.wire.nmea2000 import Nmea2000Decoder

KNOT_MPS, MILE_M = 1852 / 3600, 1852.0
REFRESH_S, WAIT_S = 1.0, 0.2
_STYLES = {
    AgeState.FRESH: "green",
    AgeState.COASTING: "yellow",
    AgeState.STALE: "dark_orange",
    AgeState.UNBOUNDED: "bold red",
}


class Lookout:
    """A picture with the own position that came beside it."""

    def __init__(self, contacts: config.Contacts, own: tuple[float, float] | None) -> None:
        self.picture = Picture(contacts)
        self.now: Instant | None = None
        self._given = own
        self._own: OwnPosition | None = None

    def take(self, heard: Heard) -> None:
        """Take whatever was heard."""
        match heard:
            case ContactReport():
                self.picture.observe(heard)
                self._advance(heard.received_at)
            case OwnPosition():
                self.picture.observe_own(heard)
                self._own = heard
                self._advance(heard.stamp)
            case _:
                pass

    def own(self, now: Instant) -> tuple[OwnPosition | None, str]:
        """Where we are, and how that is known; None while neither we nor any contact has a place."""
        if self._given is not None:
            return OwnPosition(now, Source.MAVLINK, *self._given), "as given by --own"
        if self._own is not None:
            return self._own, f"from {self._own.source.value}"
        places = self.picture.places_deg()
        if not len(places):
            return None, "unknown"
        middle = np.median(places, axis=0)
        text = "UNKNOWN: distances are from the middle of the traffic; give --own LAT,LON"
        return OwnPosition(now, Source.MAVLINK, float(middle[0]), float(middle[1])), text

    def show(self, now: Instant) -> tuple[list[Line], Tracks, OwnPosition | None, LocalFrame | None, str]:
        """The table's lines, and what the chart needs."""
        own, known = self.own(now)
        if own is None:
            return [], Tracks.empty(), None, None, known
        frame = LocalFrame(own.latitude_deg, own.longitude_deg)
        tracks = self.picture.tracks(now, frame)
        return lines(self.picture, tracks, now, own, frame), tracks, own, frame, known

    def _advance(self, at: Instant) -> None:
        """The newest time heard; a clock that steps back by more than a minute takes us along."""
        if self.now is None or at > self.now or self.now - at > 60 * NS_PER_S:
            self.now = at


def run(options: Namespace) -> int:
    """Run the sub-command; the exit status."""
    contacts = config.Contacts(bounds_file=options.bounds)
    console = Console()
    lookout = Lookout(contacts, options.own)
    path = Path(options.source)
    if path.is_file():
        counts: Counter[str] = Counter()
        _hear(lookout, read(path, counts), options.at)
        if lookout.now is None:
            console.print(f"{path}: nothing was heard", style="yellow")
            return 1
        now = after(lookout.now, options.silence)
        _finish(console, lookout, now, options, path.name)
        return 0
    return _watch(console, lookout, options)


def _hear(lookout: Lookout, heard: Iterable[Heard], until_s: float | None) -> None:
    begin: Instant | None = None
    for each in heard:
        lookout.take(each)
        if lookout.now is not None:
            begin = lookout.now if begin is None else begin
            if until_s is not None and lookout.now - begin > until_s * NS_PER_S:
                return


def _watch(console: Console, lookout: Lookout, options: Namespace) -> int:
    """A live link, until interrupted."""
    clock = MonotonicClock()
    due = clock.now()
    try:
        with Live(console=console, auto_refresh=False) as live:
            for heard in _live(options.source, clock):
                for each in heard:
                    lookout.take(each)
                if clock.now() >= due:
                    due = after(clock.now(), REFRESH_S)
                    live.update(_table(lookout, clock.now(), options), refresh=True)
    except KeyboardInterrupt:
        _finish(console, lookout, clock.now(), options, options.source)
    return 0


def _live(spec: str, clock: MonotonicClock) -> Iterator[list[Heard]]:
    """What each turn of a live link brings, without end."""
    utc = UtcClock()
    nmea, aivdm, mavlink = Nmea2000Decoder(utc), AivdmDecoder(utc), MavlinkDecoder(system_id=0)
    is_stream = _is_stream(spec)
    link = MavlinkLink.open(spec, "FILE_OR_LINK") if is_stream else None
    bus = None if is_stream else CanBus.open(spec)
    try:
        while True:
            heard: list[Heard] = []
            if link is not None:
                clock.wait([f for f in (link.fileno(),) if f >= 0], after(clock.now(), WAIT_S))
                for data in link.receive():
                    said = data[:1] in (b"\xfd", b"\xfe")  # MAVLink 2 and 1
                    frame = Frame(clock.now(), Link.MAVLINK if said else Link.AIVDM, data)
                    heard += mavlink.decode(frame) if said else aivdm.decode(frame)
            elif bus is not None:
                clock.wait([f for f in (bus.fileno(),) if f >= 0], after(clock.now(), WAIT_S))
                for can_id, data in bus.receive():
                    heard += nmea.decode(Frame(clock.now(), Link.CAN, data, can_id))
            for each in heard:
                if isinstance(each, UtcTime):
                    utc.observe(each)
            yield heard
    finally:
        for opened in (link, bus):
            if opened is not None:
                opened.close()


def _is_stream(spec: str) -> bool:
    """UDP, TCP or a serial line, rather than a CAN bus; a name without a colon is a missing file."""
    try:
        parse(spec)
    except ConfigError:
        if ":" not in spec:
            text = "no such file, and no link such as udpin:0.0.0.0:10110 or socketcan:can0"
            raise ConfigError(f"FILE_OR_LINK = {spec!r}: {text}") from None
        return False
    return True


def _finish(console: Console, lookout: Lookout, now: Instant, options: Namespace, name: str) -> None:
    console.print(_table(lookout, now, options))
    _, tracks, own, frame, _ = lookout.show(now)
    if own is not None and frame is not None:
        draw(options.chart, tracks, now, own, frame, name)
        console.print(f"chart: {options.chart}", highlight=False)


def _table(lookout: Lookout, now: Instant, options: Namespace) -> Group:
    found, _, _, _, known = lookout.show(now)
    states = Counter(line.state for line in found)
    table = Table(
        title=f"{len(found)} contacts: " + ", ".join(f"{states[s]} {s}" for s in AgeState),
        caption=f"own position {known}",
    )
    left = ("MMSI", "name", "state", "source")
    titles = ("MMSI", "name", "age s", "state", "nm", "brg", "kn", "cog", "CPA nm", "TCPA min")
    for title in (*titles, "to set nm", "set km2", "source"):
        table.add_column(title, justify="left" if title in left else "right", no_wrap=True)
    for line in found[: options.most]:
        table.add_row(*_cells(line))
    if len(found) > options.most:
        table.add_row(f"+ {len(found) - options.most}")
    notes = [Text(f"{r.code}: {r.text}") for r in lookout.picture.notes(now)]
    return Group(table, *notes)


def _cells(line: Line) -> list[Text | str]:
    passed = line.tcpa_s <= 0
    return [
        str(line.mmsi),
        line.name[:18],
        f"{line.age_s:.0f}",
        Text(line.state.value, style=_STYLES[line.state]),
        f"{line.range_m / MILE_M:.2f}",
        f"{line.bearing_deg:03.0f}",
        f"{line.sog_mps / KNOT_MPS:.1f}",
        "-" if line.cog_deg is None else f"{line.cog_deg % 360:03.0f}",
        f"{line.cpa_m / MILE_M:.2f}",
        "passed" if passed else f"{line.tcpa_s / 60:.1f}",
        f"{line.distance_m / MILE_M:.2f}",
        f"{line.area_km2:.3g}",
        "+".join(line.sources),
    ]
