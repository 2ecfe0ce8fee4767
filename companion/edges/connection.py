"""Connection strings in pymavlink's and MAVSDK's spelling.

    pymavlink   udp:HOST:PORT  udpin:HOST:PORT  udpout:HOST:PORT  tcp:HOST:PORT  tcpin:HOST:PORT
                /dev/ttyACM0  /dev/ttyACM0,57600  COM3,57600
    MAVSDK      udp://[HOST][:PORT]  udpin://...  udpout://HOST:PORT
                tcp://HOST:PORT  tcpout://...  tcpin://...
                serial://DEVICE[:BAUD]  serial_flowcontrol://DEVICE[:BAUD]

In both, `udp` listens and `tcp` calls.
"""

import re
from dataclasses import dataclass
from enum import StrEnum

from companion.errors import ConfigError

REMEDY = (
    "give for example udpin:0.0.0.0:14550, udpout:192.168.2.2:14550, tcp:127.0.0.1:5760, "
    "serial:///dev/ttyACM0:57600 or /dev/ttyACM0,57600"
)
_PYMAVLINK_BAUD, _MAVSDK_BAUD = 115_200, 57_600
_UDP_PORT, _TCP_PORT = 14_540, 5_760  # MAVSDK's, where a URL leaves the port out
_FASTEST_BAUD = 12_000_000


class Way(StrEnum):
    """How a link is made: we wait for the other side, or we call it."""

    UDP_IN = "udpin"
    UDP_OUT = "udpout"
    TCP_IN = "tcpin"
    TCP_OUT = "tcpout"
    SERIAL = "serial"


@dataclass(frozen=True, slots=True)
class Connection:
    """A link to open.  `host` is a device for SERIAL, where `port` is the baud rate."""

    way: Way
    host: str
    port: int
    flow_control: bool = False


_WAYS = {
    "udp": Way.UDP_IN,
    "udpin": Way.UDP_IN,
    "udpout": Way.UDP_OUT,
    "tcp": Way.TCP_OUT,
    "tcpout": Way.TCP_OUT,
    "tcpin": Way.TCP_IN,
    "serial": Way.SERIAL,
    "serial_flowcontrol": Way.SERIAL,
}
_LISTENERS = (Way.UDP_IN, Way.TCP_IN)
_DEVICE = re.compile(r"(?:/\S+|COM\d+)", re.IGNORECASE)


def parse(url: str) -> Connection:
    """What `url` asks for; raises `ConfigError` with examples if it is none of the spellings."""
    text = url.strip()
    scheme, is_url, rest = text.partition("://")
    if not is_url:
        device, comma, baud = text.partition(",")
        if _DEVICE.fullmatch(device):
            return Connection(Way.SERIAL, device, _baud(url, baud if comma else str(_PYMAVLINK_BAUD)))
        scheme, _, rest = text.partition(":")
    way = _WAYS.get(scheme.lower())
    if way is None:
        raise ConfigError(f"links.mavlink = {url!r}: unknown kind of link; {REMEDY}")
    if way is Way.SERIAL:
        return _serial(url, scheme.lower(), rest)
    host, port = _host_and_port(url, way, rest, must_name_port=not is_url)
    if not host:
        if way not in _LISTENERS:
            raise ConfigError(f"links.mavlink = {url!r}: the host to call is missing; {REMEDY}")
        host = "0.0.0.0"
    return Connection(way, host, port)


def _serial(url: str, scheme: str, rest: str) -> Connection:
    device, colon, baud = rest.rpartition(":") if re.search(r":\d*$", rest) else (rest, "", "")
    if not _DEVICE.fullmatch(device):
        raise ConfigError(f"links.mavlink = {url!r}: {device!r} is no serial device; {REMEDY}")
    rate = _baud(url, baud if colon else str(_MAVSDK_BAUD))
    return Connection(Way.SERIAL, device, rate, flow_control=scheme == "serial_flowcontrol")


def _baud(url: str, text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= _FASTEST_BAUD:
        raise ConfigError(f"links.mavlink = {url!r}: {text!r} is no baud rate; {REMEDY}")
    return int(text)


def _host_and_port(url: str, way: Way, rest: str, *, must_name_port: bool) -> tuple[str, int]:
    host, colon, text = rest.rpartition(":")
    if not colon:
        if must_name_port:
            raise ConfigError(f"links.mavlink = {url!r}: the port is missing; {REMEDY}")
        host, text = rest, str(_UDP_PORT if way in (Way.UDP_IN, Way.UDP_OUT) else _TCP_PORT)
    if not text.isdecimal() or not 0 < int(text) < 65_536:
        raise ConfigError(f"links.mavlink = {url!r}: {text!r} is no port (1 to 65535); {REMEDY}")
    if not re.fullmatch(r"[\w.-]*", host):
        raise ConfigError(f"links.mavlink = {url!r}: {host!r} is no host name or IPv4 address; {REMEDY}")
    return host, int(text)
