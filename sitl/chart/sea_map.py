"""The map: the vehicle's path, the ships and their sets at a few moments, one colour per time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Circle, Polygon

from companion.messages import FloatArray
from sitl.chart.labels import say_beyond, say_channel, say_closest, say_ends, say_times
from sitl.chart.scene import Channel, Scene, Snapshot, Window, routes
from sitl.chart.style import (
    CHANNEL,
    CHANNEL_EDGE,
    FAINT,
    GRID,
    INK,
    ROUTE,
    TEXT_PT,
    TIME_MAP,
    WATER,
    TimeColour,
)
from sitl.measure import Course
from sitl.summary import Summary

FEW_SETS = 8  # in the window at one moment; more are drawn fainter


def draw_map(
    axes: Axes,
    course: Course,
    summary: Summary,
    scene: Scene,
    view: Window,
    moments: list[Snapshot],
    colour: TimeColour,
) -> None:
    """Draw everything that lies in the window."""
    _frame(axes, view)
    if scene.channel is not None:
        _channel(axes, scene.channel, view)
        say_channel(axes, scene.channel, view)
    ways = [_xy(way) for way in routes(course, view)]
    axes.add_collection(LineCollection(ways, colors=ROUTE, linewidths=0.7, zorder=1))
    for moment in moments:
        _ships(axes, moment, colour)
    _path(axes, course, colour)
    for moment in moments:
        _own(axes, moment, colour)
    _ends(axes, scene)
    _beyond(axes, moments[-1], view, colour)
    say_ends(axes, course, scene, view)
    say_times(axes, moments, scene, view, colour)
    say_beyond(axes, moments, view)
    if summary.closest_set is not None:
        say_closest(axes, summary.closest_set, scene)


def _xy(points_m: FloatArray) -> FloatArray:
    """(..., 2) north, east to the plot's x, y."""
    return points_m[..., ::-1]


def _frame(axes: Axes, view: Window) -> None:
    axes.set_xlim(*view.east_m)
    axes.set_ylim(*view.north_m)
    axes.set_aspect("equal")
    axes.set_facecolor(WATER)
    axes.grid(color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    axes.annotate(
        "N",
        xy=(0.965, 0.985),
        xytext=(0.965, 0.91),
        xycoords="axes fraction",
        textcoords="axes fraction",
        ha="center",
        va="center",
        color=FAINT,
        fontsize=TEXT_PT,
        arrowprops={"arrowstyle": "-|>", "color": FAINT, "linewidth": 1.0},
    )


def _channel(axes: Axes, channel: Channel, view: Window) -> None:
    far = (4 * view.radius_m + float(np.hypot(*(channel.point_m - view.centre_m)))) * channel.along
    across = np.array((-channel.along[1], channel.along[0])) * channel.width_m / 2
    one, other, middle = channel.point_m - across, channel.point_m + across, channel.point_m
    corners = np.array((one - far, one + far, other + far, other - far))
    axes.add_patch(Polygon(_xy(corners), facecolor=CHANNEL, edgecolor="none", zorder=0.4))
    for edge in (one, other):
        axes.plot(*_xy(np.array((edge - far, edge + far))).T, color=CHANNEL_EDGE, linewidth=1.0, zorder=0.5)
    ends = _xy(np.array((middle - far, middle + far)))
    axes.plot(*ends.T, color=CHANNEL_EDGE, linewidth=0.8, dashes=(8, 6), zorder=0.5)


def _ships(axes: Axes, moment: Snapshot, colour: TimeColour) -> None:
    red, green, blue, _ = colour(moment.since_start_s)
    crowd = max(len(moment.sets_m) / FEW_SETS, 1.0)  # many sets over each other must not hide the path
    axes.add_collection(
        PolyCollection(
            [_xy(outline) for outline in moment.sets_m],
            facecolors=[(red, green, blue, 0.16 / crowd)],
            edgecolors=[(red, green, blue, 0.9 / crowd**0.5)],
            linewidths=0.9,
            zorder=2,
        )
    )
    axes.add_collection(
        PolyCollection(
            [_xy(hull) for hull in moment.hulls_m],
            facecolors=[(red, green, blue, 1.0)],
            edgecolors="white",
            linewidths=0.4,
            zorder=3,
        )
    )


def _path(axes: Axes, course: Course, colour: TimeColour) -> None:
    points = _xy(course.position_m)
    axes.plot(*points.T, color="white", linewidth=4.5, solid_capstyle="round", zorder=4)
    axes.add_collection(
        LineCollection(
            list(np.stack((points[:-1], points[1:]), axis=1)),
            array=course.since_start_s[:-1],
            cmap=TIME_MAP,
            norm=colour.norm,
            linewidths=2.6,
            capstyle="round",
            zorder=5,
        )
    )


def _own(axes: Axes, moment: Snapshot, colour: TimeColour) -> None:
    axes.plot(
        *_xy(moment.own_m),
        marker="o",
        markersize=7,
        markerfacecolor=colour(moment.since_start_s),
        markeredgecolor="white",
        markeredgewidth=1.3,
        zorder=7,
    )


def _ends(axes: Axes, scene: Scene) -> None:
    north_m, east_m = scene.goal_m
    ring = Circle((east_m, north_m), scene.goal_radius_m, fill=False, edgecolor=INK, linewidth=1.2, zorder=6)
    axes.add_patch(ring)
    axes.plot(east_m, north_m, "*", markersize=9, color=INK, markeredgecolor="white", zorder=8)
    axes.plot(*_xy(scene.start_m), "s", markersize=5, color=INK, markeredgecolor="white", zorder=8)


def _beyond(axes: Axes, moment: Snapshot, view: Window, colour: TimeColour) -> None:
    """A mark at the border toward every ship beyond it."""
    ships = np.column_stack((moment.truth.north_m, moment.truth.east_m))
    for ship in ships[~view.holds(ships)]:
        north, east = ship - view.centre_m
        axes.plot(
            *_xy(view.border_toward(ship)),
            marker=(3, 0, -float(np.degrees(np.arctan2(east, north)))),
            markersize=5,
            color=colour(moment.since_start_s),
            markeredgewidth=0,
            clip_on=False,
            zorder=9,
        )
