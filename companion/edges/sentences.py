"""Recorded AIVDM sentences with their times: tag blocks, $PGHP lines, or none.

    \\\\s:station,c:1276256771*5E\\\\!AIVDM,...       a tag block's `c:`, seconds or milliseconds since 1970
    $PGHP,1,2010,6,11,11,46,11,390,...            the line before its sentence, UTC to the millisecond

Lines without any time follow each other at the greatest rate of the two AIS channels, 75 a second.
"""

import calendar
import gzip
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from companion.errors import LogError
from companion.instant import NS_PER_S, Instant

_TAG_TIME = re.compile(rb"^\\[^\\]*\bc:(\d{9,13})\b[^\\]*\\")
_PGHP = re.compile(rb"^\$PGHP,\d+,(\d{4}),(\d+),(\d+),(\d+),(\d+),(\d+),(\d+),")
_WITHOUT_TIME_NS = NS_PER_S // 75


class Sentence(NamedTuple):
    """A line and when it was received; `dated` is False while the file says nothing of time."""

    at: Instant
    line: bytes
    dated: bool


def read_sentences(path: Path) -> Iterator[Sentence]:
    """The `!` lines of a file, plain or gzip'd; raises `LogError` when it cannot be read at all."""
    try:
        raw = path.read_bytes()
        text = gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise LogError(f"{path}: {reason}; give recorded AIVDM sentences, plain or .gz") from None
    return _sentences(text)


def _sentences(text: bytes) -> Iterator[Sentence]:
    now, dated = 0, False
    for line in text.splitlines():
        tagged, stamped = _TAG_TIME.match(line), _PGHP.match(line)
        if stamped:
            year, month, day, hour, minute, second, ms = (int(part) for part in stamped.groups())
            if 1 <= month <= 12 and 1 <= day <= 31:
                whole = calendar.timegm((year, month, day, hour, minute, second))
                now, dated = whole * NS_PER_S + ms * 1_000_000, True
            continue
        if tagged:
            number = int(tagged[1])
            now, dated = (number * 1_000_000 if number > 10**11 else number * NS_PER_S), True
        if b"!" in line:
            yield Sentence(Instant(now), line, dated)
            now += 0 if dated else _WITHOUT_TIME_NS
