"""Writes a run's log while it happens.  EDGE: the only part of the record that writes files.

A chunk holds whole steps and is handed to the operating system at least once a second of the
run's time, so a killed process loses about a second.  (A power cut may lose what the system had
not yet put on the disk; waiting for the disk would stop the control loop instead.)  Nothing that
goes wrong here reaches the loop: the recorder counts it, stops, and says so in `failed`.
"""

import contextlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import ParamSpec, Self

from mcap.writer import CompressionType, Writer

from companion.errors import ConfigError
from companion.instant import Instant, elapsed_s
from companion.loop import Tick
from companion.messages import Decision, Frame, Link
from companion.record.digest import DecisionRecorder, tracks_record
from companion.record.schema import (
    RECORDS,
    SESSION_METADATA,
    Bytes,
    CanFrame,
    Record,
    Sent,
    Session,
    TickRecord,
    Timing,
    Topic,
    encode,
    json_schema,
)

LOG_NAME = "log.mcap"
CHUNK_S = 1.0
CHUNK_BYTES = 256 * 1024
_NEVER = 1 << 62  # the library's own chunking would cut a step in two

_Arguments = ParamSpec("_Arguments")


class Recorder:
    """A journal in an MCAP file.  Opening fails with `ConfigError`; nothing after it raises.

    `failed` is None, or the sentence that says why recording stopped; `counts` has
    "record.failed" and "record.lost" (records that came after).
    """

    def __init__(self, path: Path, session: Session) -> None:
        self.path = path
        self.failed: str | None = None
        self.counts: Counter[str] = Counter()
        self._channels: dict[Topic, int] = {}
        self._decisions = DecisionRecorder()
        self._revision: int | None = None
        self._chunk_began: Instant | None = None
        self._pending_bytes = 0
        self._frames = 0
        self._ticks = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        except OSError as error:
            raise ConfigError(
                f"recording.folder: cannot create {path}: {error.strerror}; "
                "name a new folder that can be written, or an empty string to record nothing"
            ) from None
        self._writer = Writer(self._file, chunk_size=_NEVER, compression=CompressionType.ZSTD)
        self._session = session
        self._attempt(self._start)

    # ------------------------------------------------------------ the journal

    def tick(self, tick: Tick) -> None:
        """What came in; everything up to the next tick belongs to this step."""
        self._attempt(self._tick, tick)

    def decided(self, decision: Decision) -> None:
        """What was decided, and the tracks if they changed."""
        self._attempt(self._decided, decision)

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """What went out, or was dropped because it had expired."""
        self._attempt(self._add, Topic.MAVLINK_OUT, t, Sent(data=data, expired=expired))

    def timed(self, t: Instant, step_s: float) -> None:
        """How long the step took."""
        self._attempt(self._add, Topic.TIMING, t, Timing(step_s=step_s))

    def close(self) -> None:
        """Complete the file with its index; safe to call twice."""
        if not self._file.closed:
            self._attempt(self._finish)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # ------------------------------------------------------------ the file

    def _attempt(
        self, write: Callable[_Arguments, None], *args: _Arguments.args, **kwargs: _Arguments.kwargs
    ) -> None:
        """Write, or end the recording: the loop must not stop because the disk is full."""
        if self.failed is not None:
            self.counts["record.lost"] += 1
            return
        try:
            write(*args, **kwargs)
        except Exception as error:  # whatever it was, the vehicle still has to be steered
            self.failed = f"recording stopped: {error}"
            self.counts["record.failed"] += 1
            with contextlib.suppress(OSError):
                self._file.close()

    def _start(self) -> None:
        session = self._session
        self._writer.start(library=f"companion {session.software}")
        for topic, record in RECORDS.items():
            name = f"companion.{record.__name__}"
            schema = self._writer.register_schema(name, "jsonschema", json_schema(record))
            self._channels[topic] = self._writer.register_channel(topic, "json", schema)
        # beside the message of the same content: metadata is on disk before the first chunk
        self._writer.add_metadata(SESSION_METADATA, {"json": encode(session).decode()})
        self._writer.flush()  # type: ignore[no-untyped-call]

    def _tick(self, tick: Tick) -> None:
        if self._chunk_began is None:
            self._chunk_began = tick.t
            self._add(Topic.SESSION, tick.t, self._session)
        elif elapsed_s(self._chunk_began, tick.t) >= CHUNK_S or self._pending_bytes >= CHUNK_BYTES:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._chunk_began, self._pending_bytes = tick.t, 0
        for frame in tick.frames:
            self._add_frame(frame)
        self._add(Topic.TICK, tick.t, TickRecord(number=self._ticks, t_ns=tick.t, frames=len(tick.frames)))
        self._ticks += 1

    def _decided(self, decision: Decision) -> None:
        if decision.tracks.revision != self._revision:
            self._revision = decision.tracks.revision
            self._add(Topic.TRACKS, decision.t, tracks_record(decision.tracks))
        self._add(Topic.DECISION, decision.t, self._decisions.record(decision))

    def _finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()

    def _add_frame(self, frame: Frame) -> None:
        if frame.link is Link.CAN:
            self._add(Topic.CAN_IN, frame.stamp, CanFrame(can_id=frame.can_id, data=frame.data), self._frames)
        else:
            topic = Topic.AIVDM_IN if frame.link is Link.AIVDM else Topic.MAVLINK_IN
            self._add(topic, frame.stamp, Bytes(data=frame.data), self._frames)
        self._frames += 1

    def _add(self, topic: Topic, t: Instant, record: Record, sequence: int = 0) -> None:
        data = encode(record)
        self._pending_bytes += len(data)
        self._writer.add_message(self._channels[topic], t, data, t, sequence)
