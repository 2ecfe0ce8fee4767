"""The bundled autopilot: a MAVLink 2 server as strict as the real ones, bytes in and bytes out.

It has no clock and no socket: time is an argument, `receive` takes what came over the link and
`step` returns what goes out.  What it drops, it drops silently and counts, as the firmware named
by its profile would.  Nothing that arrives can raise.
"""

import math
import struct
from collections import Counter
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geodesy import LocalFrame
from companion.instant import Instant
from sitl.ais import AisReport
from sitl.ais_list import AisList
from sitl.guided import Guided
from sitl.params import Params
from sitl.profiles import Flight, Mode, Profile
from sitl.telemetry import BUILDERS, Snapshot, Streams
from sitl.vehicle import Demand, VehicleState

_COMPONENT = mav.MAV_COMP_ID_AUTOPILOT1
_SENDABLE = BUILDERS.keys() | {mav.MAVLINK_MSG_ID_AIS_VESSEL}

Answers = list[mav.MAVLink_message]


class Autopilot:
    """One vehicle's flight controller: system id `system_id`, component 1.

    `home_m` is its EKF origin in `frame`, `utc_ns_at_zero` UTC at instant 0, `boot` when it was
    switched on.  For `armed` and `operator_mode` see `Guided`.
    """

    def __init__(
        self,
        profile: Profile,
        *,
        frame: LocalFrame,
        home_m: tuple[float, float],
        utc_ns_at_zero: int,
        boot: Instant,
        armed: bool = True,
        operator_mode: str | None = None,
        system_id: int = 1,
    ) -> None:
        self.profile = profile
        self.guided = Guided(profile, armed=armed, operator_mode=operator_mode)
        self._counts: Counter[str] = Counter()
        self._ais = AisList()
        self._frame = frame
        self._home_m = home_m
        self._utc_ns_at_zero = utc_ns_at_zero
        self._boot = boot
        self._system_id = system_id
        self._mav = mav.MAVLink(None, srcSystem=system_id, srcComponent=_COMPONENT)
        self._mav.robust_parsing = True
        self._streams = Streams()
        self._params = Params({"SYSID_THISMAV": float(system_id), **profile.params})
        self._answers: Answers = []
        self._asked: list[int] = []
        self._handlers: dict[str, Callable[[Instant, Any], Answers]] = {
            "SET_POSITION_TARGET_LOCAL_NED": self._on_setpoint,
            "COMMAND_LONG": self._on_command,
            "SET_MODE": self._on_set_mode,
            "PARAM_REQUEST_LIST": lambda _, __: self._params.list_all(),
            "PARAM_REQUEST_READ": lambda _, message: self._params.read(message),
            "PARAM_SET": lambda _, message: self._params.read(message),
            "PING": self._on_ping,
            "TIMESYNC": self._on_timesync,
        }
        self._commands: dict[int, Callable[[Instant, Any], int]] = {
            mav.MAV_CMD_SET_MESSAGE_INTERVAL: self._do_set_interval,
            mav.MAV_CMD_GET_MESSAGE_INTERVAL: self._do_get_interval,
            mav.MAV_CMD_REQUEST_MESSAGE: self._do_request_message,
            mav.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mav.MAV_CMD_COMPONENT_ARM_DISARM: self._do_arm,
        }

    @property
    def mode(self) -> Mode:
        """The flight mode it is in."""
        return self.guided.mode

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self.guided.armed

    @property
    def counts(self) -> Counter[str]:
        """What was taken and dropped, by reason."""
        return self._counts + self.guided.counts

    def demand(self, t: Instant) -> Demand | None:
        """What the hull is asked to do now; None while disarmed."""
        return self.guided.demand(t)

    def hear(self, t: Instant, report: AisReport) -> None:
        """Its AIS receiver picked up a report."""
        self._ais.hear(t, report)

    def receive(self, t: Instant, data: bytes) -> None:
        """Take bytes off the link; answers come with the next `step`."""
        try:
            messages = self._mav.parse_buffer(data) or []
        except (mav.MAVError, struct.error, ValueError, IndexError, KeyError):
            self._counts["mavlink.unparsable"] += 1
            return
        for message in messages:
            kind = message.get_type()
            handler = self._handlers.get(kind)
            if kind == "BAD_DATA":
                self._counts["mavlink.bad_data"] += 1
            elif handler is not None and self._is_for_us(message):
                self._answers += handler(t, message)
            elif handler is not None:
                self._counts["mavlink.not_for_us"] += 1

    def step(self, t: Instant, state: VehicleState, *, has_gnss: bool = True) -> bytes:
        """Everything due at `t`: answers first, then the streams."""
        self.guided.check_timeout(t)
        complaints, self.guided.complaints = self.guided.complaints, []
        answers, self._answers = self._answers, []
        asked, self._asked = self._asked, []
        out = [
            mav.MAVLink_statustext_message(mav.MAV_SEVERITY_WARNING, c.encode("ascii")) for c in complaints
        ]
        out += answers
        now = self._snapshot(t, state, has_gnss)
        for number in (*asked, *self._streams.due(t)):
            if number == mav.MAVLINK_MSG_ID_AIS_VESSEL:
                vessel = self._ais.due(t)
                out += [] if vessel is None else [vessel]
            else:
                out.append(BUILDERS[number](now))
        return b"".join(map(self._pack, out))

    def _snapshot(self, t: Instant, state: VehicleState, has_gnss: bool) -> Snapshot:
        base = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mav.MAV_MODE_FLAG_STABILIZE_ENABLED
        base |= mav.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        base |= mav.MAV_MODE_FLAG_GUIDED_ENABLED if self.mode.flight is Flight.SETPOINTS else 0
        status = mav.MAV_STATE_ACTIVE if self.armed else mav.MAV_STATE_STANDBY
        return Snapshot(
            state=state,
            frame=self._frame,
            local_m=(state.north_m - self._home_m[0], state.east_m - self._home_m[1]),
            boot_ns=t - self._boot,
            utc_ns=self._utc_ns_at_zero + t,
            heartbeat=mav.MAVLink_heartbeat_message(
                self.profile.vehicle, self.profile.autopilot, base, self.mode.number, status, 3
            ),
            has_gnss=has_gnss,
        )

    def _pack(self, message: mav.MAVLink_message) -> bytes:
        data: bytes = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return data

    def _is_for_us(self, message: Any) -> bool:
        # a setpoint must name the system, everything else may be a broadcast
        systems = {self._system_id}
        if message.get_type() != "SET_POSITION_TARGET_LOCAL_NED":
            systems.add(0)
        component = getattr(message, "target_component", 0)
        return getattr(message, "target_system", 0) in systems and component in {0, _COMPONENT}

    def _on_setpoint(self, t: Instant, message: Any) -> Answers:
        velocity = (message.vx, message.vy, message.vz)
        self.guided.offer(t, message.type_mask, message.coordinate_frame, velocity)
        return []

    def _on_set_mode(self, t: Instant, message: Any) -> Answers:
        self.guided.change_mode(message.custom_mode, t)
        return []

    def _on_ping(self, _: Instant, message: Any) -> Answers:
        if message.target_system != 0:  # somebody's answer, not a request
            return []
        asker = message.get_srcSystem(), message.get_srcComponent()
        return [mav.MAVLink_ping_message(message.time_usec, message.seq, *asker)]

    def _on_timesync(self, t: Instant, message: Any) -> Answers:
        return [mav.MAVLink_timesync_message(t - self._boot, message.ts1)] if message.tc1 == 0 else []

    # ------------------------------------------------------------ commands

    def _on_command(self, t: Instant, message: Any) -> Answers:
        do = self._commands.get(message.command)
        if do is None:
            result = int(mav.MAV_RESULT_UNSUPPORTED)
        elif not all(map(math.isfinite, (message.param1, message.param2, message.param3))):
            result = int(mav.MAV_RESULT_DENIED)
        else:
            result = do(t, message)
        asker = {"target_system": message.get_srcSystem(), "target_component": message.get_srcComponent()}
        return [mav.MAVLink_command_ack_message(message.command, result, **asker)]

    def _do_set_interval(self, _: Instant, message: Any) -> int:
        if int(message.param1) not in _SENDABLE:
            return int(mav.MAV_RESULT_FAILED)
        self._streams.set(int(message.param1), message.param2)
        return int(mav.MAV_RESULT_ACCEPTED)

    def _do_get_interval(self, _: Instant, message: Any) -> int:
        number = int(message.param1)
        if number not in _SENDABLE:
            return int(mav.MAV_RESULT_FAILED)
        interval = self._streams.interval_us(number)
        self._answers.append(mav.MAVLink_message_interval_message(number, interval))
        return int(mav.MAV_RESULT_ACCEPTED)

    def _do_request_message(self, _: Instant, message: Any) -> int:
        if int(message.param1) not in _SENDABLE:
            return int(mav.MAV_RESULT_FAILED)
        self._asked.append(int(message.param1))
        return int(mav.MAV_RESULT_ACCEPTED)

    def _do_set_mode(self, t: Instant, message: Any) -> int:
        number = int(message.param2)
        if self.profile.main_mode_shift:
            number = number << 16 | int(message.param3) << 24
        return int(mav.MAV_RESULT_ACCEPTED if self.guided.change_mode(number, t) else mav.MAV_RESULT_DENIED)

    def _do_arm(self, _: Instant, message: Any) -> int:
        if message.param1 not in {0.0, 1.0}:
            return int(mav.MAV_RESULT_DENIED)
        self.guided.arm(message.param1 == 1.0)
        return int(mav.MAV_RESULT_ACCEPTED)
