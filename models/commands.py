"""What `companion train`, `certify` and `latency` show a person; each returns an exit status.

Importing this needs neither torch nor onnx: only `train` does, when called.
"""

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from companion.errors import ConfigError
from companion.planning import certificate
from companion.planning.certificate import Certificate

REMEDY = "install the training extra: pip install -e '.[train]'"


def train(path: Path, console: Console) -> int:
    """Make NAME.onnx, its certificate and its card from models/NAME.toml; shows how it goes."""
    try:
        from models.train import run  # noqa: PLC0415 - torch only when somebody trains
    except ModuleNotFoundError as error:
        raise ConfigError(f"companion train needs {error.name}: {REMEDY}") from None
    columns = (TextColumn("{task.description:<9}"), BarColumn(), TextColumn("{task.fields[word]}"))
    with Progress(*columns, TimeElapsedColumn(), console=console) as progress:
        tasks: dict[str, TaskID] = {}

        def show(stage: str, done: float, word: str) -> None:
            if stage not in tasks:
                for earlier in tasks.values():
                    progress.update(earlier, completed=1.0)
                tasks[stage] = progress.add_task(stage, total=1.0, word=word)
            progress.update(tasks[stage], completed=done, word=word)

        made = run(path, show)
    console.print(f"{made}, its card {made.with_suffix('.md').name} beside it")
    return 0


def certify(model: str, console: Console, *, check_only: bool) -> int:
    """Make (or only check) a model's certificate; raises `ModelError` when it does not hold."""
    if check_only:
        held = certificate.check(model)
    else:
        from models import certify as maker  # noqa: PLC0415 - a sibling of the same name

        held = maker.run(_file(model))
    _show(held, console)
    return 0


def latency(console: Console, folder: Path) -> int:
    """Measure the table of latencies, write latency.md into `folder`, and print it."""
    from models import table  # noqa: PLC0415

    console.print(table.write(folder).read_text(encoding="utf-8"))
    return 0


def _file(model: str) -> Path:
    """A model's file; a packaged one by its name."""
    return Path(model) if model.endswith(".onnx") else Path(__file__).with_name(f"{model}.onnx")


def _show(held: Certificate, console: Console) -> None:
    console.print(f"{held.model}: {held.property}")
    for where, eps in held.eps_m.items():
        console.print(f"  eps {eps:.4f} m   {where}")
    console.print(f"  {held.method}, {held.cells} cells; checked again by another method")
