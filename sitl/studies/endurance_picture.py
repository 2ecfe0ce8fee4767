"""The endurance study's picture: how far each policy had come when, and where it was at the surface."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sitl.studies.lanes_picture import WIDTH_M

SURFACED_M = 1.0


def draw(
    path: Path, ways: Mapping[str, Sequence[tuple[float, float, float]]], channels_m: list[float]
) -> None:
    """`ways`: time (s), east (m) and depth (m) by title; `channels_m`: the channels' near edges."""
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.add_subplot()
    for near in channels_m:
        axes.axhspan(near / 1000, (near + WIDTH_M) / 1000, color="0.85", zorder=0)
    for title, way in ways.items():
        t, east, depth = np.array(way).T
        (line,) = axes.plot(t / 3600, east / 1000, lw=1, label=title)
        up = depth < SURFACED_M
        axes.plot(t[up] / 3600, east[up] / 1000, "o", ms=3, color=line.get_color())
    axes.set(xlabel="time (h)", ylabel="way east (km); channels grey, dots at the surface")
    axes.legend()
    FigureCanvasAgg(figure).print_figure(path)
