"""A replay finds the first thing that came out otherwise, and nothing else."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import msgspec
import pytest

from companion import build, loop
from companion.config import from_mapping
from companion.errors import LogError
from companion.instant import Instant, instant
from companion.loop import Stepper, Tick
from companion.messages import Decision, Frame, Heartbeat, Link, Outgoing, Phase, Status, Tracks
from companion.record import OTHER_MACHINE, Log, Recorder, Session, Topic
from companion.record.session import differences, session
from companion.replay import compare, replay
from sitl.launch import scenario_sea
from sitl.lockstep import LockstepSea
from sitl.scenario import load

SESSION = Session(schema_version=1, software="0.0", rate_hz=10.0, config={})


class Summing:
    """A core whose velocity is the sum of every byte it ever heard; `slip` adds an error at a tick."""

    def __init__(self, slip_at: int = -1, slip: float = 0.0) -> None:
        self._sum = 0
        self._ticks = 0
        self._slip_at = slip_at
        self._slip = slip

    def step(self, tick: Tick) -> Decision:
        self._sum += sum(sum(frame.data) for frame in tick.frames)
        wanted = self._sum + (self._slip if self._ticks == self._slip_at else 0.0)
        self._ticks += 1
        return Decision(
            t=tick.t,
            phase=Phase.CROSS,
            status=Status.OK,
            reasons=(),
            own=None,
            tracks=Tracks.empty(),
            repulsion=None,
            attraction_mps=None,
            wanted_ned_mps=(float(wanted), 0.1, 0.0),
            setpoint=None,
            guard_changed=False,
            outgoing=(Heartbeat(Status.OK),) if self._ticks % 2 else (),
            system_id=7,
        )


class Counting:
    """An encoder that numbers its messages; `wrong_at` garbles one."""

    def __init__(self, wrong_at: int = -1) -> None:
        self.system_id = 0
        self._number = 0
        self._wrong_at = wrong_at

    def encode(self, message: Outgoing) -> bytes:
        self._number += 1
        wrong = self._number == self._wrong_at
        return bytes((self.system_id, 0xFF if wrong else self._number))


class Nowhere:
    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> bool:
        return True


class Sea:
    def __init__(self, ticks: int) -> None:
        self._ticks = ticks

    def __iter__(self) -> Iterator[Tick]:
        for k in range(self._ticks):
            t = instant(k / 10)
            yield Tick(t, (Frame(t, Link.MAVLINK, bytes((k % 256,))), Frame(t, Link.CAN, b"\x01", 5)))


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    with Recorder(tmp_path / "log.mcap", SESSION) as recorder:
        loop.run(Sea(45), Summing(), Counting(), Nowhere(), recorder, lambda: 0.0)
    return tmp_path


def test_the_same_core_replays_without_a_difference(run_folder: Path) -> None:
    found = compare(Log(run_folder), Summing(), Counting())
    assert found.first is None
    assert found.ticks == 45
    assert found.complete


def test_the_first_differing_field_is_reported_with_tick_and_values(run_folder: Path) -> None:
    found = compare(Log(run_folder), Summing(slip_at=30, slip=1e-9), Counting())
    assert found.first is not None
    assert (found.first.tick, found.first.t, found.first.path) == (30, instant(3.0), "wanted_ned_mps[0]")
    assert found.first.replayed == found.first.recorded + 1e-9  # type: ignore[operator]
    assert "tick 30" in str(found.first)
    assert found.complete  # what comes after the difference was not read, and is not said to be missing


def test_bytes_sent_are_compared_too(run_folder: Path) -> None:
    found = compare(Log(run_folder), Summing(), Counting(wrong_at=4))
    assert found.first is not None
    assert (found.first.tick, found.first.path) == (6, "sent[0]")
    assert (found.first.recorded, found.first.replayed) == ("0704", "07ff")


def test_a_tolerance_for_another_machine_forgives_the_last_digits(run_folder: Path) -> None:
    slip = Summing(slip_at=30, slip=1e-9)
    assert compare(Log(run_folder), slip, Counting(), OTHER_MACHINE).first is None


def test_a_message_more_or_less_is_a_difference(run_folder: Path) -> None:
    class Mute(Summing):
        def step(self, tick: Tick) -> Decision:
            return replace(super().step(tick), outgoing=())

    found = compare(Log(run_folder), Mute(), Counting())
    assert found.first is not None
    assert found.first.path.startswith(("outgoing", "sent"))


def test_a_log_cut_short_replays_up_to_the_cut(run_folder: Path) -> None:
    path = run_folder / "log.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    found = compare(Log(path), Summing(), Counting())
    assert found.first is None
    assert 0 < found.ticks < 45
    assert not found.complete
    assert found.damage is not None


def test_a_step_that_died_is_replayed_without_a_verdict(tmp_path: Path) -> None:
    class Dying(Summing):
        def step(self, tick: Tick) -> Decision:
            if tick.t == instant(0.5):
                raise ArithmeticError
            return super().step(tick)

    recorder = Recorder(tmp_path / "log.mcap", SESSION)
    with pytest.raises(ArithmeticError), recorder:
        loop.run(Sea(9), Dying(), Counting(), Nowhere(), recorder, lambda: 0.0)
    log = Log(tmp_path)
    assert [step.decision is None for step in log.steps()] == [False] * 5 + [True]
    assert compare(log, Summing(), Counting()).first is None
    with pytest.raises(ArithmeticError):  # the log holds what killed it
        compare(log, Dying(), Counting())


def test_a_log_without_a_tick_is_refused(tmp_path: Path) -> None:
    Recorder(tmp_path / "log.mcap", SESSION).close()
    core: Stepper = Summing()
    with pytest.raises(LogError, match="no tick"):
        compare(Log(tmp_path), core, Counting())


class Hurried(LockstepSea):
    """A sea whose run ends after so many ticks."""

    ticks = 400

    def __iter__(self) -> Iterator[Tick]:
        return islice(super().__iter__(), self.ticks)


@pytest.fixture(scope="module")
def real_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's crossing, its first 40 s, by the real core over real bytes."""
    folder = tmp_path_factory.mktemp("run")
    scenario = load("uuv_crossing")
    sea = scenario_sea(scenario)
    config = from_mapping(scenario.companion_tables(sea.goal_deg, {"vehicle": {"listen_s": 20.0}}))
    companion = build.build(config)
    lockstep = Hurried(sea)
    with Recorder(
        folder / "log.mcap", session(config, companion.model_digest, companion.turning_digest)
    ) as recorder:
        loop.run(lockstep, companion.core, companion.encoder, lockstep, recorder, lambda: 0.0)
    return folder


