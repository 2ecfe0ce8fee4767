"""The same work on a Dask cluster: a thin layer, only the place where it is done differs.

The scheduler gives the work of a worker that died to another; every result is taken as soon as it is there.
The workers need this package installed, nothing else.
"""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import TypeVar

from companion.errors import ConfigError, LinkError

CONNECT_S = 10.0

Work = TypeVar("Work")
Result = TypeVar("Result")


class Cluster:
    """An executor (`campaign.Executor`) on the scheduler at `address`; raises `ConfigError`, `LinkError`."""

    def __init__(self, address: str) -> None:
        self._address = address

    def __call__(
        self, function: Callable[[Work], Result], items: Sequence[Work]
    ) -> Iterator[tuple[int, Result]]:
        """All of them, in any order."""
        try:
            distributed = import_module("distributed")  # an extra
        except ImportError:
            raise ConfigError(
                '--cluster needs dask.distributed: pip install "companion[cluster]", or use --jobs'
            ) from None
        try:
            client = distributed.Client(self._address, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise LinkError(
                f"--cluster {self._address}: no Dask scheduler answers ({error}); start `dask scheduler`"
            ) from None
        with client:
            futures = {client.submit(function, item, pure=False): i for i, item in enumerate(items)}
            for future, result in distributed.as_completed(list(futures), with_results=True):
                yield futures[future], result
                future.release()
