"""The log: what is written is read back, wherever the file was cut."""

import errno
import io
import json
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from companion.errors import ConfigError, LogError
from companion.instant import Instant, instant
from companion.loop import Tick
from companion.messages import (
    Decision,
    Frame,
    Heartbeat,
    Link,
    Model,
    Nearest,
    OwnState,
    Phase,
    Reason,
    Repulsion,
    Setpoint,
    Status,
    Tracks,
)
from companion.record import (
    EXACT,
    OTHER_MACHINE,
    DecisionRecorder,
    Log,
    Recorder,
    Session,
    Step,
    encode,
    first_difference,
)
from companion.record.schema import RECORDS, DecisionRecord, Topic, TracksRecord, json_schema

SESSION = Session(schema_version=1, software="0.0", rate_hz=10.0, config={"goal": {"latitude_deg": 1.5}})


def tracks_of(n: int, revision: int = 1) -> Tracks:
    rows = np.arange(n)
    columns: dict[str, Any] = {f.name: rows + 0.1 for f in fields(Tracks)}
    columns |= {
        "revision": revision,
        "mmsi": rows + 200_000_000,
        "measured_at_ns": np.zeros(n, dtype=np.int64),
        "model": np.full(n, Model.STRAIGHT, dtype=np.int64),
        "names": tuple(f"ship {i}" for i in rows),
        "spread_m": np.ones((n, 4, 3)),
    }
    return Tracks(**columns)


def decision_at(t: Instant, n: int = 12, revision: int = 1) -> Decision:
    rows = np.arange(n, dtype=np.float64)
    away = np.column_stack((np.cos(rows), np.sin(rows)))
    setpoint = Setpoint(t, Instant(t + 500_000_000), (0.1, 0.2, 0.3))
    return Decision(
        t=t,
        phase=Phase.CROSS,
        status=Status.DEGRADED,
        reasons=(Reason("plan.expired", "1 contacts silent too long"),),
        own=OwnState(t, 1.0, 2.0, 45.0, (0.0, 2.5, 0.0), None),
        tracks=tracks_of(n, revision),
        repulsion=Repulsion(Nearest(100.0 - rows, away), away / 3.0, rows > 5),
        attraction_mps=(0.0, 5.0),
        wanted_ned_mps=(0.0, 2.5, 0.0),
        setpoint=setpoint,
        guard_changed=True,
        outgoing=(Heartbeat(Status.DEGRADED), setpoint),
        system_id=1,
        oldest_used_s=12.5,
        counts={"mavlink.bad_crc": 3},
    )


def tick_at(k: int) -> Tick:
    t = instant(k / 10)
    frames = (
        Frame(Instant(max(t - 3, 0)), Link.MAVLINK, bytes((k % 256, 0, 255))),
        Frame(Instant(max(t - 2, 0)), Link.CAN, bytes(range(k % 9)), 0x19F11234),
        Frame(Instant(max(t - 1, 0)), Link.MAVLINK, b""),
    )
    return Tick(t, frames[: k % 4])


def write(path: Path, ticks: int) -> list[Step]:
    """A log of so many ticks, and what must be read from it."""
    steps = []
    numbers = DecisionRecorder()
    with Recorder(path, SESSION) as recorder:
        for k in range(ticks):
            tick, decision = tick_at(k), decision_at(tick_at(k).t, revision=1 + k // 7)
            recorder.tick(tick)
            recorder.timed(tick.t, 0.001)
            recorder.decided(decision)
            recorder.sent(tick.t, b"heartbeat", expired=False)
            recorder.sent(tick.t, bytes((k % 256,)), expired=k == 3)
            sent = (b"heartbeat", bytes((k % 256,)))
            steps.append(Step(k, tick, encode(numbers.record(decision)), None, sent, 0.001, int(k == 3)))
    assert recorder.failed is None
    return steps


def without_tracks(steps: Iterator[Step]) -> list[Step]:
    return [replace(step, tracks=None) for step in steps]


@pytest.fixture(scope="module")
def log_file(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Step]]:
    path = tmp_path_factory.mktemp("run") / "log.mcap"
    return path, write(path, 55)


def test_what_was_written_is_read_back_in_order(log_file: tuple[Path, list[Step]]) -> None:
    path, steps = log_file
    log = Log(path)
    assert log.session == SESSION
    assert without_tracks(log.steps()) == steps
    assert log.complete
    assert log.damage is None
    assert list(Log(path.parent)) == [step.tick for step in steps]


