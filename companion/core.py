"""One step from frames to a decision; reads top to bottom like the line it implements.

    Frame -wire-> Heard -picture-> Tracks -field-> wanted velocity -guard-> Setpoint

Pure: no clock, no I/O, no randomness.  The same ticks give the same decisions, bit for bit.
"""

import math

import numpy as np

from companion.config import Config
from companion.geodesy import MAX_RANGE_M, LocalFrame
from companion.hearing import Hearing
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
    Outgoing,
    OwnPosition,
    OwnState,
    Phase,
    Reason,
    Repulsion,
    Setpoint,
    Source,
    Status,
    Tracks,
)
from companion.own import Ownship
from companion.picture import Picture
from companion.planning.ascent import Ascent
from companion.planning.foresight import Foresight
from companion.planning.guard import Guard, Intended, Verdict
from companion.planning.mission import Mission
from companion.planning.outlook import Outlook
from companion.planning.steering import RepulsionField, Steering
from companion.reach.kernel import Kernel, nearest
from companion.requests import MessageRequests
from companion.takeover import Takeover
from companion.telling import Telling, degrades, in_order

STEERING_WEIGHT = 0.01  # a repulsion below this share of full speed did not steer


class Core:
    """The companion's mind: holds the decoders, the picture and the plan; `step` advances them."""

    def __init__(self, config: Config, repulsion: RepulsionField, kernel: Kernel = nearest) -> None:
        self._config = config
        self._hearing = Hearing(config.autopilot)
        self._own = Ownship(config.autopilot)
        self._picture = Picture(config.contacts, surfaced_depth_m=config.vehicle.surfaced_depth_m)
        self._mission = Mission(config.vehicle, config.goal)
        self._steering = Steering(config, repulsion)
        self._guard = Guard(config, kernel)
        self._outlook = Outlook(config, kernel)
        self._foresight = Foresight(config, kernel)
        self._ascent = Ascent(config, kernel)
        self._requests = MessageRequests()
        self._takeover = Takeover(config.autopilot)
        self._goal_m: FloatArray | None = None
        self._goal_range_m = 0.0
        self._telling = Telling()

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id, which is ours too; 0 until it is known."""
        return self._hearing.system_id

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame of every decision, once the first position was heard."""
        return self._own.frame

    def step(self, tick: Tick) -> Decision:
        """Take what arrived and decide."""
        now = tick.t
        for heard in self._hearing.heard(tick):
            self._take(heard)
        own = self._own.state()
        tracks = self._tracks(now)
        reasons = self._own.doubts(now) + self._picture.notes(now) + self._requests.notes()
        goal_m = self._goal(reasons)
        phase = self._phase(now, own, tracks, goal_m, reasons)

        push = pull = wanted = intended = None
        if own is not None and goal_m is not None and phase is not Phase.WAIT:
            depth_m = self._mission.target_depth_m()
            aim_m = goal_m
            pulled = phase
            if phase is Phase.RISE:
                aim_m, depth_m = self._ascent.aim(now, own, tracks, depth_m) or (goal_m, depth_m)
            elif phase is Phase.CROSS and (post_m := self._outlook.post(own, tracks, reasons)) is not None:
                aim_m, pulled = post_m, Phase.SURFACE  # gently, onto the place it holds
            elif phase is Phase.CROSS:
                intended = self._intended(now, own, tracks, goal_m)
            push = self._steering.repulsion(tracks, now, own, aim_m)
            pull = self._steering.attraction(own, aim_m, pulled)
            wanted = self._steering.velocity(own, tracks, pull, push, depth_m)
        verdict = self._guard.check(
            now, own, self._own.heartbeat, tracks, self._picture.reports_heard, wanted, intended
        )
        reasons = [*verdict.reasons, *reasons, *self._explain(tracks, now, push)]  # the last word first
        status = _status(verdict, reasons)
        setpoint = self._setpoint(now, verdict)
        counts = self._counts() if self._telling.is_heartbeat_due(now) else {}
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

    def _phase(
        self,
        now: Instant,
        own: OwnState | None,
        tracks: Tracks,
        goal_m: FloatArray | None,
        reasons: list[Reason],
    ) -> Phase:
        if own is None or goal_m is None or not self._own.is_ready(now):
            return self._mission.pause(now)
        self._outlook.look(now, self._mission.phase, own, tracks, goal_m)
        return self._mission.advance(
            now,
            own,
            own.distance_to_m(goal_m),
            self._picture.reports_heard,
            lambda: self._is_clear(now, own, tracks, reasons),
            lambda: self._ascent.must_rise(
                now, own, tracks, goal_m, self._mission.crossings, self._outlook.holds, reasons
            ),
        )

    def _is_clear(self, now: Instant, own: OwnState, tracks: Tracks, reasons: list[Reason]) -> bool:
        """Whether the next phase may begin."""
        phase = self._mission.phase
        clear = self._ascent.is_clear(now, own, tracks, phase, reasons)
        return clear and (phase is not Phase.LISTEN or self._outlook.may_leave(reasons))

    def _intended(self, now: Instant, own: OwnState, tracks: Tracks, goal_m: FloatArray) -> Intended | None:
        """What the planner will do, where the guard may need to know."""
        if self._guard.lies_free:
            self._foresight.forget()
        elif not self._outlook.is_playing:  # one play a step has to do
            self._foresight.look(now, own, tracks, goal_m)
        return self._foresight.intended

    def _explain(self, tracks: Tracks, now: Instant, push: Repulsion | None) -> list[Reason]:
        """What an operator should know about the information steered by."""
        if push is None:
            return []
        said: list[Reason] = []
        exact = len(tracks) - np.count_nonzero(push.from_network)
        if exact and self._config.repulsion.kind == "network":
            said.append(
                Reason("plan.exact_field", f"{exact} contacts outside the network's range: exact field")
            )
        expired = np.count_nonzero(tracks.age_s(now) > tracks.validity_s)
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

    def _outgoing(
        self, now: Instant, status: Status, reasons: list[Reason], setpoint: Setpoint | None
    ) -> tuple[Outgoing, ...]:
        heartbeat = self._telling.heartbeat(now, status) if self.system_id else []
        if self._own.heartbeat is None:
            return in_order(heartbeat, setpoint, [], [])
        return in_order(heartbeat, setpoint, self._commands(now), self._telling.texts(now, reasons))

    def _commands(self, now: Instant) -> list[Command]:
        limits = self._config.autopilot
        wanted: list[Command | None] = [self._requests.due(now) if limits.request_messages else None]
        if self._own.heartbeat is not None and self._own.state() is not None:
            wanted.append(self._takeover.due(now, self._own.heartbeat))
        return [command for command in wanted if command is not None]

    def _counts(self) -> dict[str, int]:
        merged = self._hearing.counts()
        merged.update(self._picture.counts)
        merged["own.position_jumps"] = self._own.jumps
        return dict(sorted(merged.items()))


def _status(verdict: Verdict, reasons: list[Reason]) -> Status:
    if verdict.velocity_ned_mps is None:
        return Status.CLOSED
    return Status.DEGRADED if any(map(degrades, reasons)) else Status.OK
