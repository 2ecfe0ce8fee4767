"""`companion sitl` as a process, met over UDP by a pilot that has nothing of the companion."""

import math
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mav

SHORT = """
title = "thirty metres without ships"
[channel]
latitude_deg = 59.9
longitude_deg = 19.2
width_m = 20.0
[ships]
per_lane = 1
meet_s = 500.0
[vehicle]
before_m = 0.0
[end]
beyond_m = 10.0
radius_m = 5.0
time_limit_s = 120.0
"""


@pytest.fixture
def pilot() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.settimeout(0.5)
        yield link


def start(pilot: socket.socket, folder: Path, speedup: float) -> "subprocess.Popen[str]":
    scenario = folder / "short.toml"
    scenario.write_text(SHORT)
    port = pilot.getsockname()[1]
    options = [
        "--mavlink",
        f"udpout:127.0.0.1:{port}",
        "--can",
        "virtual:sitl-test",
        "--speedup",
        f"{speedup:g}",
    ]
    command = [sys.executable, "-m", "companion", "sitl", "--scenario", str(scenario), *options]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1])


def datagrams(
    pilot: socket.socket, process: "subprocess.Popen[str]"
) -> Iterator[tuple[bytes, tuple[str, int]]]:
    """What the process sends, until it ends."""
    while process.poll() is None:
        try:
            yield pilot.recvfrom(4096)
        except TimeoutError:
            continue


def test_a_third_party_pilot_sails_it_to_the_goal(pilot: socket.socket, tmp_path: Path) -> None:
    link = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    seen = set()
    with start(pilot, tmp_path, 20.0) as process:
        for data, sender in datagrams(pilot, process):
            for message in link.parse_buffer(data) or []:
                seen.add(message.get_type())
                if message.get_type() != "LOCAL_POSITION_NED":
                    continue
                left = 30.0 - message.y  # the goal lies 30 m east of the EKF origin
                speed = math.copysign(min(2.5, 0.3 * abs(left)), left)
                wanted = mav.MAVLink_set_position_target_local_ned_message(
                    0, 1, 1, 1, 0x0DC7, 0, 0, 0, 0.0, speed, 0.0, 0, 0, 0, 0, 0
                )
                pilot.sendto(wanted.pack(link), sender)
        assert process.stderr is not None
        said = process.stderr.read()
    assert process.returncode == 0, said
    assert "arrived" in said
    assert "BAD_DATA" not in seen
    assert {"HEARTBEAT", "SYSTEM_TIME", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE"} <= seen


def test_sigterm_ends_it_cleanly_with_a_summary(pilot: socket.socket, tmp_path: Path) -> None:
    with start(pilot, tmp_path, 1.0) as process:
        next(datagrams(pilot, process))
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=20)
    assert process.returncode == 0, said
    assert "stopped after" in said
    assert "Traceback" not in said