def test_tracks_are_recorded_when_their_revision_changes_and_only_then(
    log_file: tuple[Path, list[Step]],
) -> None:
    changes = [step for step in Log(log_file[0]).steps() if step.tracks is not None]
    assert [step.number for step in changes] == list(range(0, 55, 7))
    record = msgspec.json.decode(changes[1].tracks or b"", type=TracksRecord)
    assert record.revision == 2
    assert record.mmsi == (np.arange(12) + 200_000_000).tolist()
    assert record.names[3] == "ship 3"


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(fraction=st.floats(0, 1))
def test_a_log_cut_at_any_byte_yields_a_prefix_of_its_steps(
    fraction: float, log_file: tuple[Path, list[Step]], tmp_path: Path
) -> None:
    path, steps = log_file
    whole = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(fraction * len(whole))])
    try:
        log = Log(cut)
    except LogError:
        assert fraction < 0.2  # cut inside the session record
        return
    found = without_tracks(log.steps())
    assert found == steps[: len(found)]
    assert len(found) % 10 in (0, 5)  # whole seconds: chunks hold whole steps
    assert log.complete or log.damage is not None or fraction > 0.5


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.floats(0, 1, exclude_max=True), value=st.integers(0, 255))
def test_a_corrupted_byte_costs_the_rest_of_the_log_and_nothing_else(
    where: float, value: int, log_file: tuple[Path, list[Step]], tmp_path: Path
) -> None:
    path, steps = log_file
    broken = bytearray(path.read_bytes())
    broken[int(where * len(broken))] = value
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(broken)
    try:
        found = without_tracks(Log(bad).steps())
    except LogError:
        return
    assert found == steps[: len(found)]


@given(content=st.binary(max_size=200))
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_that_is_no_log_is_refused_by_name(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"notes\.txt"):
        Log(path)


def test_a_missing_file_is_refused_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="give a run folder"):
        Log(tmp_path / "nothing")


def test_a_log_of_another_schema_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    Recorder(path, msgspec.structs.replace(SESSION, schema_version=99)).close()
    with pytest.raises(LogError, match="schema 99"):
        Log(path)


def test_a_killed_recorder_loses_about_a_second(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "log.mcap", SESSION)
    for k in range(35):
        recorder.tick(tick_at(k))
        recorder.decided(decision_at(tick_at(k).t))
    # never closed: what another process sees now is what a kill would leave
    log = Log(tmp_path / "log.mcap")
    assert len(list(log)) == 30
    assert not log.complete
    recorder.close()
    assert len(list(log)) == 35


class FullDisk(io.BytesIO):
    """Takes so many bytes, then reports that the disk is full."""

    room = 20_000

    def write(self, data: object) -> int:
        if self.tell() + len(memoryview(data)) > self.room:  # type: ignore[arg-type]
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)  # type: ignore[arg-type]


def test_a_full_disk_ends_the_recording_and_not_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FullDisk()
    monkeypatch.setattr(Path, "open", lambda self, mode: disk)
    recorder = Recorder(tmp_path / "log.mcap", SESSION)
    for k in range(300):
        if recorder.failed is None:
            kept = disk.getvalue()
        recorder.tick(tick_at(k))
        recorder.decided(decision_at(tick_at(k).t))
    recorder.close()
    monkeypatch.undo()
    assert recorder.failed is not None
    assert "No space left" in recorder.failed
    assert recorder.counts["record.failed"] == 1
    assert recorder.counts["record.lost"] > 100
    (tmp_path / "kept.mcap").write_bytes(kept)
    ticks = list(Log(tmp_path / "kept.mcap"))
    assert len(ticks) >= 10
    assert ticks == [tick_at(k) for k in range(len(ticks))]


def test_an_unwritable_place_is_refused_at_start(tmp_path: Path) -> None:
    (tmp_path / "log.mcap").write_bytes(b"an older run")
    with pytest.raises(ConfigError, match=r"recording\.folder"):
        Recorder(tmp_path / "log.mcap", SESSION)
    assert (tmp_path / "log.mcap").read_bytes() == b"an older run"


