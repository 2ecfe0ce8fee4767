"""The options of `companion study guard` and `endurance`, apart so that the command starts fast."""

import argparse
from pathlib import Path

from sitl.studies.options import add_campaign

GUARD = """\
    Hostile planners (random, adversarial, frozen, steering straight at a bow, NaN, silent) against the
    guard, over both traffics of the UUV case and two vehicles, at the edge of every declared bound: ships'
    noise, current, delay, position.  The plain half-space filter and no guard at all are compared.

    Exit status 1 when the vehicle came within delta of a current reachable set under the guard.
"""

ENDURANCE = """\
    Six channels in a row, 30 km, with reports only while surfaced: when the companion decides to surface
    by itself, and at fixed intervals.  Writes table.md and surfacings.png.

    Exit status 1 when it did not arrive, or came within delta of a reachable set.
"""


LIVENESS = """\
    The improved planner by the network under the guard, under the plain half-space filter and under none,
    trial by trial the same ships, in both traffics of the UUV case.  Writes table.md.

    Exit status 1 when the guard changed 1 % of the setpoints or took 2 % of the median time.
"""


def add_liveness(p: argparse.ArgumentParser) -> None:
    """`companion study liveness`."""
    add_campaign(p, "liveness", trials=200)


def add_guard(p: argparse.ArgumentParser) -> None:
    """`companion study guard`."""
    add_campaign(p, "guard", trials=1000)
    p.add_argument(
        "--duration", type=float, default=120.0, metavar="S", help="of a trial, seconds (%(default)s)"
    )
    p.add_argument("--rate", type=float, default=1.0, metavar="HZ", help="of the guard's steps (%(default)s)")
    p.add_argument(
        "--vehicles",
        choices=("points", "physics"),
        default="points",
        help="physics: the bundled submarine and boat in six and three degrees of freedom (%(default)s)",
    )
    p.add_argument(
        "--ships",
        choices=("keep", "break"),
        default="keep",
        help="break: they leave their declared bounds on the way; then nothing is claimed (%(default)s)",
    )
    p.add_argument(
        "--beside",
        type=float,
        default=0.0,
        metavar="M",
        help="start up to so far outside delta of a set, with or without a way out (%(default)s: anywhere)",
    )
    p.add_argument(
        "--compare",
        nargs="*",
        choices=("half-space", "none"),
        default=["half-space", "none"],
        help="rows beside the guard's; half-space needs the extra study (%(default)s)",
    )


def add_endurance(p: argparse.ArgumentParser) -> None:
    """`companion study endurance`."""
    p.add_argument("--seed", type=int, default=1, help="of the ships' noise and phases (%(default)s)")
    p.add_argument("--channels", type=int, default=6, metavar="N", help="in a row (%(default)s)")
    p.add_argument(
        "--every",
        nargs="*",
        type=float,
        default=[200.0, 300.0, 450.0, 540.0],
        metavar="S",
        help="fixed intervals beside deciding, seconds (200 300 450 540, the longest)",
    )
    p.add_argument(
        "--out", type=Path, default=Path("runs") / "study-endurance", metavar="DIR", help="(%(default)s)"
    )
