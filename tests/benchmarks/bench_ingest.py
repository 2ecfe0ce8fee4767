"""What it costs to hear: bytes in, reports, picture, tracks; printed as shares of one core.

    python -m tests.benchmarks.bench_ingest links [BOUNDS]     10 x each link's limit: decoding and picture
    python -m tests.benchmarks.bench_ingest step [BOUNDS]      2,000 ships updated and made sets in a step
    python -m tests.benchmarks.bench_ingest profile LINK       where the time goes: mavlink, can or aivdm
    python -m tests.benchmarks.bench_ingest mutate [MILLIONS]  damaged frames through every decoder (1)

BOUNDS is a bounds file's name, such as houston.  CPU time of this process.  The traffic of a full link is
played ten times as fast, so a step of 100 ms brings a second of it and one look at the tracks.  Not collected
by pytest.
"""

import cProfile
import gc
import pstats
import sys
import time

import numpy as np

from companion import config, reach
from companion.instant import instant
from companion.messages import ContactReport, Frame, Heard, Link, OwnPosition, Source, UtcTime
from companion.picture import Picture
from companion.utc import UtcClock
from tests.benchmarks import damage
from tests.contact_reports import FRAME
from tests.fleet import Fleet

TENFOLD, RUNS = 10, 4
SHIPS = 2000
BAUD_BYTES = 92_160  # of 921600 baud, a start and a stop bit to each byte
LIMITS = {Link.AIVDM: 75.0, Link.CAN: 370.0}  # reports a second
SECONDS = {Link.MAVLINK: 40.0, Link.CAN: 40.0, Link.AIVDM: 60.0}  # of the link at its limit


def frames(link: Link) -> tuple[list[list[Frame]], int]:
    """A link filled with position reports, as the frames of each step of 100 ms; and how many reports."""
    fleet = Fleet(SHIPS)
    rate = LIMITS.get(link) or BAUD_BYTES / len(fleet.ais_vessel(0, 0.0))
    count = round(rate * SECONDS[link])
    steps: list[list[Frame]] = []
    for i in range(count):
        at_s = i / rate
        while len(steps) <= at_s * 10 / TENFOLD:
            steps.append([])
        said = fleet.say(link, i % SHIPS, at_s)
        steps[-1] += [Frame(instant(at_s), link, data, can_id) for can_id, data in said]
    return steps, count


class Ear:
    """Decoder and picture of one link, driven as the core drives them."""

    def __init__(self, link: Link, bounds: str) -> None:
        self._utc = UtcClock()
        self._utc.observe(UtcTime(instant(0.0), Fleet.source, Fleet.utc_ns))
        self.decoder = damage.decoder_of(link, self._utc)
        self.picture = Picture(config.Contacts(bounds_file=bounds))
        self.reports = 0

    def decode(self, step: list[Frame]) -> list[Heard]:
        """The first half."""
        decode = self.decoder.decode
        return [each for frame in step for each in decode(frame)]

    def take(self, heard: list[Heard], at_s: float) -> None:
        """The second half, the tracks included."""
        self.picture.observe_own(self._own(at_s))
        for each in heard:
            if isinstance(each, ContactReport):
                self.reports += 1
                self.picture.observe(each)
            elif isinstance(each, OwnPosition):
                self.picture.observe_own(each)
        self.picture.tracks(instant(at_s), FRAME)

    def _own(self, at_s: float) -> OwnPosition:
        return OwnPosition(instant(at_s), Source.MAVLINK, FRAME.latitude_deg, FRAME.longitude_deg, 0.0)


def links(bounds: str) -> None:
    """Shares of one core at ten times each limit, the best of some runs."""
    print(f"{SHIPS} ships, {TENFOLD} x the link's limit, bounds file: {bounds or 'none'}")
    for link, seconds in SECONDS.items():
        steps, sent = frames(link)
        gc.collect()
        gc.freeze()  # what is to be played is not the companion's to look through
        (decoding, picturing), ear = min((_played(link, bounds, steps) for _ in range(RUNS)), key=_total)
        share = [100 * TENFOLD * cost / seconds for cost in (decoding, picturing)]
        print(
            f"  {link.value:8} {TENFOLD * sent / seconds:6.0f} reports/s: {sum(share):5.1f} % of a core "
            f"(decoding {share[0]:.1f}, picture {share[1]:.1f}), "
            f"{1e6 * (decoding + picturing) / sent:.1f} us each; "
            f"{sent - ear.reports} of {sent} lost; {len(ear.picture)} contacts"
        )


def _played(link: Link, bounds: str, steps: list[list[Frame]]) -> tuple[tuple[float, float], Ear]:
    ear = Ear(link, bounds)
    decoding = picturing = 0.0
    for k, each in enumerate(steps):
        begin = time.process_time()
        heard = ear.decode(each)
        middle = time.process_time()
        ear.take(heard, (k + 1.0) * TENFOLD / 10)
        decoding += middle - begin
        picturing += time.process_time() - middle
    return (decoding, picturing), ear


def _total(run: tuple[tuple[float, float], Ear]) -> float:
    return sum(run[0])


def step(bounds: str) -> None:
    """One step in which every ship was heard: observed, tracked, turned into sets."""
    fleet = Fleet(SHIPS)
    picture = Picture(config.Contacts(bounds_file=bounds))
    costs = []
    for k in range(12):
        at_s = 10.0 * k
        reports = [fleet.report(i, at_s) for i in range(SHIPS)]
        gc.collect()
        begin = time.process_time()
        for each in reports:
            picture.observe(each)
        observed = time.process_time()
        tracks = picture.tracks(instant(at_s), FRAME)
        tracked = time.process_time()
        reach.at(tracks, instant(at_s + 1.0)).nearest(np.zeros(2))
        costs.append((observed - begin, tracked - observed, time.process_time() - tracked))
    parts = 1e3 * np.median(costs[2:], axis=0)
    print(
        f"{len(tracks)} ships heard in one step, bounds file: {bounds or 'none'}: {parts.sum():.0f} ms "
        f"(reports {parts[0]:.0f}, tracks {parts[1]:.0f}, sets {parts[2]:.0f})"
    )


def profile(name: str, bounds: str) -> None:
    """Where the time goes."""
    link = Link(name)
    steps, _ = frames(link)
    ear = Ear(link, bounds)
    with cProfile.Profile() as found:
        for k, each in enumerate(steps):
            ear.take(ear.decode(each), (k + 1.0) * TENFOLD / 10)
    pstats.Stats(found).sort_stats("tottime").print_stats(28)


def main(arguments: list[str]) -> None:
    """Run the sub-command named first."""
    what, *rest = arguments or ["links"]
    if what == "profile":
        profile(rest[0], rest[1] if len(rest) > 1 else "")
    elif what == "mutate":
        damage.run(float(rest[0]) if rest else 1.0)
    else:
        {"links": links, "step": step}[what](rest[0] if rest else "")


if __name__ == "__main__":
    main(sys.argv[1:])
