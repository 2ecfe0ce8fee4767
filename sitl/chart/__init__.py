"""The picture of a crossing: map, distances and depth, all coloured by one time scale."""

from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sitl.chart.header import draw_header
from sitl.chart.panels import draw_depth, draw_distance, draw_time
from sitl.chart.scene import Channel, Scene, snapshots, window
from sitl.chart.sea_map import draw_map
from sitl.chart.style import FAINT, GRID, INK, SMALL_PT, TEXT_PT, TimeColour
from sitl.measure import Course
from sitl.summary import Summary

__all__ = ["Channel", "Scene", "draw"]

WIDTH_IN, HEIGHT_IN, DPI = 10.5, 6.6, 175
MARGINS = {"left": 0.062, "right": 0.985, "top": 0.855, "bottom": 0.07}


def draw(path: Path, course: Course, summary: Summary, scene: Scene) -> None:
    """Write the picture as a PNG of `WIDTH_IN * DPI` by `HEIGHT_IN * DPI` pixels."""
    with rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)  # the figure's own canvas: no global state, no window
        sides = figure.add_gridspec(1, 2, width_ratios=(1.6, 1), **MARGINS, wspace=0.13)
        panels = sides[1].subgridspec(3, 1, height_ratios=(1.7, 1, 0.07), hspace=0.25)
        sea = figure.add_subplot(sides[0])
        time = figure.add_subplot(panels[2])
        distance = figure.add_subplot(panels[0], sharex=time)
        depth = figure.add_subplot(panels[1], sharex=time)

        box = sea.get_position()
        view = window(course, scene, (box.width * WIDTH_IN) / (box.height * HEIGHT_IN))
        since_s = course.since_start_s
        colour = TimeColour(float(since_s[0]), float(since_s[-1]))
        moments = snapshots(course, view)
        draw_map(sea, course, summary, scene, view, moments, colour)
        draw_distance(distance, course, summary, moments, colour)
        draw_depth(depth, course, moments, colour)
        draw_time(time, course, moments)
        draw_header(figure, summary, scene)
        figure.savefig(path)


STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": TEXT_PT,
    "axes.edgecolor": GRID,
    "axes.labelcolor": FAINT,
    "axes.labelsize": SMALL_PT,
    "axes.titlesize": TEXT_PT,
    "axes.titlecolor": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
}