def test_the_real_core_replays_bit_for_bit(real_run: Path) -> None:
    found = replay(real_run)
    assert found.first is None
    assert found.ticks == Hurried.ticks
    assert found.complete
    assert found.notes == ()
    decided = [msgspec.json.decode(step.decision or b"") for step in Log(real_run).steps()]
    assert decided[-1]["contacts"] == 10
    assert any("setpoint" in each for each in decided)


def test_a_log_of_one_reach_kernel_replays_with_the_other(real_run: Path) -> None:
    log = Log(real_run)
    other = build.build(from_mapping({**log.session.config, "reach": {"kernel": "numba"}}))
    assert compare(log, other.core, other.encoder).first is None


def test_one_flipped_bit_in_what_was_heard_is_found(real_run: Path, tmp_path: Path) -> None:
    log = Log(real_run)
    with Recorder(tmp_path / "log.mcap", log.session) as forged:
        for step in log.steps():
            frames = step.tick.frames
            if step.number == 100:
                first = replace(frames[0], data=bytes((frames[0].data[0] ^ 1,)) + frames[0].data[1:])
                frames = (first, *frames[1:])
            forged.tick(Tick(step.tick.t, frames))
            forged._writer.add_message(forged._channels[Topic.DECISION], 0, step.decision or b"", 0)
            for data in step.sent:
                forged.sent(step.tick.t, data, expired=False)
    found = replay(tmp_path)
    assert found.first is not None
    assert found.first.tick >= 100


def test_a_log_of_another_model_bounds_file_or_program_says_what_is_other() -> None:
    config = from_mapping({"goal": {"latitude_deg": 59.9, "longitude_deg": 19.2}})
    with_bounds = from_mapping(
        {
            "goal": {"latitude_deg": 59.9, "longitude_deg": 19.2},
            "contacts": {"bounds_file": "houston"},
        }
    )
    here = session(config, "ab" * 32)
    assert differences(here, here) == ()
    assert differences(session(with_bounds, "ab" * 32), session(with_bounds, "ab" * 32)) == ()
    (bounds,) = differences(session(with_bounds, "ab" * 32), here)
    assert bounds.startswith("the bounds file differs: recorded ")
    (model,) = differences(session(config, ""), here)
    assert model == "the model differs: recorded none, here abababababab"
    (program,) = differences(msgspec.structs.replace(here, code_sha256="0" * 64), here)
    assert program.startswith("the program differs")
    assert differences(msgspec.structs.replace(here, code_sha256=None), here) == ()  # an older log
