"""The pictures of docs/reachable_sets.md."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from companion import reach
from companion.config import Field
from companion.instant import instant
from companion.messages import Model
from companion.planning.field import ExactRepulsion
from tests.builders import tracks
from tests.ships import drive, swing

mpl.use("Agg")
import matplotlib.pyplot as plt

INK, SEA, RED = "#1f2a44", "#7fb2d9", "#c0392b"
SHIP = {
    "speed_noise_mps": 0.25,
    "course_noise_rad": 0.05,
    "heading_error_rad": 0.1,
    "bow_m": 150.0,
    "stern_m": 50.0,
}


def draw(folder: Path) -> None:
    """Write both pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    _sets(folder / "reachable_sets.png")
    _field(folder / "exact_field.png")


def _sets(path: Path) -> None:
    """A straight and a turning ship: set at one time, tube, sampled ships; and how silence grows them."""
    figure, axes = plt.subplots(1, 3, figsize=(15, 5), layout="constrained")
    rng = np.random.default_rng(0)
    straight = tracks({**SHIP, "cog_rad": 0.6, "position_error_m": 10.0})
    _tube(
        axes[0], straight, drive(rng, straight, 0, 120.0, 300.0, 4000), "straight: noise on speed and course"
    )
    ahead = tracks({**SHIP, "model": int(Model.TURNING), "cog_rad": 0.6})
    rate, error = np.array([0.006]), np.array([0.001])
    turning = replace(ahead, turn_rate_radps=rate, turn_rate_error_radps=error)
    _tube(
        axes[1], turning, swing(rng, turning, 0, 120.0, 300.0, 4000), "turning: 0.34 +- 0.06 degrees a second"
    )
    silent = tracks({**SHIP, "cog_rad": 0.6, "validity_s": 300.0})
    for age in (0.0, 100.0, 200.0, 300.0, 330.0, 360.0):
        outline = reach.at(silent, instant(age)).outline(0)
        colour = SEA if age <= 300 else RED
        axes[2].fill(outline[:, 1], outline[:, 0], facecolor=colour, edgecolor=INK, alpha=0.35, lw=0.8)
        axes[2].annotate(f"{age:.0f} s", (outline[:, 1].max(), outline[:, 0].mean()), fontsize=8)
    axes[2].set_title("silence: beyond 300 s, the validity, it grows on all sides")
    axes[0].legend(fontsize=8, loc="lower right")
    for axis in axes:
        axis.set(aspect="equal", xlabel="east, m", ylabel="north, m")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _tube(axis: Any, ship: Any, points: Any, title: str) -> None:
    now = instant(120.0)
    for outline in reach.tube(ship, now, 300.0).outlines(0):
        axis.fill(outline[:, 1], outline[:, 0], facecolor=SEA, edgecolor="none", alpha=0.9)
    at_once = reach.at(ship, now).outline(0)
    axis.plot(at_once[:, 1], at_once[:, 0], color=INK, lw=1.2, label="set at 120 s")
    axis.plot(points.imag, points.real, ".", color=INK, ms=1, alpha=0.5, label="sampled hull corners")
    axis.plot(0, 0, "+", color=RED, ms=9, label="reported position")
    axis.set_title(title)


def _field(path: Path) -> None:
    """Strength and direction of the repulsion around the paper's ship, age 120 s, T = 300 s."""
    ship, field = tracks({"cog_rad": np.pi / 2}), Field()
    east, north = np.meshgrid(np.linspace(450, 1700, 101), np.linspace(-250, 250, 61))
    sets, exact = reach.tube(ship, instant(120.0), 300.0), ExactRepulsion(field)
    positions = np.column_stack((north.ravel(), east.ravel()))
    velocity = np.array([exact.from_nearest(sets.nearest(p)).velocity[0] for p in positions])
    strength = np.hypot(*velocity.T).reshape(east.shape)
    figure, axis = plt.subplots(figsize=(10, 4.6), layout="constrained")
    levels = np.logspace(-4, 4, 17)
    shade = axis.contourf(
        east, north, np.clip(strength, 1e-4, 1e4), levels, cmap="Blues", norm=mpl.colors.LogNorm()
    )
    figure.colorbar(shade, label="repulsion, m/s")
    some = np.s_[::5, ::5]
    unit = velocity / np.hypot(*velocity.T)[:, None]
    u, v = (unit[:, k].reshape(east.shape)[some] for k in (1, 0))
    axis.quiver(east[some], north[some], u, v, color=INK, scale=42, width=0.0018)
    outline = sets.outline(0)
    axis.fill(outline[:, 1], outline[:, 0], facecolor="white", edgecolor=RED, lw=1.2)
    axis.set(
        aspect="equal", xlabel="east, m", ylabel="north, m", title="exact repulsion, eq. (8), around a tube"
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
