"""The `companion` command: reads options, wires the parts together, and turns errors into sentences.

One room per family of sub-commands; each adds its parsers and loads what it needs when it is called.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version

from companion.cli import crossing, models, study, traffic
from companion.errors import CompanionError

EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130

DESCRIPTION = """\
Crosses ship traffic that the vehicle cannot see.

For every ship heard of, companion keeps the set of places where it can be by now, steers an
ArduPilot or PX4 vehicle to its goal around all of them, and lets a guard have the last word.
"""

EPILOG = """\
first steps:
  companion demo                                  cross the paper's shipping channel, in simulation
  companion demo --traffic LOG.candump.gz         cross recorded real traffic
  companion sitl & companion run --config C.toml  two processes over UDP MAVLink and a CAN bus
  companion replay RUN_FOLDER                     re-run a log and compare every decision
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one sub-command; the process's exit status."""
    options = _parser().parse_args(argv)
    options.said = list(sys.argv[1:] if argv is None else argv)  # a study tells how it was made
    command: Callable[[argparse.Namespace], int] = options.command
    try:
        return command(options)
    except CompanionError as error:
        print(f"companion: {error}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        print("companion: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        return EXIT_FAILED


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("companion", description=DESCRIPTION, epilog=EPILOG, formatter_class=raw)
    parser.add_argument("--version", action="version", version=f"companion {version('companion')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    crossing.add(commands)
    traffic.add(commands)
    models.add(commands)
    study.add(commands)
    return parser
