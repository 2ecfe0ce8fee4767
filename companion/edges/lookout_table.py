"""The picture as a table for a terminal."""

from collections import Counter

from rich.console import Group
from rich.table import Table
from rich.text import Text

from companion.messages import Reason
from companion.picture.ageing import AgeState
from companion.picture.view import Line

KNOT_MPS, MILE_M = 1852 / 3600, 1852.0
_STYLES = {
    AgeState.FRESH: "green",
    AgeState.COASTING: "yellow",
    AgeState.STALE: "dark_orange",
    AgeState.UNBOUNDED: "bold red",
}


def table(found: list[Line], known: str, notes: list[Reason], most: int) -> Group:
    """The contacts as a table, what is to be known of them below; `known` is how our position is known."""
    states = Counter(line.state for line in found)
    shown = Table(
        title=f"{len(found)} contacts: " + ", ".join(f"{states[s]} {s}" for s in AgeState),
        caption=f"own position {known}",
    )
    left = ("MMSI", "name", "state", "source")
    titles = ("MMSI", "name", "age s", "state", "nm", "brg", "kn", "cog", "CPA nm", "TCPA min")
    for title in (*titles, "to set nm", "set km2", "source"):
        shown.add_column(title, justify="left" if title in left else "right", no_wrap=True)
    for line in found[:most]:
        shown.add_row(*_cells(line))
    if len(found) > most:
        shown.add_row(f"+ {len(found) - most}")
    return Group(shown, *(Text(f"{reason.code}: {reason.text}") for reason in notes))


def _cells(line: Line) -> list[Text | str]:
    passed = line.tcpa_s <= 0
    return [
        str(line.mmsi),
        line.name[:18],
        f"{line.age_s:.0f}",
        Text(line.state.value, style=_STYLES[line.state]),
        f"{line.range_m / MILE_M:.2f}",
        f"{line.bearing_deg:03.0f}",
        f"{line.sog_mps / KNOT_MPS:.1f}",
        "-" if line.cog_deg is None else f"{line.cog_deg % 360:03.0f}",
        f"{line.cpa_m / MILE_M:.2f}",
        "passed" if passed else f"{line.tcpa_s / 60:.1f}",
        f"{line.distance_m / MILE_M:.2f}",
        f"{line.area_km2:.3g}",
        "+".join(line.sources),
    ]
