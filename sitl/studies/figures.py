"""The paper's two figures of the UUV case: eight snapshots of a crossing, and the trials' least distances."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from companion import reach
from companion.instant import Instant
from companion.messages import FloatArray
from sitl.studies.case import Crossing
from sitl.studies.crossing import Crossed, cross
from sitl.studies.planners import PLANNERS
from sitl.studies.ships import Ships, draw
from sitl.studies.trials import Outcome

COLOURS = {
    "network": "#0a7abf",
    "exact": "#e8820c",
    "no-uncertainty": "#8a3fbf",
    "improved": "#14874a",
    "orca": "#b8143c",
    "search": "#666666",
}
SNAPSHOTS = 8
SHOWN = 3  # planners in the snapshots, as in the paper


def distances(path: Path, case: Crossing, outcomes: Sequence[Outcome]) -> None:
    """Least distance to the reachable sets, trial by trial, above the safety threshold."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.subplots()
    names = list(dict.fromkeys(o.planner for o in outcomes))
    for name in names:
        mine = [o for o in outcomes if o.planner == name]
        trial = np.array([o.trial for o in mine])
        near = np.array([o.to_set_m for o in mine]) - case.delta_m
        size = 5.0 if len(mine) <= 100 else 2.0
        axes.plot(trial, near, "o", ms=size, color=COLOURS.get(name, "black"), label=PLANNERS[name].title)
    axes.axhline(0.0, color="black", lw=0.8)
    axes.set_xlabel("trial")
    axes.set_ylabel(f"least distance to the sets above delta = {case.delta_m:g} m (m)")
    axes.legend(fontsize=7, loc="best")
    _save(figure, path)


def snapshots(path: Path, case: Crossing, seed: int, outcomes: Sequence[Outcome], kernel: str) -> None:
    """Eight moments of one trial with the first three planners: the one in which they differ most."""
    names = list(dict.fromkeys(o.planner for o in outcomes))[:SHOWN]
    trial = min((o for o in outcomes if o.planner in names), key=lambda o: o.to_set_m).trial
    ships = draw(case, seed, range(trial, trial + 1))
    runs = {
        name: cross(case, ships, lambda tracks, m, name=name: PLANNERS[name].make(case, tracks, m, kernel))  # type: ignore[misc]
        for name in names
    }
    figure = Figure(figsize=(12, 7), layout="constrained")
    panels = figure.subplots(2, SNAPSHOTS // 2, sharex=True, sharey=True).ravel()
    end = max(int(run.paths.last.max()) for run in runs.values())
    for panel, step in zip(panels, np.linspace(0.3 * end, end, SNAPSHOTS).astype(int), strict=True):
        _snapshot(panel, case, ships, runs, int(step))
    panels[0].legend(fontsize=7, loc="upper left")
    figure.supxlabel(f"east, across the channel (m); trial {trial}, seed {seed}")
    figure.supylabel("north, along the channel (m)")
    _save(figure, path)


def _snapshot(axes: Axes, case: Crossing, ships: Ships, runs: dict[str, Crossed], step: int) -> None:
    t = Instant(int(next(iter(runs.values())).paths.t_ns[step]))
    axes.axvspan(0.0, case.channel_m, color="#eef3f7")
    sets = reach.at(ships.reported, t)
    truth = ships.truth(t)
    for i in range(len(sets)):
        outline = sets.outline(i)
        axes.fill(outline[:, 1], outline[:, 0], color="#9fd3ee", lw=0)
        hull = _hull(truth.north_m[i], truth.east_m[i], truth.heading_rad[i], case)
        axes.fill(hull[:, 1], hull[:, 0], color="#c8102e", lw=0)
    for name, run in runs.items():
        until = min(step, int(run.paths.last[0]))
        way = run.paths.position_m[: until + 1, 0]
        axes.plot(way[:, 1], way[:, 0], color=COLOURS.get(name, "black"), lw=1.2, label=PLANNERS[name].title)
        axes.plot(*way[-1][::-1], "o", ms=4, color=COLOURS.get(name, "black"))
    axes.plot(case.goal_m[1], case.goal_m[0], "s", ms=6, color="#14874a")
    axes.set_xlim(case.start_m[1] - 30, case.goal_m[1] + 30)
    axes.set_ylim(-620, 620)
    axes.set_aspect("equal")
    axes.set_title(f"{t * 1e-9:.0f} s", fontsize=9)


def _hull(north: float, east: float, heading: float, case: Crossing) -> FloatArray:
    along, aside = case.length_m / 2, case.beam_m / 2
    corners = np.array(((along, aside), (-along, aside), (-along, -aside), (along, -aside)))
    cos, sin = np.cos(heading), np.sin(heading)
    return np.asarray(corners @ np.array(((cos, sin), (-sin, cos))) + np.array((north, east)))


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    figure.savefig(path)
