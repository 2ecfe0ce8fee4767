"""`companion demo`: the whole product in one process on a simulated or recorded sea, and its picture."""

import math
import time
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from companion.build import Companion, build
from companion.config import Config, from_mapping, tables_of
from companion.edges.run_folder import new_run_folder
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S
from companion.loop import Journals, run
from companion.record import LOG_NAME, Recorder
from companion.record.session import session
from sitl import chart, logbook
from sitl.launch import recorded_sea, scenario_sea
from sitl.lockstep import LockstepSea
from sitl.measure import Course, Measure
from sitl.scenario import Scenario, load
from sitl.sea import Sea
from sitl.summary import Summary

EXIT_OK, EXIT_FAILED = 0, 1
SIMULATED, RECORDED = "uuv_crossing", "recorded_crossing"


def demo(options: Namespace) -> int:
    """Run, measure, write the run folder; 1 when the vehicle came within delta or did not arrive."""
    console = Console(highlight=False)
    scenario = load(options.scenario or (RECORDED if options.traffic else SIMULATED))
    sea = _sea(options, scenario, console)
    config = from_mapping(scenario.companion_tables(sea.goal_deg, _overrides(options)), "demo")
    companion = build(config)
    folder = new_run_folder(options.out)
    course, summary = _cross(sea, config, companion, folder, console)
    (folder / "summary.json").write_bytes(summary.to_json())
    chart.draw(folder / "crossing.png", course, summary, _scene(sea, scenario, options.traffic))
    console.print(summary.table())
    console.print(f"run folder: {folder}  (summary.json, {LOG_NAME}, crossing.png)")
    for sentence in summary.failures:
        console.print(sentence, style="bold red")
    return EXIT_FAILED if summary.failures else EXIT_OK


def _sea(options: Namespace, scenario: Scenario, console: Console) -> Sea:
    if options.traffic is None:
        return scenario_sea(scenario, seed=options.seed, start=options.start, goal=options.goal)
    with console.status(f"reading {options.traffic}"):
        log = logbook.read(options.traffic)
    return recorded_sea(scenario, log, start=options.start, goal=options.goal)


def _overrides(options: Namespace) -> dict[str, dict[str, Any]]:
    over: dict[str, dict[str, Any]] = {} if options.config is None else tables_of(options.config)
    over.pop("goal", None)  # the sea's own
    if options.repulsion is not None:
        over["repulsion"] = {**over.get("repulsion", {}), "kind": options.repulsion}
    if options.planner is not None:
        over["planner"] = {**over.get("planner", {}), "horizon": options.planner}
    return over


def _cross(
    sea: Sea, config: Config, companion: Companion, folder: Path, console: Console
) -> tuple[Course, Summary]:
    """Turn the loop to the end of the run, recording and measuring."""
    measure = Measure(sea.truth, sea.own_state, config.field.delta_m, sea.traffic.known_until_s)
    lockstep = LockstepSea(sea, dt_s=1.0 / config.timing.rate_hz)
    with (
        Recorder(
            folder / LOG_NAME, session(config, companion.model_digest, companion.turning_digest)
        ) as recorder,
        _Bar(sea, console) as bar,
    ):
        lockstep.after_tick = bar.show
        journals = Journals((recorder, measure))
        run(lockstep, companion.core, companion.encoder, lockstep, journals, time.perf_counter)
    if recorder.failed is not None:
        console.print(recorder.failed, style="red")
    # the companion's local origin is where it first heard of itself: the start, as its autopilot told it
    origin = companion.core.frame
    origin_m = np.zeros(2) if origin is None else np.array(_local(sea.frame, origin))
    course = measure.course(origin_m)
    return course, measure.summary(course)


def _local(frame: LocalFrame, origin: LocalFrame) -> tuple[float, float]:
    return frame.to_local(origin.latitude_deg, origin.longitude_deg)


def _scene(sea: Sea, scenario: Scenario, traffic: Path | None) -> chart.Scene:
    title, channel = scenario.title, None
    if traffic is None:
        lanes = scenario.channel
        point = np.array(sea.frame.to_local(lanes.latitude_deg, lanes.longitude_deg))
        channel = chart.Channel(point, math.radians(lanes.course_deg), lanes.width_m)
    else:
        title = f"{scenario.title}: {traffic.name}"
    start_m = np.array(sea.frame.to_local(*sea.start_deg))
    return chart.Scene(title, sea.frame, start_m, np.array(sea.finish.goal_m), sea.finish.radius_m, channel)


class _Bar:
    """Progress in simulated time: what is left to the goal, and how fast the machine sails."""

    def __init__(self, sea: Sea, console: Console) -> None:
        self._whole_m = max(sea.to_goal_m, 1.0)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[said]}"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
        )
        self._task = self._progress.add_task("crossing", total=1.0, said="")
        self._shown_s = -math.inf

    def __enter__(self) -> "_Bar":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def show(self, sea: Sea) -> None:
        """Once a simulated second."""
        now_s = sea.now / NS_PER_S
        if now_s - self._shown_s < 1.0:
            return
        self._shown_s = now_s
        said = f"{now_s:5.0f} s  depth {sea.state.depth_m:4.1f} m  {sea.to_goal_m:5.0f} m to go"
        self._progress.update(self._task, completed=max(1 - sea.to_goal_m / self._whole_m, 0.0), said=said)
