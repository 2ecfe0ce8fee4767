"""The picture as a chart: every set, coloured by the age of its report."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from companion import reach
from companion.geodesy import LocalFrame
from companion.instant import Instant
from companion.messages import OwnPosition, Tracks
from companion.picture.ageing import AgeState, age_states

COLOURS = {
    AgeState.FRESH: "#2e8b57",
    AgeState.COASTING: "#d4a017",
    AgeState.STALE: "#d2691e",
    AgeState.UNBOUNDED: "#b22222",
}
_MILE_M = 1852.0
_NAMED = 40
_SHARE_SHOWN = 95.0  # per cent of the contacts; a few far ones would shrink the rest


def draw(path: Path, tracks: Tracks, now: Instant, own: OwnPosition, frame: LocalFrame, title: str) -> None:
    """Write a PNG, north up, nautical miles around us."""
    canvas = Figure(figsize=(11.0, 10.0), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.subplots()
    north, east = frame.to_local(own.latitude_deg, own.longitude_deg)
    states = age_states(tracks, now)
    sets = reach.at(tracks, now)
    for state, colour in COLOURS.items():
        rows = [i for i, found in enumerate(states) if found is state]
        if rows:
            shapes = [(sets.outline(i)[:, ::-1] - (east, north)) / _MILE_M for i in rows]
            axes.add_collection(
                PolyCollection(shapes, facecolors=colour, edgecolors=colour, alpha=0.45, lw=0.6)
            )
        axes.plot([], [], "s", color=colour, label=f"{state} ({len(rows)})")
    if len(tracks):
        x, y = (tracks.east_m - east) / _MILE_M, (tracks.north_m - north) / _MILE_M
        axes.plot(x, y, ".", color="#1b2a38", ms=2.5)
        off = np.hypot(x, y)
        for i in np.argsort(off, kind="stable")[:_NAMED]:
            axes.annotate(tracks.names[i] or str(tracks.mmsi[i]), (x[i], y[i]), fontsize=6, color="#1b2a38")
        reach_nm = max(float(np.percentile(off, _SHARE_SHOWN)) * 1.05, 0.5)
        axes.set_xlim(-reach_nm, reach_nm)
        axes.set_ylim(-reach_nm, reach_nm)
    axes.plot(0, 0, "^", color="#0b6e99", ms=9, label="we")
    axes.set_aspect("equal")
    axes.grid(alpha=0.25)
    axes.set_xlabel("nautical miles east")
    axes.set_ylabel("nautical miles north")
    axes.set_title(f"{title}: where each of {len(tracks)} contacts can be now")
    axes.legend(loc="upper right", fontsize=8)
    canvas.savefig(path, dpi=120)
