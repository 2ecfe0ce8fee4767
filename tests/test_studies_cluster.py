"""The campaign on a real Dask scheduler with two workers, one of them killed in the middle."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from companion.errors import LinkError
from sitl.studies.campaign import Campaign
from sitl.studies.case import Crossing
from sitl.studies.cluster import Cluster
from sitl.studies.trials import Outcome, Part, run_part

ROOT = Path(__file__).parents[1]
CASE = Crossing(dt_s=1.0)


@contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A Dask command as a process of its own, ended with the block."""
    command = [sys.executable, "-m", *arguments]
    started = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield started
    finally:
        started.kill()
        started.communicate()


def address_of(scheduler: subprocess.Popen[str]) -> str:
    assert scheduler.stderr is not None
    for line in scheduler.stderr:
        if "Scheduler at:" in line:
            return line.split()[-1]
    raise AssertionError("the scheduler ended before it told its address")


def test_a_worker_killed_in_the_middle_costs_nothing(tmp_path: Path) -> None:
    parts = [Part("exact", 2 * i, 2) for i in range(8)]
    work = partial(run_part, CASE, 3)
    worker = ("distributed.cli.dask_worker", "--no-nanny", "--nthreads", "1", "--no-dashboard")
    with process(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"
    ) as scheduler:
        address = address_of(scheduler)
        with process(*worker, address) as first, process(*worker, address):
            done: list[Part] = []

            def finished(part: Part, _: list[Outcome]) -> None:
                done.append(part)
                if len(done) == 1:
                    first.kill()

            found = Campaign(tmp_path, {}, Part, Outcome).run(work, parts, Cluster(address), finished)
    assert sorted(p.first for p in done) == [p.first for p in parts]
    assert found == [outcome for part in parts for outcome in work(part)]


def test_where_no_scheduler_answers_a_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sitl.studies.cluster.CONNECT_S", 0.2)
    with pytest.raises(LinkError, match="no Dask scheduler answers"):
        list(Cluster("tcp://127.0.0.1:1")(abs, [1]))
