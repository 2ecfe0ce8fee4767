"""Traffic and what is known of it: `picture` and `calibrate`."""

import argparse
from pathlib import Path

from companion.cli.options import Commands, position, speedup


def add(commands: Commands) -> None:
    """Add the two."""
    text = """\
    Show the contacts of a recording or of a live link: age, distance, closest approach, the size of the set
    where each can be by now, and where it was heard from.  Saves a chart.

    FILE: NMEA 2000 candump, AIVDM, or a table of AIS (CSV as of MarineCadastre or the Danish Maritime
    Authority), plain or gzip'd.  LINK: udpin:HOST:PORT, tcp:HOST:PORT or /dev/tty... with AIVDM sentences or
    MAVLink, or a CAN bus such as socketcan:can0; several are one picture.  Ctrl-C ends it, with the chart.
    """
    p = commands.add_parser("picture", help="show the ships around, recorded or live", description=text)
    p.add_argument("source", nargs="+", metavar="FILE_OR_LINK", help="a file, or one or more links")
    p.add_argument("--own", type=position, metavar="LAT,LON", help="our position, where the source has none")
    p.add_argument("--bounds", default="", metavar="FILE|NAME", help="a bounds file, such as houston")
    p.add_argument("--at", type=float, metavar="S", help="stop so many seconds into a file (its end)")
    p.add_argument(
        "--silence", type=float, default=0.0, metavar="S", help="and then hear nothing for so long"
    )
    p.add_argument("--most", type=int, default=25, metavar="N", help="contacts listed (%(default)s)")
    p.add_argument(
        "--speedup", type=speedup, default=1.0, metavar="N", help="simulators only: N times real time"
    )
    p.add_argument("--chart", type=Path, default=Path("picture.png"), metavar="PNG", help="(%(default)s)")
    p.set_defaults(command=_picture)

    text = """\
    Learn from recorded traffic how far ships stray from their straight prediction.  Reads tables
    of AIS (CSV of MarineCadastre or the Danish Maritime Authority), NMEA 2000 candumps and AIVDM streams,
    plain or gzip'd.  Writes NAME.bounds.toml (for
    [contacts] bounds_file), and a report with pictures: coverage and area on vessels set aside, by sort of
    ship, and what other systems' rules for silent ships cost.
    """
    p = commands.add_parser("calibrate", help="learn bounds from recorded traffic", description=text)
    p.add_argument("traffic", type=Path, nargs="+", metavar="TRAFFIC", help="recorded traffic")
    p.add_argument("--out", default=".", metavar="FOLDER", help="where the files go (%(default)s)")
    p.add_argument("--name", default="traffic", help="of the bounds (%(default)s)")
    p.add_argument("--splits", type=int, default=16, help="repeated splits by vessel (%(default)s)")
    p.add_argument("--seed", type=int, default=1, help="of the splits (%(default)s)")
    p.add_argument(
        "--check", type=Path, action="append", default=[], metavar="TRAFFIC", help="other traffic to test on"
    )
    p.set_defaults(command=_calibrate)


def _picture(options: argparse.Namespace) -> int:
    from companion.edges.lookout import run  # noqa: PLC0415 - each sub-command loads only what it needs

    return run(options)


def _calibrate(options: argparse.Namespace) -> int:
    from companion.calibrate.command import run  # noqa: PLC0415

    return run(options)
