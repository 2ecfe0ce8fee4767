"""`companion picture` on live links, as a process: AIVDM over UDP and TCP, MAVLink, and a CAN bus."""

import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.edges.can_bus import CanBus
from companion.messages import Link
from sitl.bus import GnssReceiver
from tests.fleet import Fleet
from tests.test_two_processes import DEADLINE_S, ROOT, free_port

SHIPS = 3
WAIT_S, MOST_TURNS = 0.05, 1000


@contextmanager
def watching(folder: Path, *specs: str) -> Iterator["subprocess.Popen[bytes]"]:
    command = [sys.executable, "-m", "companion", "picture", *specs, "--chart", str(folder / "c.png")]
    with subprocess.Popen(
        [*command, "--own", "59.7,24.7"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        env=os.environ | {"COLUMNS": "160"},
    ) as running:
        try:
            yield running
        finally:
            running.kill()


def talk_until_known(watcher: "subprocess.Popen[bytes]", say: Callable[[float], None]) -> str:
    """Say everything again and again until all ships are known; then end it and return the last table."""
    assert watcher.stdout is not None
    turn, said = 0, b""
    while f"{SHIPS} contacts on".encode() not in said:
        assert watcher.poll() is None, watcher.communicate()
        assert turn < MOST_TURNS, said
        say(float(turn))
        turn += 1
        if select.select([watcher.stdout], [], [], WAIT_S)[0]:
            said += os.read(watcher.stdout.fileno(), 65_536)
    watcher.send_signal(signal.SIGINT)
    rest, errors = watcher.communicate(timeout=DEADLINE_S)
    assert watcher.returncode == 0, errors
    return rest.decode()


def is_complete(table: str, source: str, folder: Path) -> None:
    assert all(str(Fleet(SHIPS).mmsi(ship)) in table for ship in range(SHIPS))
    assert table.count(source) >= SHIPS
    assert "CPA nm" in table
    assert (folder / "c.png").stat().st_size > 10_000


def test_sentences_over_tcp_cut_anywhere(tmp_path: Path) -> None:
    fleet = Fleet(SHIPS)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with watching(tmp_path, f"tcp:127.0.0.1:{port}") as watcher:
            server.settimeout(DEADLINE_S)
            stream, _ = server.accept()
            with stream:

                def say(at_s: float) -> None:
                    data = b"".join(fleet.aivdm(ship, at_s) for ship in range(SHIPS))
                    for at in range(0, len(data), 7):
                        stream.sendall(data[at : at + 7])

                is_complete(talk_until_known(watcher, say), "AIVDM", tmp_path)


def test_mavlink_is_asked_for_its_vessels(tmp_path: Path) -> None:
    """The autopilot sends AIS_VESSEL only once it was asked to, as ArduPilot does."""
    fleet, port = Fleet(SHIPS), free_port()
    packer, parser = mav.MAVLink(None, srcSystem=1, srcComponent=1), mav.MAVLink(None)
    asked: set[int] = set()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.setblocking(False)

        def send(message: mav.MAVLink_message) -> None:
            autopilot.sendto(message.pack(packer), ("127.0.0.1", port))

        def say(at_s: float) -> None:
            send(mav.MAVLink_heartbeat_message(12, 3, 129, 4, 4, 3))
            while select.select([autopilot], [], [], 0.0)[0]:
                for message in parser.parse_buffer(autopilot.recv(4096)) or []:
                    if message.get_type() == "COMMAND_LONG":
                        asked.add(int(message.param1))
                        send(mav.MAVLink_command_ack_message(message.command, 0, 0, 0, 1, 196))
            if 301 in asked:
                for ship in range(SHIPS):
                    autopilot.sendto(fleet.ais_vessel(ship, at_s), ("127.0.0.1", port))

        with watching(tmp_path, f"udpin:127.0.0.1:{port}") as watcher:
            is_complete(talk_until_known(watcher, say), "AIS_VESSEL", tmp_path)


def test_a_bus_and_sentences_over_udp_are_one_picture(tmp_path: Path) -> None:
    """The same ships from two links are the same contacts, and say from where."""
    fleet, port = Fleet(SHIPS), free_port()
    spec = f"udp_multicast:239.74.163.9?port={free_port()}"
    receiver = GnssReceiver()
    bus = CanBus.open(spec)
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:

            def say(at_s: float) -> None:
                for can_id, data in receiver.say(fleet.utc_ns + int(at_s * 1e9), 59.7, 24.7):
                    bus.send(can_id, data)
                for ship in range(SHIPS):
                    udp.sendto(fleet.aivdm(ship, at_s), ("127.0.0.1", port))
                    for can_id, data in fleet.say(Link.CAN, ship, at_s):
                        bus.send(can_id, data)

            with watching(tmp_path, spec, f"udpin:127.0.0.1:{port}") as watcher:
                is_complete(talk_until_known(watcher, say), "NMEA2000", tmp_path)
    finally:
        bus.close()
