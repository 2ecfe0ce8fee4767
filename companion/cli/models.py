"""What is trained: `train`, `certify` and `latency`."""

import argparse
from pathlib import Path

from rich.console import Console

from companion.cli.options import Commands


def add(commands: Commands) -> None:
    """Add the three."""
    text = """\
    Train a model as models/NAME.toml says, evaluate and certify it, and write NAME.onnx, its certificate
    and its card with pictures beside it.  Reproducible from its seed; interrupted, it resumes.
    """
    p = commands.add_parser("train", help="make a model, its certificate and its card", description=text)
    p.add_argument("recipe", type=Path, metavar="models/NAME.toml", help="what to train")
    p.set_defaults(command=_train)

    text = """\
    Prove over the model's whole domain that its learned support is nowhere below the true one and nowhere
    more than eps above: the network never claims more distance than there is.
    """
    p = commands.add_parser("certify", help="prove a model's bound, or check the proof", description=text)
    p.add_argument("model", metavar="MODEL", help="an ONNX file, or the name of one in models/")
    p.add_argument("--check", action="store_true", help="only check the certificate beside it (no torch)")
    p.set_defaults(command=_certify)

    text = "Time the networks against the exact sets on this machine and write latency.md."
    p = commands.add_parser("latency", help="networks against exact sets, timed here", description=text)
    p.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="folder (%(default)s)")
    p.set_defaults(command=_latency)


def _train(options: argparse.Namespace) -> int:
    from models import commands  # noqa: PLC0415

    return commands.train(options.recipe, Console(highlight=False))


def _certify(options: argparse.Namespace) -> int:
    from models import commands  # noqa: PLC0415

    return commands.certify(options.model, Console(highlight=False), check_only=options.check)


def _latency(options: argparse.Namespace) -> int:
    from models import commands  # noqa: PLC0415

    return commands.latency(Console(highlight=False), options.out)
