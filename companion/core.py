"""One step from frames to a decision; reads top to bottom like the line it implements.

    Frame -wire-> Heard -picture-> Tracks -field-> wanted velocity -guard-> Setpoint

Pure: no clock, no I/O, no randomness.  The same ticks give the same decisions, bit for bit.
"""

import math
from collections import Counter

import numpy as np

from companion import reach
from companion.config import Config
from companion.geodesy import MAX_RANGE_M, LocalFrame
from companion.instant import Instant, after, elapsed_s
from companion.loop import Tick
from companion.messages import (
    AutopilotHeartbeat,
    Command,
    CommandAck,
    ContactReport,
    Decision,
    FloatArray,
    Heard,
    Heartbeat,
    Link,
    Outgoing,
    OwnPosition,
    OwnState,
    Phase,
    Reason,
    Repulsion,
    Setpoint,
    Source,
    Status,
    StatusText,
    Tracks,
    UtcTime,
)
from companion.own import Ownship
from companion.picture import Picture
from companion.planning.guard import Guard, Verdict
from companion.planning.mission import Mission
from companion.planning.steering import RepulsionField, Steering
from companion.planning.surfacing import Surfacing
from companion.requests import MessageRequests
from companion.takeover import Takeover
from companion.utc import UtcClock
from companion.wire.ais_vessel import AisQuirk
from companion.wire.aivdm import AivdmDecoder
from companion.wire.mavlink import MavlinkDecoder
from companion.wire.nmea2000 import Nmea2000Decoder

HEARTBEAT_S = 1.0
STATUSTEXT_REPEAT_S = 30.0
NOTE = "note."  # reasons that inform and do not degrade; told once
MOST_STATUSTEXTS = 3  # a step never floods the link
RISE_WITHIN_M = 20.0  # of the place found free
RISEN_M = 2.0  # a vehicle this much above its cruise depth is on its way up
STEERING_WEIGHT = 0.01  # a repulsion below this share of full speed did not steer


