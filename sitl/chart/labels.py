"""What the map says in words: start, goal, times, the closest approach, what lies beyond the border."""

from itertools import takewhile
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from companion.messages import FloatArray, Phase
from sitl.chart.scene import Channel, Scene, Snapshot, Window
from sitl.chart.style import ALARM, FAINT, INK, SMALL_PT, TEXT_PT, Rgba, TimeColour
from sitl.measure import Course
from sitl.summary import Approach

HALO = [withStroke(linewidth=2.5, foreground="white")]

Side = Literal["left", "right", "center"]


def say(
    axes: Axes,
    text: str,
    point_m: FloatArray,
    offset_pt: tuple[float, float],
    colour: str | Rgba,
    ha: Side = "left",
) -> None:
    """A word beside a point (2,), north and east, readable on any ground."""
    axes.annotate(
        text,
        xy=(point_m[1], point_m[0]),
        xytext=offset_pt,
        textcoords="offset points",
        ha=ha,
        va="center",
        color=colour,
        fontsize=TEXT_PT,
        path_effects=HALO,
        zorder=9,
    )


def say_ends(axes: Axes, course: Course, scene: Scene, view: Window) -> None:
    """Start and goal with their positions, and how long the vehicle listened."""
    steps = zip(course.since_start_s.tolist(), course.phase, strict=True)
    listening_s = [since_s for since_s, _ in takewhile(lambda at: at[1] in (Phase.WAIT, Phase.LISTEN), steps)]
    start, goal = f"start  {position(scene, scene.start_m)}", f"goal  {position(scene, scene.goal_m)}"
    heard = f"surfaced, listening for {listening_s[-1] - listening_s[0]:.0f} s" if listening_s else ""
    if scene.runs_east_west:
        eastward = scene.goal_m[1] >= scene.start_m[1]
        near: Side = "left" if eastward else "right"
        far: Side = "right" if eastward else "left"
        inward = -8 if eastward else 8
        say(axes, start, scene.start_m, (inward, -15), INK, near)
        say(axes, heard, scene.start_m, (inward, -27), FAINT, near)
        apart_m = abs(scene.goal_m[1] - scene.start_m[1])
        below = -19 if apart_m > 1.1 * view.half_m[1] else -43  # clear of the start's own lines
        say(axes, goal, scene.goal_m, (-inward, below), INK, far)
    else:
        outward = -1 if scene.goal_m[0] >= scene.start_m[0] else 1
        say(axes, start, scene.start_m, (12, 9 * outward), INK)
        say(axes, heard, scene.start_m, (12, 21 * outward), FAINT)
        say(axes, goal, scene.goal_m, (13, -8 * outward), INK)


def say_times(axes: Axes, moments: list[Snapshot], scene: Scene, view: Window, colour: TimeColour) -> None:
    """The time beside each place of the vehicle, on alternate sides where they crowd."""
    other = False
    for k, moment in enumerate(moments):
        moved = np.abs(moment.own_m - moments[k - 1].own_m) if k else view.half_m
        other = not other if (moved < 0.08 * view.half_m).all() else False
        text, ink = f"{moment.since_start_s:.0f} s", colour.ink(moment.since_start_s)
        if scene.runs_east_west:
            say(axes, text, moment.own_m, (0, -11 if other else 11), ink, "center")
        else:
            say(axes, text, moment.own_m, (9 if other else -9, 0), ink, "left" if other else "right")


def say_closest(axes: Axes, closest: Approach, scene: Scene) -> None:
    """A ring where a set was nearest, and how near which."""
    where = (closest.east_m, closest.north_m)
    axes.plot(*where, "o", markersize=12, fillstyle="none", color=ALARM, markeredgewidth=1.4, zorder=8)
    axes.annotate(
        f"{nearness(closest.distance_m)} the set of\n{closest.name or closest.mmsi}: the closest",
        xy=where,
        xytext=(-40, 40) if scene.runs_east_west else (46, -30),
        textcoords="offset points",
        ha="right" if scene.runs_east_west else "left",
        va="bottom" if scene.runs_east_west else "top",
        color=ALARM,
        fontsize=TEXT_PT,
        path_effects=HALO,
        arrowprops={
            "arrowstyle": "-",
            "color": ALARM,
            "linewidth": 1.0,
            "shrinkB": 6,
            "relpos": (1, 0.2) if scene.runs_east_west else (0, 0.8),
        },
        zorder=9,
    )


def say_channel(axes: Axes, channel: Channel, view: Window) -> None:
    """The channel's name along its middle, at the border of the picture."""
    # the southern or eastern end: the northern one has the notes
    along = channel.along if channel.along[1] - channel.along[0] > 0 else -channel.along
    edge = view.border_toward(view.centre_m + along)
    point = channel.point_m + (float((edge - channel.point_m) @ along) - 0.12 * view.radius_m) * along
    turn_deg = float(np.degrees(np.arctan2(along[0], along[1])))
    axes.text(
        point[1],
        point[0],
        f"channel, {channel.width_m:.0f} m",
        rotation=(turn_deg + 90) % 180 - 90,
        rotation_mode="anchor",
        ha="center",
        va="center",
        color=FAINT,
        fontsize=SMALL_PT,
        path_effects=HALO,
        zorder=1.5,
    )


def say_beyond(axes: Axes, moments: list[Snapshot], view: Window) -> None:
    """What the picture cannot show: ships outside it, and sets larger than it."""
    last = moments[-1]
    beyond = int((~view.holds(np.column_stack((last.truth.north_m, last.truth.east_m)))).sum())
    said = [f"{beyond} ships outside at {last.since_start_s:.0f} s"] if beyond else []
    unbounded = [moment for moment in moments if moment.everywhere]
    if unbounded:
        since = f"{unbounded[0].since_start_s:.0f} s"
        said.append(f"{unbounded[0].everywhere} ships at {since} unheard so long they can be anywhere here")
    axes.annotate(
        "\n".join(said),
        (0.012, 0.988),
        xycoords="axes fraction",
        va="top",
        color=FAINT,
        fontsize=SMALL_PT,
        path_effects=HALO,
        zorder=9,
    )


def nearness(distance_m: float) -> str:
    """How near, for a signed distance."""
    return f"{distance_m:.1f} m from" if distance_m > 0 else f"{-distance_m:.1f} m inside"


def position(scene: Scene, point_m: FloatArray) -> str:
    """A point as latitude and longitude."""
    latitude, longitude = scene.frame.to_geodetic(float(point_m[0]), float(point_m[1]))
    return f"{degrees(latitude, 'N', 'S')}  {degrees(longitude, 'E', 'W')}"


def degrees(angle_deg: float, positive: str, negative: str) -> str:
    """An angle for people: 59.7213° N."""
    return f"{abs(angle_deg):.4f}° {positive if angle_deg >= 0 else negative}"
