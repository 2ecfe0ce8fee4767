"""The two panels beside the map, over one time axis whose ground is the colour scale of the chart."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from companion.messages import FloatArray
from sitl.chart.scene import Snapshot
from sitl.chart.style import ALARM, FAINT, GRID, INK, SMALL_PT, TIME_MAP, WATER, TimeColour
from sitl.closest import Distances
from sitl.measure import DRAUGHT_M, Course
from sitl.summary import Summary

LINEAR_BELOW_M = 10.0  # near distances read linearly, far ones by their order of magnitude
DEEPEST_M = -20.0  # deeper inside a set the picture says no more
TICKS_M = (-10, 0, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000)


def draw_distance(
    axes: Axes, course: Course, summary: Summary, moments: list[Snapshot], colour: TimeColour
) -> None:
    """Distance to the nearest reachable set and to the nearest real hull, with delta."""
    _panel(axes, moments, colour)
    axes.set_title("horizontal distance of the vehicle (m)", loc="left")
    axes.set_yscale("symlog", linthresh=LINEAR_BELOW_M, linscale=0.6)
    hull_s, hull_m = _series(course, course.to_hulls)
    set_s, set_m = _series(course, course.to_sets)
    axes.plot(
        hull_s,
        hull_m,
        color=FAINT,
        linewidth=1.2,
        dashes=(3, 1.5),
        zorder=3,
        label="to the nearest real hull",
    )
    axes.plot(set_s, set_m, color=INK, linewidth=1.7, zorder=4, label="to the nearest reachable set")
    low, high = _range(np.concatenate((hull_m, set_m)), summary.delta_m)
    axes.set_ylim(low, high)
    ticks = [tick for tick in TICKS_M if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick}" for tick in ticks])
    axes.minorticks_off()
    axes.axhspan(low, summary.delta_m, color=ALARM, alpha=0.10, linewidth=0, zorder=1)
    axes.axhline(summary.delta_m, color=ALARM, linewidth=1.2, zorder=2)
    axes.annotate(
        f"delta = {summary.delta_m:g} m",
        (0.985, summary.delta_m),
        xycoords=("axes fraction", "data"),
        xytext=(0, -2.5),
        textcoords="offset points",
        ha="right",
        va="top",
        color=ALARM,
        fontsize=SMALL_PT,
    )
    closest = course.to_sets.least()
    if closest is not None:
        axes.plot(set_s[closest], set_m[closest], "o", markersize=8, fillstyle="none", color=ALARM, zorder=5)
    axes.legend(loc="best", fontsize=SMALL_PT, labelcolor=INK, framealpha=0.85, edgecolor="none")
    axes.tick_params(labelbottom=False)


def draw_depth(axes: Axes, course: Course, moments: list[Snapshot], colour: TimeColour) -> None:
    """Depth over time, downward, with the keel assumed of every ship."""
    _panel(axes, moments, colour)
    axes.set_title("depth of the vehicle (m)", loc="left")
    points = np.column_stack((course.since_start_s, course.depth_m))
    axes.add_collection(
        LineCollection(
            list(np.stack((points[:-1], points[1:]), axis=1)),
            array=points[:-1, 0],
            cmap=TIME_MAP,
            norm=colour.norm,
            linewidths=2.4,
            capstyle="round",
            zorder=4,
        )
    )
    axes.axhline(DRAUGHT_M, color=FAINT, linewidth=1.0, dashes=(3, 1.5), zorder=2)
    axes.annotate(
        f"keel of a ship of {DRAUGHT_M:g} m draught",
        (0.5, DRAUGHT_M),
        xycoords=("axes fraction", "data"),
        xytext=(0, -2.5),
        textcoords="offset points",
        ha="center",
        va="top",
        color=FAINT,
        fontsize=SMALL_PT,
    )
    deepest = max(float(course.depth_m.max()), 2 * DRAUGHT_M)
    axes.set_ylim(deepest * 1.12, -deepest * 0.10)
    axes.tick_params(labelbottom=False)


def draw_time(axes: Axes, course: Course, moments: list[Snapshot]) -> None:
    """The time axis of both panels, which is the colour scale of the whole picture."""
    begin, end = float(course.since_start_s[0]), float(course.since_start_s[-1])
    axes.imshow(
        np.linspace(0.0, 1.0, 256)[None, :],
        cmap=TIME_MAP,
        aspect="auto",
        extent=(begin, max(end, begin + 1.0), 0, 1),
    )
    axes.set_xlim(begin, max(end, begin + 1.0))
    axes.set_yticks([])
    axes.set_xlabel("time since the start (s): the colour of path, hulls and sets")
    for moment in moments:
        axes.plot(moment.since_start_s, 0.5, "o", markersize=5.5, color="white", markeredgewidth=0, zorder=3)


def _panel(axes: Axes, moments: list[Snapshot], colour: TimeColour) -> None:
    axes.set_facecolor(WATER)
    axes.grid(color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)
    for moment in moments:
        axes.axvline(
            moment.since_start_s, color=colour(moment.since_start_s), linewidth=1.3, alpha=0.7, zorder=1.5
        )


def _series(course: Course, distances: Distances) -> tuple[FloatArray, FloatArray]:
    shown = np.where(np.isfinite(distances.nearest_m), distances.nearest_m, np.nan)
    return course.since_start_s[distances.step], shown


def _range(shown_m: FloatArray, delta_m: float) -> tuple[float, float]:
    some = shown_m[np.isfinite(shown_m)]
    low, high = (float(some.min()), float(some.max())) if len(some) else (0.0, 100.0)
    return min(0.0, max(low * 1.3, DEEPEST_M)), max(high * 1.3, 10 * delta_m)