class Core:
    """The companion's mind: holds the decoders, the picture and the plan; `step` advances them."""

    def __init__(self, config: Config, repulsion: RepulsionField) -> None:
        self._config = config
        self._utc = UtcClock()
        self._mavlink = MavlinkDecoder(
            system_id=config.autopilot.system_id,
            component_id=config.autopilot.component_id,
            quirk=AisQuirk(config.autopilot.ais_sender),
        )
        self._nmea2000 = Nmea2000Decoder(self._utc)
        self._aivdm = AivdmDecoder(self._utc)
        self._decoders: dict[Link, MavlinkDecoder | Nmea2000Decoder | AivdmDecoder] = {
            Link.MAVLINK: self._mavlink,
            Link.CAN: self._nmea2000,
            Link.AIVDM: self._aivdm,
        }
        self._own = Ownship(config.autopilot)
        self._picture = Picture(config.contacts, surfaced_depth_m=config.vehicle.surfaced_depth_m)
        self._mission = Mission(config.vehicle, config.goal)
        self._steering = Steering(config, repulsion)
        self._guard = Guard(config)
        self._surfacing = Surfacing(config)
        self._rise_at: FloatArray | None = None
        self._crossing_since = 0
        self._requests = MessageRequests()
        self._takeover = Takeover(config.autopilot)
        self._goal_m: FloatArray | None = None
        self._goal_range_m = 0.0
        self._heartbeat_due: Instant | None = None
        self._told: dict[str, Instant] = {}

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id, which is ours too; 0 until it is known."""
        return self._mavlink.system_id

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame of every decision, once the first position was heard."""
        return self._own.frame

    def step(self, tick: Tick) -> Decision:
        """Take what arrived and decide."""
        now = tick.t
        self._hear(tick)
        own = self._own.state()
        tracks = self._tracks(now)
        reasons = self._own.doubts(now) + self._picture.notes(now) + self._requests.notes()
        goal_m = self._goal(reasons)
        to_goal_m = None if own is None or goal_m is None else own.distance_to_m(goal_m)
        phase = self._mission.advance(
            now,
            self._own.is_ready(now),
            own,
            to_goal_m,
            self._picture.reports_heard,
            lambda: own is not None and self._water_is_clear(tracks, now, own, reasons),
            lambda: self._must_rise(tracks, now, own, goal_m, reasons),
        )

        push = pull = wanted = None
        if own is not None and goal_m is not None and phase is not Phase.WAIT:
            depth_m = self._mission.target_depth_m()
            aim_m = goal_m
            if phase is Phase.RISE and self._rise_at is not None:
                aim_m, depth_m = self._rise_at, self._rise_depth_m(tracks, now, own, depth_m)
            push = self._steering.repulsion(tracks, now, own, aim_m)
            pull = self._steering.attraction(own, aim_m, phase)
            wanted = self._steering.velocity(own, tracks, pull, push, depth_m)
        verdict = self._guard.check(
            now, own, self._own.heartbeat, tracks, self._picture.reports_heard, wanted
        )
        reasons = [*verdict.reasons, *reasons, *self._explain(tracks, now, push)]  # the last word first
        status = _status(verdict, reasons)
        setpoint = self._setpoint(now, verdict)
        counts = self._counts() if self._is_heartbeat_due(now) else {}
        return Decision(
            t=now,
            phase=phase,
            status=status,
            reasons=tuple(reasons),
            own=own,
            tracks=tracks,
            repulsion=push,
            attraction_mps=None if pull is None else (float(pull[0]), float(pull[1])),
            wanted_ned_mps=wanted,
            setpoint=setpoint,
            guard_changed=verdict.changed,
            outgoing=self._outgoing(now, status, reasons, setpoint),
            oldest_used_s=self._oldest_used_s(tracks, now, push),
            system_id=self.system_id,
            counts=counts,
        )

    # ------------------------------------------------------------ stages

    def _hear(self, tick: Tick) -> None:
        for frame in tick.frames:
            for heard in self._decoders[frame.link].decode(frame):
                self._take(heard)

    def _take(self, heard: Heard) -> None:
        match heard:
            case ContactReport():
                self._picture.observe(heard)
            case OwnPosition():
                self._picture.observe_own(heard)
                if heard.source is Source.MAVLINK:
                    self._own.observe_position(heard)
            case AutopilotHeartbeat():
                self._take_heartbeat(heard)
            case CommandAck():
                self._requests.observe_ack(heard)
            case UtcTime():
                self._utc.observe(heard)

    def _take_heartbeat(self, heartbeat: AutopilotHeartbeat) -> None:
        last = self._own.heartbeat
        limit_s = self._config.autopilot.heartbeat_timeout_s
        if last is not None and elapsed_s(last.stamp, heartbeat.stamp) > limit_s:
            self._requests = MessageRequests()  # it may have rebooted and forgotten our streams
        self._own.observe_heartbeat(heartbeat)

    def _tracks(self, now: Instant) -> Tracks:
        frame = self._own.frame
        return Tracks.empty() if frame is None else self._picture.tracks(now, frame)

    def _goal(self, reasons: list[Reason]) -> FloatArray | None:
        """(2,) the goal in the local frame, once there is one; a goal out of reach is refused."""
        if self._goal_m is None and self._own.frame is not None:
            goal = self._config.goal
            north_m, east_m = self._own.frame.to_local(goal.latitude_deg, goal.longitude_deg)
            self._goal_m, self._goal_range_m = np.array((north_m, east_m)), math.hypot(north_m, east_m)
        if self._goal_range_m > MAX_RANGE_M:
            range_km = self._goal_range_m / 1000
            text = f"goal is {range_km:.0f} km from the start, at most {MAX_RANGE_M / 1000:.0f} km"
            reasons.append(Reason("plan.goal_too_far", text))
            return None
        return self._goal_m

    def _must_rise(
        self,
        tracks: Tracks,
        now: Instant,
        own: OwnState | None,
        goal_m: FloatArray | None,
        reasons: list[Reason],
    ) -> bool:
        """Whether new reports are needed and there is a place to get them."""
        if own is None or goal_m is None or self._config.vehicle.cruise_depth_m == 0:
            return False
        if self._crossing_since != self._mission.crossings:
            self._crossing_since = self._mission.crossings
            self._surfacing.begin(now)
        self._rise_at = self._surfacing.look(now, own, tracks, goal_m, reasons)
        return self._rise_at is not None

    def _rise_depth_m(self, tracks: Tracks, now: Instant, own: OwnState, below_m: float) -> float:
        """The surface once the vehicle is where it may rise; what has begun to rise goes on."""
        assert self._rise_at is not None
        near = own.distance_to_m(self._rise_at) <= RISE_WITHIN_M
        rising = own.depth_m < below_m - RISEN_M
        return 0.0 if rising or (near and self._surfacing.is_free(now, own, tracks)) else below_m

    def _water_is_clear(self, tracks: Tracks, now: Instant, own: OwnState, reasons: list[Reason]) -> bool:
        """Whether the next phase may begin: no ship within delta here, nor overhead until we have risen."""
        phase = self._mission.phase
        if not len(tracks):
            return True
        vehicle = self._config.vehicle
        dives = vehicle.cruise_depth_m > 0
        rise_s = max(own.depth_m, 0.0) / vehicle.max_vertical_speed_mps if dives else 0.0
        sets = reach.tube(tracks, now, tracks.age_s(now) + rise_s)
        distance_m = sets.nearest(own.position_m).distance_m
        clear = float(distance_m.min()) > self._config.field.delta_m + self._config.guard.own_position_error_m
        if not clear:
            mmsi = tracks.mmsi[int(np.argmin(distance_m))]
            if phase is Phase.LISTEN:
                reasons.append(Reason("plan.start_occupied", f"MMSI {mmsi} can be here already: not leaving"))
            else:
                where = "overhead before we have surfaced" if dives else "at the goal"
                text = f"MMSI {mmsi} can be {where}"
                reasons.append(Reason("plan.surface_occupied", text))
        return clear

    def _explain(self, tracks: Tracks, now: Instant, push: Repulsion | None) -> list[Reason]:
        """What an operator should know about the information steered by."""
        if push is None:
            return []
        said: list[Reason] = []
        exact = int((~push.from_network).sum())
        if exact and self._config.repulsion.kind == "network":
            said.append(
                Reason("plan.exact_field", f"{exact} contacts outside the network's range: exact field")
            )
        expired = int((tracks.age_s(now) > tracks.validity_s).sum())
        if expired:
            said.append(
                Reason("plan.expired", f"{expired} contacts silent too long: may be anywhere in reach")
            )
        return said

    def _setpoint(self, now: Instant, verdict: Verdict) -> Setpoint | None:
        if verdict.velocity_ned_mps is None:
            return None
        validity_s = self._config.timing.setpoint_validity_s
        return Setpoint(now, after(now, validity_s), verdict.velocity_ned_mps)

    def _oldest_used_s(self, tracks: Tracks, now: Instant, push: Repulsion | None) -> float | None:
        """Age of the oldest report whose ship pushed noticeably."""
        if push is None:
            return None
        strength = np.hypot(push.velocity[:, 0], push.velocity[:, 1])
        used = strength > STEERING_WEIGHT * self._config.vehicle.max_speed_mps
        return float(tracks.age_s(now)[used].max()) if used.any() else None

    # ------------------------------------------------------------ what is said

    def _is_heartbeat_due(self, now: Instant) -> bool:
        return self._heartbeat_due is None or now >= self._heartbeat_due

    def _next_heartbeat(self, now: Instant) -> Instant:
        """A second after the last one was due, not after it was sent: ticks come a little late."""
        planned = after(self._heartbeat_due or now, HEARTBEAT_S)
        return planned if planned > now else after(now, HEARTBEAT_S)

    def _outgoing(
        self, now: Instant, status: Status, reasons: list[Reason], setpoint: Setpoint | None
    ) -> tuple[Outgoing, ...]:
        out: list[Outgoing] = []
        if self.system_id and self._is_heartbeat_due(now):
            self._heartbeat_due = self._next_heartbeat(now)
            out.append(Heartbeat(status))
        if setpoint is not None:
            out.append(setpoint)
        if self._own.heartbeat is not None:
            out += self._commands(now)
            out += self._texts(now, reasons)
        return tuple(out)

    def _commands(self, now: Instant) -> list[Command]:
        limits = self._config.autopilot
        wanted: list[Command | None] = [self._requests.due(now) if limits.request_messages else None]
        if self._own.heartbeat is not None and self._own.state() is not None:
            wanted.append(self._takeover.due(now, self._own.heartbeat))
        return [command for command in wanted if command is not None]

    def _texts(self, now: Instant, reasons: list[Reason]) -> list[StatusText]:
        """New reasons for the ground station, doubts again after a while."""
        texts: list[StatusText] = []
        for reason in reasons:
            last = self._told.get(reason.code)
            again = not reason.code.startswith(NOTE) and (
                last is None or elapsed_s(last, now) > STATUSTEXT_REPEAT_S
            )
            if len(texts) < MOST_STATUSTEXTS and (last is None or again):
                self._told[reason.code] = now
                texts.append(StatusText(4, reason.text))
        return texts

    def _counts(self) -> dict[str, int]:
        merged: Counter[str] = Counter()
        for part in (self._mavlink.counts, self._nmea2000.counts, self._aivdm.counts, self._picture.counts):
            merged.update(part)
        merged["own.position_jumps"] = self._own.jumps
        merged["utc.steps"] = self._utc.steps
        return dict(sorted(merged.items()))


def _status(verdict: Verdict, reasons: list[Reason]) -> Status:
    if verdict.velocity_ned_mps is None:
        return Status.CLOSED
    return Status.DEGRADED if any(not r.code.startswith(NOTE) for r in reasons) else Status.OK
