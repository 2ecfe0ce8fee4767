"""A replay finds the first thing that came out otherwise, and nothing else."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from companion import loop
from companion.errors import LogError
from companion.instant import Instant, instant
from companion.loop import Stepper, Tick
from companion.messages import Decision, Frame, Heartbeat, Link, Outgoing, Phase, Status, Tracks
from companion.record import OTHER_MACHINE, Log, Recorder, Session
from companion.replay import compare

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
    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> None:
        pass


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
