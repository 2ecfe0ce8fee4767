import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.edges.connection import Connection, Way, parse
from companion.errors import ConfigError


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        # pymavlink
        ("udp:0.0.0.0:14550", Connection(Way.UDP_IN, "0.0.0.0", 14550)),
        ("udpin:127.0.0.1:14551", Connection(Way.UDP_IN, "127.0.0.1", 14551)),
        ("udpin::14550", Connection(Way.UDP_IN, "0.0.0.0", 14550)),
        ("udpout:192.168.2.2:14550", Connection(Way.UDP_OUT, "192.168.2.2", 14550)),
        ("tcp:localhost:5760", Connection(Way.TCP_OUT, "localhost", 5760)),
        ("tcpin:0.0.0.0:5760", Connection(Way.TCP_IN, "0.0.0.0", 5760)),
        ("/dev/ttyACM0", Connection(Way.SERIAL, "/dev/ttyACM0", 115_200)),
        ("/dev/ttyACM0,57600", Connection(Way.SERIAL, "/dev/ttyACM0", 57_600)),
        ("/dev/serial/by-id/usb-ArduPilot_Pixhawk6X-if00,921600",
         Connection(Way.SERIAL, "/dev/serial/by-id/usb-ArduPilot_Pixhawk6X-if00", 921_600)),
        ("COM3", Connection(Way.SERIAL, "COM3", 115_200)),
        ("com12,57600", Connection(Way.SERIAL, "com12", 57_600)),
        # MAVSDK
        ("udp://:14540", Connection(Way.UDP_IN, "0.0.0.0", 14540)),
        ("udp://", Connection(Way.UDP_IN, "0.0.0.0", 14540)),
        ("udpin://0.0.0.0:14540", Connection(Way.UDP_IN, "0.0.0.0", 14540)),
        ("udpout://autopilot.local:14550", Connection(Way.UDP_OUT, "autopilot.local", 14550)),
        ("tcp://127.0.0.1:5760", Connection(Way.TCP_OUT, "127.0.0.1", 5760)),
        ("tcp://127.0.0.1", Connection(Way.TCP_OUT, "127.0.0.1", 5760)),
        ("tcpout://127.0.0.1:5762", Connection(Way.TCP_OUT, "127.0.0.1", 5762)),
        ("tcpin://:5760", Connection(Way.TCP_IN, "0.0.0.0", 5760)),
        ("serial:///dev/ttyACM0:57600", Connection(Way.SERIAL, "/dev/ttyACM0", 57_600)),
        ("serial:///dev/ttyACM0", Connection(Way.SERIAL, "/dev/ttyACM0", 57_600)),
        ("serial:///dev/serial/by-path/pci-0:1.0-port0:921600",
         Connection(Way.SERIAL, "/dev/serial/by-path/pci-0:1.0-port0", 921_600)),
        ("serial://COM3:57600", Connection(Way.SERIAL, "COM3", 57_600)),
        ("serial_flowcontrol:///dev/ttyS1:921600", Connection(Way.SERIAL, "/dev/ttyS1", 921_600, True)),
        (" UDPIN:0.0.0.0:14550 ", Connection(Way.UDP_IN, "0.0.0.0", 14550)),
    ],
)  # fmt: skip
def test_both_spellings_are_understood(url: str, expected: Connection) -> None:
    assert parse(url) == expected


@pytest.mark.parametrize(
    ("url", "complaint"),
    [
        ("", "unknown kind"),
        ("14550", "unknown kind"),
        ("192.168.2.2:14550", "unknown kind"),
        ("http://localhost:80", "unknown kind"),
        ("udpin:0.0.0.0", "port is missing"),
        ("udpin:0.0.0.0:", "no port"),
        ("udpin:0.0.0.0:0", "no port"),
        ("udpin:0.0.0.0:65536", "no port"),
        ("udpin:0.0.0.0:-1", "no port"),
        ("udpin:0.0.0.0:http", "no port"),
        ("udpout::14550", "host to call"),
        ("tcp://:5760", "host to call"),
        ("udpout:a b:14550", "no host name"),
        ("udpout:[::1]:14550", "no host name"),
        ("/dev/ttyACM0,fast", "no baud rate"),
        ("/dev/ttyACM0,", "no baud rate"),
        ("serial:///dev/ttyACM0:0", "no baud rate"),
        ("serial:///dev/ttyACM0:", "no baud rate"),
        ("serial://ttyACM0:57600", "no serial device"),
        ("serial://", "no serial device"),
    ],
)
def test_anything_else_is_refused_with_the_reason_and_examples(url: str, complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        parse(url)
    assert repr(url) in str(caught.value)
    assert "udpin:0.0.0.0:14550" in str(caught.value)


SCHEMES = st.sampled_from(
    ["", "udp:", "udpin://", "udpout:", "tcp://", "tcpin:", "serial://", "/dev/", "COM"]
)


@given(SCHEMES, st.text(max_size=20) | st.text("0123456789.:,/", max_size=20))
def test_no_text_raises_anything_else(scheme: str, rest: str) -> None:
    try:
        connection = parse(scheme + rest)
    except ConfigError:
        return
    assert 0 < connection.port <= 12_000_000
