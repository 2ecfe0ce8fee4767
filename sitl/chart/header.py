"""Title, the run in one line, and the legend."""

from textwrap import shorten

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sitl.chart.scene import Scene
from sitl.chart.style import ALARM, FAINT, INK, ROUTE, TEXT_PT, TIME_MAP, TITLE_PT
from sitl.summary import Summary

MOST_LETTERS = 125  # of the line below the title


def draw_header(figure: Figure, summary: Summary, scene: Scene) -> None:
    """Above the panels: what this is, what came of it, how to read it."""
    figure.text(0.062, 0.958, scene.title, fontsize=TITLE_PT, color=INK, fontweight="bold", va="center")
    figure.text(
        0.062,
        0.922,
        outcome(summary),
        fontsize=TEXT_PT + 0.5,
        color=ALARM if summary.failures else FAINT,
        va="center",
    )
    tone = TIME_MAP(0.45)
    handles = [
        Line2D([], [], color=tone, linewidth=2.6, marker="o", markeredgecolor="white", label="the vehicle"),
        Patch(facecolor=tone, label="a ship as it really is"),
        Patch(facecolor=(*tone[:3], 0.16), edgecolor=tone, label="everywhere it can be by then"),
        Line2D([], [], color=ROUTE, linewidth=1.0, label="the ship's way"),
    ]
    figure.legend(
        handles=handles,
        loc="center left",
        bbox_to_anchor=(0.055, 0.882),
        ncols=len(handles),
        frameon=False,
        fontsize=TEXT_PT,
        labelcolor=INK,
        handlelength=1.5,
        columnspacing=1.3,
        borderpad=0,
    )


def outcome(summary: Summary) -> str:
    """The run in one line; its failures, if there were any."""
    if summary.failures:
        return shorten("; ".join(summary.failures), MOST_LETTERS, placeholder=" ...")
    said = []
    if summary.time_to_goal_s is not None:
        said.append(f"at the goal after {summary.time_to_goal_s:.0f} s")
    if summary.closest_set is not None:
        said.append(f"never nearer than {summary.closest_set.distance_m:.1f} m to a reachable set")
    if summary.closest_hull is not None:
        said.append(f"{summary.closest_hull.distance_m:.1f} m to a real hull")
    if summary.oldest_used_s is not None:
        said.append(f"steered by reports up to {summary.oldest_used_s:.0f} s old")
    return ",  ".join(said)
