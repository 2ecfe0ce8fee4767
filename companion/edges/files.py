"""Recorded CAN traffic: candump's log format, plain or gzip'd.

One frame a line, `(1669809630.000176) can0 19F01414#5020202020202020`.  Times stay integers.
"""

import gzip
import re
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

from companion.errors import LogError
from companion.instant import NS_PER_S

_TIME = rb"\((\d{1,11})\.(\d{1,9})\)"
_FRAME = rb"([0-9A-Fa-f]{8})#((?:[0-9A-Fa-f]{2}){0,8})"
_LINE = re.compile(_TIME + rb"\s+\S+\s+" + _FRAME + rb"(?:\s+[RT])?\s*")
_HIGHEST_ID = (1 << 29) - 1  # candump sets the bits above in error frames
_GZIP_MAGIC = b"\x1f\x8b"
_LOOK_BYTES = 4096
_LONGEST_LINE = 4096  # a log line has about 50 bytes; a longer one is read in pieces, each a bad line


@dataclass(frozen=True, slots=True)
class CandumpFrame:
    """One recorded frame: nanoseconds since 1970 on the recorder's clock, 29-bit identifier, data."""

    unix_ns: int
    can_id: int
    data: bytes


def read_candump(path: Path, counts: Counter[str] | None = None) -> Iterator[CandumpFrame]:
    """The 29-bit data frames of a log, in the order recorded.

    Lines that are anything else are left out and counted in `counts` ("candump.bad_line"), and so
    is a file that breaks off ("candump.broken_off").  Raises `LogError`, at once, when the file
    cannot be opened or holds no text.
    """
    try:
        with ExitStack() as files:
            look = _open(path, files).read(_LOOK_BYTES)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise LogError(f"{path}: {reason}; give an existing candump log, plain or .gz") from None
    if b"\0" in look:
        raise LogError(f"{path}: not text; give a candump log, its lines like '(1.5) can0 09F80114#00FF'")
    return _frames(path, Counter() if counts is None else counts)


def _open(path: Path, files: ExitStack) -> BinaryIO:
    stream = files.enter_context(path.open("rb"))
    is_packed = stream.read(2) == _GZIP_MAGIC  # the name may say anything
    stream.seek(0)
    return cast("BinaryIO", files.enter_context(gzip.open(stream, "rb"))) if is_packed else stream


def _frames(path: Path, counts: Counter[str]) -> Iterator[CandumpFrame]:
    match = _LINE.fullmatch
    with ExitStack() as files:
        try:
            lines = _open(path, files)
            while line := lines.readline(_LONGEST_LINE):
                found = match(line)
                can_id = int(found[3], 16) if found else _HIGHEST_ID + 1
                if found is None or can_id > _HIGHEST_ID:
                    counts["candump.bad_line"] += 1
                    continue
                unix_ns = int(found[1]) * NS_PER_S + int(found[2].ljust(9, b"0"))
                yield CandumpFrame(unix_ns, can_id, bytes.fromhex(found[4].decode("ascii")))
        except (OSError, EOFError, zlib.error):
            counts["candump.broken_off"] += 1
