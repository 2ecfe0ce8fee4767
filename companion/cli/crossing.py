"""The main job: `demo`, `run`, `sitl` and `replay`."""

import argparse
from pathlib import Path

from companion.cli.options import Commands, position, speedup

EXIT_OK, EXIT_FAILED = 0, 1


def add(commands: Commands) -> None:
    """Add the four."""
    _add_demo(commands)
    _add_run(commands)
    _add_sitl(commands)
    _add_replay(commands)


def _add_demo(commands: Commands) -> None:
    text = """\
    Cross a sea in lock-step with simulated time, as fast as the machine can.  Everything between the
    sea and the companion is encoded: MAVLink 2 and NMEA 2000 frames on a virtual CAN bus.  Writes a
    run folder with summary.json, run.mcap (the log) and crossing.png.

    Exit status 1 when the vehicle came within delta of a reachable set, or did not arrive.
    """
    p = commands.add_parser("demo", help="cross simulated or recorded traffic, and show it", description=text)
    p.add_argument("--traffic", type=Path, metavar="FILE", help="candump log (plain or .gz) to cross")
    p.add_argument(
        "--scenario", metavar="NAME|FILE", help="sea (uuv_crossing; with --traffic recorded_crossing)"
    )
    p.add_argument("--start", type=position, metavar="LAT,LON", help="where the vehicle begins, degrees")
    p.add_argument("--goal", type=position, metavar="LAT,LON", help="where it shall arrive, degrees")
    p.add_argument("--seed", type=int, default=1, help="of the ships' noise and phases (%(default)s)")
    p.add_argument(
        "--config", type=Path, metavar="FILE", help="companion configuration laid over the scenario's"
    )
    p.add_argument("--repulsion", choices=("network", "exact"), help="who computes the repulsion")
    p.add_argument("--planner", choices=("paper", "clearing"), help="how far ahead each ship's set reaches")
    p.add_argument(
        "--out", type=Path, default=Path("runs"), metavar="DIR", help="parent of run folders (%(default)s)"
    )
    p.set_defaults(command=_demo)


def _add_run(commands: Commands) -> None:
    text = """\
    The process for the companion board.  Options override the file.  It shares the vehicle's system id
    (component 196), never arms, and changes the mode only if the configuration says so.
    Ctrl-C or SIGTERM ends it: heartbeat and setpoints stop, the log is closed.
    """
    p = commands.add_parser("run", help="steer a vehicle: the process for the board", description=text)
    p.add_argument("--config", type=Path, metavar="FILE", help="TOML; see the table in README")
    p.add_argument(
        "--mavlink",
        metavar="URL",
        help="udpin:0.0.0.0:14550, tcp://host:5760, serial:///dev/ttyACM0:57600 ...",
    )
    p.add_argument(
        "--can",
        action="append",
        metavar="INTERFACE:CHANNEL",
        help="socketcan:can0, udp_multicast:239.74.163.2 ...; repeatable",
    )
    p.add_argument("--goal", type=position, metavar="LAT,LON", help="degrees")
    p.add_argument("--out", type=Path, metavar="DIR", help="parent of run folders")
    p.add_argument(
        "--speedup", type=speedup, default=1.0, metavar="N", help="simulators only: N times real time"
    )
    p.add_argument(
        "--require-certificate", action="store_true", help="refuse a model whose certificate does not hold"
    )
    p.add_argument("--until-arrived", action="store_true", help="end after surfacing at the goal")
    p.set_defaults(command=_run)


def _add_sitl(commands: Commands) -> None:
    text = """\
    The bundled vehicle, autopilot and ship traffic as a process of its own, for `companion run` to meet
    over UDP MAVLink and a CAN bus.
    """
    p = commands.add_parser("sitl", help="the bundled vehicle and traffic as a process", description=text)
    p.add_argument("--scenario", default="uuv_crossing", metavar="NAME|FILE", help="sea (%(default)s)")
    p.add_argument("--traffic", type=Path, metavar="FILE", help="candump log (plain or .gz) as the sea")
    p.add_argument("--start", type=position, metavar="LAT,LON", help="where the vehicle begins, degrees")
    p.add_argument("--goal", type=position, metavar="LAT,LON", help="where the run is over, degrees")
    p.add_argument("--mavlink", default="udpout:127.0.0.1:14550", metavar="URL", help="(%(default)s)")
    p.add_argument(
        "--can", default="udp_multicast:239.74.163.2", metavar="INTERFACE:CHANNEL", help="(%(default)s)"
    )
    p.add_argument("--speedup", type=speedup, default=1.0, metavar="N", help="N times real time")
    p.add_argument("--seed", type=int, default=1, help="of the ships' noise and phases (%(default)s)")
    p.set_defaults(command=_sitl)


def _add_replay(commands: Commands) -> None:
    text = "Re-run a recorded log through the core and report the first decision that differs, or none."
    p = commands.add_parser("replay", help="re-run a log and compare every decision", description=text)
    p.add_argument("run_folder", type=Path, help="a run folder, or its .mcap file")
    p.set_defaults(command=_replay)


def _demo(options: argparse.Namespace) -> int:
    from sitl.demo import demo  # noqa: PLC0415 - each sub-command loads only what it needs

    return demo(options)


def _run(options: argparse.Namespace) -> int:
    from companion.edges.board import run  # noqa: PLC0415

    return run(options)


def _sitl(options: argparse.Namespace) -> int:
    from sitl.process import run  # noqa: PLC0415

    return run(options)


def _replay(options: argparse.Namespace) -> int:
    from companion.replay import replay  # noqa: PLC0415

    result = replay(options.run_folder)
    for note in result.notes:
        print(f"note: {note}")
    if not result.complete:
        print(f"note: the log breaks off: {result.damage or 'the run ended without closing it'}")
    if result.first is not None:
        print(f"differs at {result.first}")
        return EXIT_FAILED
    print(f"{result.ticks} steps replayed, every decision and every byte sent the same")
    return EXIT_OK
