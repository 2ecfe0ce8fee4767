"""A campaign: many parts of work, results on disk as they come, the same numbers for any number of jobs.

    RESULTS   one JSON line a finished part, after a first line that says what the campaign is

An interrupted campaign goes on where it stopped: parts on disk are not computed again.  A worker that
dies costs the parts it was at, and they are done again.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import msgspec

from companion.errors import ConfigError

RESULTS = "results.jsonl"
DEATHS = 3  # of a pool, before the campaign gives up

Work = TypeVar("Work")
Result = TypeVar("Result")


class Executor(Protocol):
    """Runs a function over items somewhere; yields (index, result) as they are finished."""

    def __call__(
        self, function: Callable[[Work], Result], items: Sequence[Work]
    ) -> Iterator[tuple[int, Result]]:
        """All of them, in any order."""
        ...


class _Line(msgspec.Struct, Generic[Work, Result]):
    part: Work
    results: list[Result]


def local(
    function: Callable[[Work], Result], items: Sequence[Work], *, jobs: int
) -> Iterator[tuple[int, Result]]:
    """On this machine, in `jobs` processes; 1 is this very process."""
    if jobs == 1 or len(items) <= 1:
        for index, item in enumerate(items):
            yield index, function(item)
        return
    left = dict(enumerate(items))
    for death in range(DEATHS):
        try:
            with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
                futures = {pool.submit(function, item): index for index, item in left.items()}
                for future in as_completed(futures):
                    result = future.result()
                    del left[futures[future]]
                    yield futures[future], result
        except BrokenProcessPool:
            if death == DEATHS - 1:
                raise
        else:
            return


class Campaign(Generic[Work, Result]):
    """`identity` is all that decides the numbers; a folder belongs to one identity."""

    def __init__(self, folder: Path, identity: object, part: type[Work], result: type[Result]) -> None:
        self._path = folder / RESULTS
        self._identity = msgspec.json.decode(msgspec.json.encode(identity))  # as it will be read again
        self._line = _Line[part, result]  # type: ignore[valid-type]
        folder.mkdir(parents=True, exist_ok=True)
        self.done = self._read()

    def _read(self) -> dict[bytes, list[Result]]:
        """Results on disk by their part; a line cut off in the middle is not one."""
        if not self._path.exists():
            self._path.write_bytes(msgspec.json.encode(self._identity) + b"\n")
            return {}
        first, *lines = self._path.read_bytes().split(b"\n")
        if msgspec.json.decode(first) != self._identity:
            raise ConfigError(
                f"{self._path.parent}: holds another campaign (other options or seed); "
                "give another --out, or the same options to go on with it"
            )
        done: dict[bytes, list[Result]] = {}
        whole = [first]
        for line in lines:
            try:
                read = msgspec.json.decode(line, type=self._line)
            except msgspec.MsgspecError:
                continue
            done[msgspec.json.encode(read.part)] = read.results
            whole.append(line)
        self._path.write_bytes(b"\n".join(whole) + b"\n")  # without the torn line
        return done

    def run(
        self,
        function: Callable[[Work], list[Result]],
        parts: Sequence[Work],
        executor: Executor,
        finished: Callable[[Work, list[Result]], None] | None = None,
    ) -> list[Result]:
        """All results in the order of `parts`, computing what is not on disk yet."""
        missing = [part for part in parts if msgspec.json.encode(part) not in self.done]
        with self._path.open("ab") as file:
            for index, results in executor(function, missing):
                part = missing[index]
                file.write(msgspec.json.encode(_Line(part, results)) + b"\n")
                file.flush()
                self.done[msgspec.json.encode(part)] = results
                if finished is not None:
                    finished(part, results)
        return [result for part in parts for result in self.done[msgspec.json.encode(part)]]


def local_executor(jobs: int) -> Executor:
    """`local` with that many processes."""
    return partial(local, jobs=jobs)
