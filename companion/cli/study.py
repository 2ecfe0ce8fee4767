"""`companion study NAME`: campaigns of many simulated trials.  A study is a row of `STUDIES`."""

import argparse
from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple

from companion.cli.options import Commands
from sitl.studies import guard_options
from sitl.studies import options as of


class Study(NamedTuple):
    """A sub-command: `module` has `run(options) -> int`, and is loaded when it is called."""

    name: str
    help: str
    description: str
    add_options: Callable[[argparse.ArgumentParser], None]
    module: str


STUDIES = (
    Study("uuv", "the paper's UUV crossing, planner beside planner", of.UUV, of.add_uuv, "sitl.studies.uuv"),
    Study(
        "guard",
        "hostile planners against the guard",
        guard_options.GUARD,
        guard_options.add_guard,
        "sitl.studies.guard",
    ),
    Study(
        "endurance",
        "six channels in a row: surfacing as a decision",
        guard_options.ENDURANCE,
        guard_options.add_endurance,
        "sitl.studies.endurance",
    ),
    Study(
        "liveness",
        "what a guard costs a planner that means well",
        guard_options.LIVENESS,
        guard_options.add_liveness,
        "sitl.studies.liveness",
    ),
    Study("ugv", "the paper's ground-vehicle case", of.UGV, of.add_ugv, "sitl.studies.ugv"),
    Study("age", "how old information may be", of.AGE, of.add_age, "sitl.studies.age"),
)


def add(commands: Commands) -> None:
    """`companion study` and its studies."""
    text = "Campaigns of many simulated trials: the paper's experiments, and what goes beyond them."
    p = commands.add_parser("study", help="campaigns of simulated trials", description=text)
    studies = p.add_subparsers(required=True, metavar="STUDY")
    for study in STUDIES:
        one = studies.add_parser(study.name, help=study.help, description=study.description)
        study.add_options(one)
        one.set_defaults(command=_run, module=study.module)


def _run(options: argparse.Namespace) -> int:
    run: Callable[[argparse.Namespace], int] = import_module(options.module).run
    return run(options)
