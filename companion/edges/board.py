"""`companion run`: opens the links, turns the loop until told to stop, closes the log."""

import time
from argparse import Namespace
from contextlib import ExitStack
from pathlib import Path
from threading import Event

from rich.console import Console

from companion.build import Companion, build
from companion.config import Config, from_mapping, load
from companion.edges.can_bus import CanBus
from companion.edges.console import StatusLine
from companion.edges.live import LinkSink, LiveSource, MonotonicClock
from companion.edges.mavlink import MavlinkLink
from companion.edges.run_folder import new_run_folder
from companion.edges.stopping import stop_on_signals
from companion.errors import ConfigError
from companion.instant import Instant
from companion.loop import Journal, Journals, Tick
from companion.loop import run as run_loop
from companion.messages import Decision, Phase
from companion.planning import certificate
from companion.record import LOG_NAME, Recorder
from companion.record.session import session


class StopOnArrival:
    """A journal that ends the run once the vehicle has surfaced at the goal."""

    def __init__(self, stop: Event) -> None:
        self._stop = stop

    def decided(self, decision: Decision) -> None:
        """Look at the phase."""
        if decision.phase is Phase.ARRIVED:
            self._stop.set()

    def tick(self, tick: Tick) -> None:
        """Nothing to look at."""

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """Nothing to look at."""

    def timed(self, t: Instant, step_s: float) -> None:
        """Nothing to look at."""


def run(options: Namespace) -> int:
    """Steer a vehicle; exit status 0 however the run was ended, once it has begun."""
    console = Console(stderr=True)
    config = _configuration(options)
    if options.require_certificate and config.repulsion.kind == "network":
        for model in filter(None, (config.repulsion.model, config.repulsion.turning_model)):
            held = certificate.check(model)
            console.print(f"certificate of {held.model} holds", highlight=False)
    companion = build(config)
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals())
        clock = MonotonicClock(speedup=options.speedup)
        link = MavlinkLink.open(config.links.mavlink)
        stack.callback(link.close)
        receiver = None
        if config.links.aivdm:
            receiver = MavlinkLink.open(config.links.aivdm, "links.aivdm")
            stack.callback(receiver.close)
        buses: list[CanBus] = []
        for spec in config.links.can:
            buses.append(CanBus.open(spec))
            stack.callback(buses[-1].close)
        recorder = _recorder(config, companion, console)
        line = stack.enter_context(StatusLine(console, lambda: _troubles(link, receiver, buses, recorder)))
        journals: list[Journal] = [line]
        if recorder is not None:
            journals.append(stack.enter_context(recorder))
        if options.until_arrived:
            journals.append(StopOnArrival(stop))
        source = LiveSource(link, buses, config.timing.rate_hz, clock=clock, stop=stop, aivdm=receiver)
        sink = LinkSink(link, clock)
        last = run_loop(
            source, companion.core, companion.encoder, sink, Journals(journals), time.perf_counter
        )
    _say_farewell(console, last, recorder)
    counts = link.counts + sink.counts
    for bus in buses:
        counts += bus.counts
    counts["loop.skipped_ticks"] = source.skipped
    said = ", ".join(f"{key} {n}" for key, n in sorted(counts.items()) if n)
    console.print(f"links and loop: {said or 'nothing to report'}", highlight=False)
    return 0


def _troubles(
    link: MavlinkLink, receiver: MavlinkLink | None, buses: list[CanBus], recorder: Recorder | None
) -> list[str]:
    """What is broken around the loop, a few words each."""
    said = [] if link.state in ("up", "closed") else [f"MAVLink {link.state}"]
    if receiver is not None and receiver.state not in ("up", "closed"):
        said.append(f"AIS receiver {receiver.state}")
    said += [f"CAN {bus.state}" for bus in buses if bus.state not in ("up", "closed")]
    if recorder is not None and recorder.failed is not None:
        said.append(recorder.failed)
    return said


def _configuration(options: Namespace) -> Config:
    over: dict[str, dict[str, object]] = {}
    if options.goal is not None:
        over["goal"] = dict(zip(("latitude_deg", "longitude_deg"), options.goal, strict=True))
    if options.mavlink is not None:
        over.setdefault("links", {})["mavlink"] = options.mavlink
    if options.can is not None:
        over.setdefault("links", {})["can"] = options.can
    if options.out is not None:
        over["recording"] = {"folder": str(options.out)}
    if options.config is not None:
        return load(options.config, over)
    if "goal" not in over:
        raise ConfigError("no goal: give --goal LAT,LON, or --config FILE with a [goal] table")
    return from_mapping(dict(over), "options")


def _recorder(config: Config, companion: Companion, console: Console) -> Recorder | None:
    if not config.recording.folder:
        console.print("recording.folder is empty: nothing is recorded", style="yellow")
        return None
    folder = new_run_folder(Path(config.recording.folder))
    console.print(f"recording to {folder}", highlight=False)
    return Recorder(folder / LOG_NAME, session(config, companion.model_digest, companion.turning_digest))


def _say_farewell(console: Console, last: Decision | None, recorder: Recorder | None) -> None:
    if last is not None:
        console.print(f"ended in phase {last.phase.value}, status {last.status.value}", highlight=False)
    if recorder is not None and recorder.failed is not None:
        console.print(recorder.failed, style="red", highlight=False)
    elif recorder is not None:
        console.print(f"log closed: {recorder.path}", highlight=False)
