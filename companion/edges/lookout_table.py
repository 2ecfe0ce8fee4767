"""The picture as a table for a terminal: as many columns as fit, the ones that matter last to go."""

from collections import Counter

from rich import box
from rich.console import Console, Group
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from companion.geodesy import MAX_RANGE_M
from companion.messages import Reason
from companion.picture import Picture
from companion.picture.ageing import AgeState
from companion.picture.view import Line

KNOT_MPS, MILE_M = 1852 / 3600, 1852.0
_STYLES = {
    AgeState.FRESH: "green",
    AgeState.COASTING: "yellow",
    AgeState.STALE: "dark_orange",
    AgeState.UNBOUNDED: "bold red",
}
_LEFT = {"MMSI", "name", "state", "source"}
_TITLES = (
    *("MMSI", "name", "age s", "state", "nm", "brg", "kn", "cog"),
    *("CPA nm", "TCPA min", "to set nm", "set km2", "source"),
)
_FIRST_TO_GO = ("name", "brg", "cog", "kn", "nm")  # where the terminal is narrow


def table(
    found: list[Line], picture: Picture, known: str, notes: list[Reason], most: int, console: Console
) -> Group:
    """The contacts as a table, and below it what is to be known of them and of those that are not in it.

    `known` is how our position is known.
    """
    states = Counter(line.state for line in found)
    title = f"{len(found)} contacts: " + ", ".join(f"{states[s]} {s}" for s in AgeState)
    titles = list(_TITLES)
    for gone in (*_FIRST_TO_GO, ""):
        shown = _shown(found, titles, most)
        if Measurement.get(console, console.options.update(width=1000), shown).maximum <= console.width:
            break
        if gone:
            titles.remove(gone)
    below = [f"own position {known}", accounts(found, picture)]
    said = [Text(f"{reason.code}: {reason.text}") for reason in notes]
    return Group(Text(title, style="bold"), shown, *map(Text, below), *said)


def accounts(found: list[Line], picture: Picture) -> str:
    """Reports in, contacts out: every number heard is in one of these."""
    listed, placed = {line.mmsi for line in found}, picture.placed()
    parts = [f"{picture.reports_heard} reports of ships, {len(picture)} numbers: {len(listed)} listed"]
    if missing := len(placed - listed):
        parts.append(f"{missing} out of reach (beyond {MAX_RANGE_M / MILE_M:.0f} nm) or ourselves")
    if unplaced := len(picture) - len(placed):
        parts.append(f"{unplaced} that never told a position")
    return ", ".join(parts)


def _shown(found: list[Line], titles: list[str], most: int) -> Table:
    shown = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in titles:
        shown.add_column(title, justify="left" if title in _LEFT else "right", no_wrap=True)
    for line in found[:most]:
        cells = dict(zip(_TITLES, _cells(line), strict=True))
        shown.add_row(*(cells[title] for title in titles))
    if len(found) > most:
        shown.add_row(f"+ {len(found) - most}")
    return shown


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
        Text("\n").join(Text(source) for source in line.sources),
    ]
