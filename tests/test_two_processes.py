"""`companion run` as a process: with `companion sitl` to the goal, and ended by a signal."""

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mav

from companion.messages import Phase
from companion.record import Log

ROOT = Path(__file__).parents[1]
DEADLINE_S = 120.0

SCENARIO = """
title = "a hundred metres, one ship a lane"
[channel]
latitude_deg = 59.9
longitude_deg = 19.2
width_m = 60.0
lanes_m = [20.0, 40.0]
[ships]
per_lane = 1
meet_s = -300.0
[vehicle]
before_m = 20.0
[end]
beyond_m = 20.0
radius_m = 10.0
time_limit_s = 400.0
"""
CONFIG = """
[goal]
latitude_deg = 59.9
longitude_deg = 19.2008945
radius_m = 8.0
[vehicle]
cruise_depth_m = 4.0
listen_s = 5.0
[contacts]
speed_noise_mps = 0.05
course_noise_rad = 0.01
"""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def process(*arguments: str) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-m", "companion", *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as running:
        try:
            yield running
        finally:
            running.kill()


def test_vehicle_and_companion_meet_over_udp_and_a_can_bus_and_reach_the_goal(tmp_path: Path) -> None:
    (tmp_path / "sea.toml").write_text(SCENARIO)
    (tmp_path / "run.toml").write_text(CONFIG)
    udp, can = f"127.0.0.1:{free_port()}", f"udp_multicast:239.74.163.7?port={free_port()}"
    pace = ("--speedup", "8")
    board = ("--mavlink", f"udpin:{udp}", "--can", can, "--out", str(tmp_path / "runs"), "--until-arrived")
    vehicle = ("--mavlink", f"udpout:{udp}", "--can", can)
    with (
        process("run", "--config", str(tmp_path / "run.toml"), *board, *pace) as companion,
        process("sitl", "--scenario", str(tmp_path / "sea.toml"), *vehicle, *pace) as sea,
    ):
        _, said = companion.communicate(timeout=DEADLINE_S)
        assert companion.returncode == 0, said
        assert "arrived" in said
        _, told = sea.communicate(timeout=DEADLINE_S)
        assert sea.returncode == 0, told
    (folder,) = (tmp_path / "runs").iterdir()
    log = Log(folder)
    steps = list(log.steps())
    assert log.complete
    assert any(frame.can_id for step in steps for frame in step.tick.frames)
    assert Phase.ARRIVED.value.encode() in (steps[-1].decision or b"")
    replay = subprocess.run(
        [sys.executable, "-m", "companion", "replay", str(folder)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert replay.returncode == 0, replay.stdout


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_the_log_closed(number: signal.Signals, tmp_path: Path) -> None:
    link = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    hears = mav.MAVLink(None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(0.2)
        port = free_port()
        options = ("--goal", "59.7,24.7", "--mavlink", f"udpin:127.0.0.1:{port}", "--out", str(tmp_path))
        heartbeat = mav.MAVLink_heartbeat_message(12, 3, 129, 4, 4, 3)
        with process("run", *options) as companion:
            heard = None
            while heard is None:
                assert companion.poll() is None
                vehicle.sendto(heartbeat.pack(link), ("127.0.0.1", port))
                try:
                    messages = hears.parse_buffer(vehicle.recv(4096)) or []
                except TimeoutError:
                    continue
                heard = next((m for m in messages if m.get_type() == "HEARTBEAT"), None)
            assert (heard.get_srcSystem(), heard.get_srcComponent(), heard.type) == (1, 196, 18)
            companion.send_signal(number)
            _, said = companion.communicate(timeout=DEADLINE_S)
        assert companion.returncode == 0, said
        assert "log closed" in said
        assert "Traceback" not in said
    (folder,) = tmp_path.iterdir()
    log = Log(folder)
    assert list(log.steps())
    assert log.complete
