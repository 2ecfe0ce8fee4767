"""Reads a log back, whole or cut off at any byte.  EDGE: opens the file, nothing else.

Content never raises: where the file is cut or corrupted, reading ends at the last whole step
before it and `damage` says what was met.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk

from companion.errors import LogError
from companion.instant import Instant
from companion.loop import Tick
from companion.messages import Frame, Link
from companion.record.schema import (
    SCHEMA_VERSION,
    SESSION_METADATA,
    Bytes,
    CanFrame,
    Sent,
    Session,
    TickRecord,
    Timing,
    Topic,
)
from companion.record.writer import LOG_NAME

MOST_CHUNK_BYTES = 64 * 1024 * 1024  # a corrupted length must not fill the memory

_Record = TypeVar("_Record")


@dataclass(frozen=True, slots=True)
class Step:
    """One turn of the loop as it was recorded.

    `decision` is the record's JSON, byte for byte; None when the run ended inside the step.
    `tracks` is the JSON of the contacts where they changed.  `sent` is all that was encoded; `expired`
    of these the sink dropped, for they were late.
    """

    number: int
    tick: Tick
    decision: bytes | None = None
    tracks: bytes | None = None
    sent: tuple[bytes, ...] = ()
    step_s: float | None = None
    expired: int = 0


class Log:
    """A recorded run: iterate it for its ticks (it is a `Source`), or `steps()` for everything.

    `complete` and `damage` are known once an iteration has ended: a log is complete when its
    writer closed it; `damage` says what ended an incomplete one.
    """

    def __init__(self, path: Path) -> None:
        """Open a run folder or an .mcap file; raises `LogError` if it is no log of ours."""
        self.path = path / LOG_NAME if path.is_dir() else path
        self.complete = False
        self.damage: str | None = None
        self.session = self._read_session()

    def __iter__(self) -> Iterator[Tick]:
        for step in self.steps():
            yield step.tick

    def steps(self) -> Iterator[Step]:
        """Every whole step in the order of recording."""
        self.complete, self.damage = False, None
        topics: dict[int, str] = {}
        step = _Open()
        for record in self._records():
            if isinstance(record, Footer):
                self.complete = True
            elif isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                try:
                    done = step.take(topics.get(record.channel_id, ""), record)
                except msgspec.MsgspecError as error:
                    self.damage = f"a record that is not ours: {error}"
                    break
                if done is not None:
                    yield done
        last = step.close()
        if last is not None:
            yield last

    def _read_session(self) -> Session:
        for record in self._records():
            if isinstance(record, Metadata) and record.name == SESSION_METADATA:
                return self._session(record)
            if isinstance(record, Message):
                break
        raise LogError(f"{self.path}: not a log of this program, or cut off before its first record")

    def _session(self, record: Metadata) -> Session:
        text = record.metadata.get("json", "")
        try:
            version = msgspec.json.decode(text, type=dict[str, object]).get("schema_version")
            if version != SCHEMA_VERSION:
                raise LogError(
                    f"{self.path}: log schema {version}, this program reads {SCHEMA_VERSION}; "
                    "use the version of the program that recorded it"
                )
            return msgspec.json.decode(text, type=Session)
        except msgspec.MsgspecError as error:
            raise LogError(f"{self.path}: the session record is unreadable: {error}") from None

    def _records(self) -> Iterator[McapRecord]:
        """The file's records as far as they are sound, chunks taken apart."""
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise LogError(f"{self.path}: {error.strerror}; give a run folder or an .mcap file") from None
        with file:
            reader = StreamReader(file, emit_chunks=True, record_size_limit=MOST_CHUNK_BYTES)
            try:
                for record in reader.records:
                    if not isinstance(record, Chunk):
                        yield record
                    elif record.uncompressed_size <= MOST_CHUNK_BYTES:
                        yield from breakup_chunk(record, validate_crc=True)
                    else:
                        self.damage = "a chunk of absurd size"
                        return
            except Exception as error:  # the library raises whatever the broken bytes lead it to
                self.damage = f"{type(error).__name__}: {error}".rstrip(": ")


class _Open:
    """Collects messages until the step they belong to is whole."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []
        self._tick: TickRecord | None = None
        self._of_tick: tuple[Frame, ...] = ()
        self._decision: bytes | None = None
        self._tracks: bytes | None = None
        self._sent: list[bytes] = []
        self._expired = 0
        self._step_s: float | None = None

    def take(self, topic: str, message: Message) -> Step | None:
        """Add a message; the previous step if this one begins the next."""
        data, stamp = message.data, Instant(message.log_time)
        match topic:
            case Topic.MAVLINK_IN:
                self._frames.append(Frame(stamp, Link.MAVLINK, _decode(data, Bytes).data))
            case Topic.AIVDM_IN:
                self._frames.append(Frame(stamp, Link.AIVDM, _decode(data, Bytes).data))
            case Topic.CAN_IN:
                frame = _decode(data, CanFrame)
                self._frames.append(Frame(stamp, Link.CAN, frame.data, frame.can_id))
            case Topic.TICK:
                tick = _decode(data, TickRecord)
                done = self.close()
                self._tick, self._of_tick, self._frames = tick, tuple(self._frames), []
                return done
            case Topic.TRACKS:
                self._tracks = data
            case Topic.DECISION:
                self._decision = data
            case Topic.MAVLINK_OUT:
                sent = _decode(data, Sent)
                self._sent.append(sent.data)
                self._expired += sent.expired
            case Topic.TIMING:
                self._step_s = _decode(data, Timing).step_s
        return None

    def close(self) -> Step | None:
        """The step collected so far, if there is one."""
        if self._tick is None:
            return None
        tick = Tick(Instant(self._tick.t_ns), self._of_tick)
        sent = tuple(self._sent)
        step = Step(self._tick.number, tick, self._decision, self._tracks, sent, self._step_s, self._expired)
        self._tick, self._decision, self._tracks, self._step_s = None, None, None, None
        self._sent, self._expired = [], 0
        return step


def _decode(data: bytes, record: type[_Record]) -> _Record:
    return msgspec.json.decode(data, type=record)
