"""Writes what a study found: table.md, table.csv and study.json, in the folder of its campaign."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from sitl.studies.table import HEADINGS, Row, comma_separated, markdown


def write(
    folder: Path,
    title: str,
    command: str,
    identity: dict[str, object],
    rows: Sequence[Row],
    notes: Sequence[str] = (),
) -> None:
    """The three files; `identity` is what anyone needs to get the same numbers again."""
    said = "".join(f"\n{note}\n" for note in notes)
    text = f"# {title}\n\n    {command}\n\n{markdown(rows)}{said}"
    (folder / "table.md").write_text(text, encoding="utf-8")
    (folder / "table.csv").write_text(comma_separated(rows), encoding="utf-8")
    software = {
        "companion": version("companion"),
        "numpy": np.__version__,
        "onnxruntime": version("onnxruntime"),
    }
    whole = {**identity, "command": command, "software": software, "rows": rows, "notes": list(notes)}
    (folder / "study.json").write_bytes(msgspec.json.format(msgspec.json.encode(whole), indent=1) + b"\n")


def show(console: Console, title: str, rows: Sequence[Row]) -> None:
    """The table in a terminal, turned over: a column for each planner."""
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for row in rows:
        table.add_column(row.planner.strip("*"), justify="right", overflow="fold")
    for name, heading in HEADINGS.items():
        if name != "planner":
            values = [getattr(row, name) for row in rows]
            table.add_row(heading, *("" if v is None else f"{v:g}" for v in values))
    console.print(table)
