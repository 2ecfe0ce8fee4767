"""`companion picture`: the contacts of a recording or of a live link, as a table and a chart."""

import os
from argparse import Namespace
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from rich.console import Console, Group
from rich.live import Live

from companion import config
from companion.edges.live import MonotonicClock
from companion.edges.lookout_chart import draw
from companion.edges.lookout_links import live
from companion.edges.lookout_table import table
from companion.edges.stopping import stop_on_signals
from companion.edges.traffic import read
from companion.errors import ConfigError
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, Instant, after
from companion.messages import ContactReport, Heard, OwnPosition, Source, Tracks
from companion.picture import Picture
from companion.picture.view import Line, lines

REFRESH_S = 1.0
WIDE = 140


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
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console = Console(width=WIDE)  # a file or a pipe has no width of its own
    lookout = Lookout(contacts, options.own)
    files = [Path(source) for source in options.source if Path(source).is_file()]
    if not files:
        return _watch(console, lookout, options)
    if len(options.source) > 1:
        raise ConfigError("FILE_OR_LINK: give one file, or one or more links")
    (path,) = files
    counts: Counter[str] = Counter()
    _hear(lookout, read(path, counts), options.at)
    if lookout.now is None:
        console.print(f"{path}: nothing was heard", style="yellow")
        return 1
    _finish(console, lookout, after(lookout.now, options.silence), options, path.name)
    return 0


def _hear(lookout: Lookout, heard: Iterable[Heard], until_s: float | None) -> None:
    begin: Instant | None = None
    for each in heard:
        lookout.take(each)
        if lookout.now is not None:
            begin = lookout.now if begin is None else begin
            if until_s is not None and lookout.now - begin > until_s * NS_PER_S:
                return


def _watch(console: Console, lookout: Lookout, options: Namespace) -> int:
    """Live links, until interrupted; what is no terminal gets a line for every new number of contacts."""
    clock = MonotonicClock(options.speedup)
    due, known = clock.now(), -1
    with stop_on_signals() as stop, Live(console=console, auto_refresh=False) as screen:
        for heard in live(options.source, clock, stop):
            for each in heard:
                lookout.take(each)
            if console.is_terminal and clock.now() >= due:
                due = after(clock.now(), REFRESH_S)
                screen.update(_table(console, lookout, clock.now(), options), refresh=True)
            if not console.is_terminal and len(lookout.picture) != known:
                known = len(lookout.picture)
                print(f"{known} contacts on {' '.join(options.source)}", flush=True)
    _finish(console, lookout, clock.now(), options, " ".join(options.source))
    return 0


def _finish(console: Console, lookout: Lookout, now: Instant, options: Namespace, name: str) -> None:
    console.print(_table(console, lookout, now, options))
    _, tracks, own, frame, _ = lookout.show(now)
    if own is not None and frame is not None:
        draw(options.chart, tracks, now, own, frame, name)
        console.print(f"chart: {options.chart}", highlight=False)


def _table(console: Console, lookout: Lookout, now: Instant, options: Namespace) -> Group:
    found, _, _, _, known = lookout.show(now)
    return table(found, lookout.picture, known, lookout.picture.notes(now), options.most, console)
