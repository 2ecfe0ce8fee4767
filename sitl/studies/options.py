"""The options of `companion study`, apart from the studies themselves so that the command starts fast."""

import argparse
import os
from pathlib import Path

UUV = """\
    The paper's UUV case: trial by trial the same ships for every planner.  Writes table.md, table.csv,
    study.json, the figures, and results.jsonl, from which an interrupted campaign goes on.

    Exit status 1 when a planner that claims safety came within delta of a reachable set.
"""

UGV = """\
    The paper's ground-vehicle case in both variants, by its own network (models/paper4x16), and what the gain
    K_r does (in process).  Exit status 1 when a planner that claims safety came within delta.
"""

AGE = """\
    The vehicle at the edge of endless traffic with information 0 to 600 s old: it rehearses the way on the
    sets to come, and holds when there is no safe way.  Exit status 1 when it came within delta all the same.
"""

PLANNERS = "rows: network,exact,no-uncertainty,improved (these four), improved-exact, rehearsed, orca, search"

READINGS = {
    "ships": (("convoy", "stream"), "5 ships a lane, or lanes without end"),
    "attraction": (("unit", "proportional"), "K_p whatever the distance, or K_p times the distance"),
    "obstacle": (("hull", "centre"), "whose reachable set"),
    "horizon": (("tube", "slice", "per-ship"), "of the paper's planners' sets"),
    "noise": (("constant", "interval", "white", "none"), "of the true ships: constant is the worst case"),
    "vehicle": (
        ("integrator", "lag", "sitl"),
        "x' = u; a lag of 2 s and at most 0.2 rad/s; or the bundled vehicle through its MAVLink link",
    ),
}


def add_campaign(p: argparse.ArgumentParser, study: str, trials: int = 20) -> None:
    """What every campaign has."""
    p.add_argument("--trials", type=_count, default=trials, metavar="N", help="(%(default)s)")
    p.add_argument("--seed", type=int, default=1, help="of the ships' positions and noise (%(default)s)")
    p.add_argument(
        "--jobs", type=_count, default=os.cpu_count() or 1, metavar="N", help="processes (%(default)s)"
    )
    p.add_argument(
        "--cluster", metavar="ADDRESS", help="a Dask scheduler in place of --jobs: tcp://host:8786"
    )
    p.add_argument(
        "--out", type=Path, default=Path("runs") / f"study-{study}", metavar="DIR", help="(%(default)s)"
    )
    p.add_argument(
        "--kernel",
        choices=("numpy", "numba"),
        default="numpy",
        help="of the exact sets; numba is an extra (%(default)s)",
    )


def add_uuv(p: argparse.ArgumentParser) -> None:
    """`companion study uuv`."""
    add_campaign(p, "uuv")
    p.add_argument(
        "--planners",
        metavar="A,B,...",
        help=PLANNERS,
    )
    for name, (choices, text) in READINGS.items():
        p.add_argument(f"--{name}", choices=choices, default=choices[0], help=f"{text} (%(default)s)")


def add_age(p: argparse.ArgumentParser) -> None:
    """`companion study age`."""
    add_campaign(p, "age", trials=100)


def add_ugv(p: argparse.ArgumentParser) -> None:
    """`companion study ugv`."""
    add_campaign(p, "ugv", trials=200)
    p.add_argument(
        "--vehicle",
        choices=("integrator", "lag", "sitl"),
        default="integrator",
        help="sitl: the bundled rover through its MAVLink link (%(default)s)",
    )


def _count(text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return count
