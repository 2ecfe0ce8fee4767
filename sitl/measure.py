"""Measures a run: what the vehicle did, against the true hulls and against the reachable sets.

Collecting costs a few microseconds a step; every distance is computed once, at the end.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from companion import reach
from companion.instant import Instant, elapsed_s
from companion.loop import Tick
from companion.messages import Decision, FloatArray, IntArray, OwnState, Phase, Tracks
from sitl.closest import Distances, search, to_hulls
from sitl.summary import Approach, GuardChanges, StepTime, Summary

DRAUGHT_M = 8.0  # assumed of every ship: position reports do not carry it
REACHED = (Phase.SURFACE, Phase.ARRIVED)

Truth = Callable[[Instant], Tracks]


@dataclass(frozen=True, slots=True)
class Course:
    """A run step by step, in the local frame of the sea.

    `t_ns` (k,), `position_m` (k, 2) and `depth_m` (k,) are the vehicle's true state; `phase` and
    `tracks` are what the companion had at each step.  Its tracks are in its own frame, whose
    origin lies at `origin_m` (2,) here.
    """

    t_ns: IntArray
    position_m: FloatArray
    depth_m: FloatArray
    phase: tuple[Phase, ...]
    tracks: tuple[Tracks, ...]
    truth: Truth
    origin_m: FloatArray
    to_sets: Distances
    to_hulls: Distances

    def __len__(self) -> int:
        return len(self.t_ns)

    @property
    def since_start_s(self) -> FloatArray:
        """(k,) seconds since the first step."""
        return np.asarray((self.t_ns - self.t_ns[0]) * 1e-9)

    def instant(self, step: int) -> Instant:
        """When a step was."""
        return Instant(int(self.t_ns[step]))


class Measure:
    """A journal that measures.  `truth(t)` is where every hull is, all bounds zero; `vehicle()`
    the vehicle's true state at the step being taken; `truth_until_s` when the truth ends, if it does."""

    def __init__(
        self,
        truth: Truth,
        vehicle: Callable[[], OwnState],
        delta_m: float,
        truth_until_s: float | None = None,
    ) -> None:
        self._truth = truth
        self._truth_until_s = truth_until_s
        self._vehicle = vehicle
        self._delta_m = delta_m
        self._own: list[OwnState] = []
        self._decisions: list[Decision] = []
        self._step_s: list[float] = []

    def tick(self, tick: Tick) -> None:
        """Nothing is measured before the step."""

    def timed(self, t: Instant, step_s: float) -> None:  # noqa: ARG002
        """Keep the duration."""
        self._step_s.append(step_s)

    def decided(self, decision: Decision) -> None:
        """Keep the decision beside the vehicle's true state."""
        self._decisions.append(decision)
        self._own.append(self._vehicle())

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """Bytes are not measured."""

    def course(self, origin_m: FloatArray | None = None) -> Course:
        """The run so far; `origin_m` (2,) is the companion's local origin in the sea's frame."""
        origin = np.zeros(2) if origin_m is None else np.asarray(origin_m)
        t = [decision.t for decision in self._decisions]
        position = np.array([(own.north_m, own.east_m) for own in self._own]).reshape(-1, 2)
        tracks = tuple(decision.tracks for decision in self._decisions)
        revision = np.array([each.revision for each in tracks], dtype=np.int64)
        t_ns = np.array(t, dtype=np.int64)

        def to_sets(step: int) -> FloatArray:
            return reach.at(tracks[step], t[step]).nearest(position[step] - origin).distance_m

        def to_true_hulls(step: int) -> FloatArray:
            return to_hulls(self._truth(t[step]), position[step])

        t_s = np.asarray(t_ns * 1e-9)
        changed = np.flatnonzero(np.diff(revision, prepend=revision[:1]))
        never = np.zeros(0, dtype=np.int64)
        return Course(
            t_ns=t_ns,
            position_m=position,
            depth_m=np.array([own.depth_m for own in self._own]),
            phase=tuple(decision.phase for decision in self._decisions),
            tracks=tracks,
            truth=self._truth,
            origin_m=origin,
            to_sets=search(t_s, to_sets, changed, self._delta_m),
            to_hulls=search(t_s, to_true_hulls, never, 0.0),
        )

    def summary(self, course: Course) -> Summary:
        """The run in numbers; `course` is what `course()` gave."""
        decisions = self._decisions
        if not decisions:
            raise ValueError("nothing was measured: the loop took no step")
        start, last = decisions[0].t, decisions[-1]
        at_goal = next((d.t for d in decisions if d.phase in REACHED), None)
        left = next((d.t for d in decisions if d.phase is Phase.CROSS), None)
        used_s = [d.oldest_used_s for d in decisions if d.oldest_used_s is not None]
        distinct = {id(tracks): tracks for tracks in course.tracks}.values()
        closest_hull = _approach(course, course.to_hulls, lambda k: course.truth(course.instant(k)))
        heard = np.unique(np.concatenate([tracks.mmsi for tracks in distinct]))
        return Summary(
            arrived=last.phase is Phase.ARRIVED,
            final_phase=last.phase,
            start=start,
            run_s=elapsed_s(start, last.t),
            time_to_goal_s=None if at_goal is None else elapsed_s(start, at_goal),
            under_way_s=None if at_goal is None or left is None else elapsed_s(left, at_goal),
            delta_m=self._delta_m,
            closest_hull=closest_hull,
            closest_set=_approach(course, course.to_sets, lambda k: course.tracks[k]),
            closest_tube_m=_closest_tube_m(decisions),
            within_delta_s=_within_s(course, self._delta_m),
            contacts_heard=len(heard),
            ships_in_the_sea=max(len(course.truth(d.t)) for d in decisions[:: max(len(decisions) // 20, 1)]),
            oldest_used_s=max(used_s, default=None),
            steps=len(decisions),
            step_time=_step_time(self._step_s),
            guard=_guard_changes(decisions),
            reason_s=_reason_s(decisions),
            truth_until_s=self._truth_until_s,
            closest_hull_heard=closest_hull is None or closest_hull.mmsi in heard,
            last_reasons=tuple(r.text for r in last.reasons if not r.code.startswith("note.")),
        )


def _approach(course: Course, distances: Distances, tracks_at: Callable[[int], Tracks]) -> Approach | None:
    k = distances.least()
    if k is None:
        return None
    step, row = int(distances.step[k]), int(distances.row[k])
    tracks = tracks_at(step)
    depth_m = float(course.depth_m[step])
    return Approach(
        distance_m=float(distances.nearest_m[k]),
        at=course.instant(step),
        mmsi=int(tracks.mmsi[row]),
        name=tracks.names[row] if tracks.names else "",
        north_m=float(course.position_m[step, 0]),
        east_m=float(course.position_m[step, 1]),
        depth_m=depth_m,
        vertical_clearance_m=depth_m - DRAUGHT_M,
    )


def _closest_tube_m(decisions: list[Decision]) -> float | None:
    seen = [d.repulsion.nearest.distance_m for d in decisions if d.repulsion is not None]
    return min((float(distance_m.min()) for distance_m in seen if len(distance_m)), default=None)


def _within_s(course: Course, limit_m: float) -> float:
    """Time spent within the limit of a reachable set."""
    near = course.to_sets.step[course.to_sets.nearest_m < limit_m]
    step_s = np.diff(course.t_ns, append=course.t_ns[-1:]) * 1e-9
    return float(step_s[near].sum())


def _step_time(step_s: list[float]) -> StepTime:
    p50, p99, most = np.quantile(np.array(step_s or [0.0]) * 1e3, (0.5, 0.99, 1.0)).tolist()
    return StepTime(p50, p99, most)


def _guard_changes(decisions: list[Decision]) -> GuardChanges:
    wanted = [d for d in decisions if d.wanted_ned_mps is not None]
    changed = [d for d in wanted if d.guard_changed and d.setpoint is not None]
    largest = max((_change_mps(d) for d in changed), default=0.0)
    closed = sum(d.setpoint is None for d in wanted)
    return GuardChanges(len(changed), len(changed) / max(len(wanted), 1), largest, closed)


def _change_mps(decision: Decision) -> float:
    if decision.setpoint is None or decision.wanted_ned_mps is None:
        return 0.0
    return float(np.linalg.norm(np.subtract(decision.setpoint.velocity_ned_mps, decision.wanted_ned_mps)))


def _reason_s(decisions: list[Decision]) -> dict[str, float]:
    stood: Counter[str] = Counter()
    for decision, following in pairwise(decisions):
        for code in {reason.code for reason in decision.reasons}:
            stood[code] += following.t - decision.t
    return {code: ns * 1e-9 for code, ns in sorted(stood.items())}