def test_a_third_party_reader_finds_every_channel_with_its_schema(log_file: tuple[Path, list[Step]]) -> None:
    path, steps = log_file
    with path.open("rb") as file:
        reader = make_reader(file)
        seen: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            shape, value = json.loads(schema.data), json.loads(message.data)
            assert set(shape["required"]) <= value.keys() <= shape["properties"].keys()
            seen[channel.topic] = seen.get(channel.topic, 0) + 1
    assert seen["/can/in"] == sum(f.link is Link.CAN for step in steps for f in step.tick.frames)
    assert seen["/decision"] == 55
    assert seen["/session"] == 1
    assert set(seen) | {Topic.AIVDM_IN} == set(Topic)  # no AIS receiver in these steps


@pytest.mark.parametrize("topic", list(Topic))
def test_schemas_use_only_what_mcap_viewers_understand(topic: Topic) -> None:
    def check(node: dict[str, object]) -> None:
        assert node["type"] in ("object", "array", "string", "number", "integer", "boolean")
        if node["type"] == "object":
            assert isinstance(node["properties"], dict)
            for child in node["properties"].values():
                check(child)
        if node["type"] == "array":
            assert isinstance(node["items"], dict)
            check(node["items"])

    check(json.loads(json_schema(RECORDS[topic])))


def test_every_field_of_a_decision_is_in_its_record() -> None:
    kept_otherwise = {"t": "t_ns", "tracks": "tracks_revision", "repulsion": "nearest"}
    recorded = {kept_otherwise.get(f.name, f.name) for f in fields(Decision)}
    assert recorded <= set(DecisionRecord.__struct_fields__)


def test_every_column_of_the_tracks_is_in_their_record() -> None:
    assert {f.name for f in fields(Tracks)} == set(TracksRecord.__struct_fields__)


def test_the_record_shows_the_nearest_contacts_first() -> None:
    record = DecisionRecorder().record(decision_at(instant(1.0)))
    assert [c.mmsi for c in record.nearest] == [200_000_000 + i for i in range(11, 3, -1)]
    assert record.contacts == 12


def changed(array: str, row: int) -> Decision:
    """A decision in which one number of one contact is the next float up."""
    decision = decision_at(instant(1.0))
    assert decision.repulsion is not None
    if hasattr(decision.tracks, array):
        column = getattr(decision.tracks, array).copy()
        column[row] = np.nextafter(column[row], np.inf) if column.dtype == np.float64 else column[row] + 1
        return replace(decision, tracks=replace(decision.tracks, **{array: column}))
    column = getattr(decision.repulsion, array).copy()
    column.flat[row] = ~column.flat[row] if column.dtype == bool else np.nextafter(column.flat[row], np.inf)
    return replace(decision, repulsion=replace(decision.repulsion, **{array: column}))


@pytest.mark.parametrize("row", [0, 11])
@pytest.mark.parametrize(
    "array",
    [f.name for f in fields(Tracks) if f.name not in ("revision", "names")] + ["velocity", "from_network"],
)
def test_the_digest_sees_the_last_bit_of_every_contact(array: str, row: int) -> None:
    plain = DecisionRecorder().record(decision_at(instant(1.0)))
    assert DecisionRecorder().record(changed(array, row)).digest != plain.digest


def test_the_first_difference_is_named_by_its_path() -> None:
    record = DecisionRecorder().record(decision_at(instant(1.0)))
    other = msgspec.structs.replace(record, wanted_ned_mps=(0.0, 2.5000001, 0.0))
    found = first_difference(encode(record), encode(other))
    assert found is not None
    assert (found.path, found.recorded, found.replayed) == ("wanted_ned_mps[1]", 2.5, 2.5000001)
    assert first_difference(encode(record), encode(record), EXACT) is None


def test_a_tolerance_forgives_last_digits_but_not_other_decisions() -> None:
    record = DecisionRecorder().record(decision_at(instant(1.0)))
    near = msgspec.structs.replace(record, wanted_ned_mps=(0.0, 2.5000001, 0.0), digest="other")
    assert first_difference(encode(record), encode(near), OTHER_MACHINE) is None
    for other in (
        msgspec.structs.replace(record, wanted_ned_mps=(0.0, 2.51, 0.0)),
        msgspec.structs.replace(record, wanted_ned_mps=None),
        msgspec.structs.replace(record, status="closed"),
        msgspec.structs.replace(record, nearest=record.nearest[:-1]),
    ):
        assert first_difference(encode(record), encode(other), OTHER_MACHINE) is not None
