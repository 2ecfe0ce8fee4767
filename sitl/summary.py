"""What a run came to: the numbers, the verdict, and how both are shown.  Pure."""

from dataclasses import dataclass

import msgspec
from rich.table import Table

from companion.instant import Instant, elapsed_s


@dataclass(frozen=True, slots=True)
class Approach:
    """The vehicle's closest approach to something, horizontally.

    `distance_m` is negative inside.  `vertical_clearance_m` is from the ship's assumed keel down
    to the vehicle; it is reported beside the distance and never offsets it.
    """

    distance_m: float
    at: Instant
    mmsi: int
    name: str
    north_m: float
    east_m: float
    depth_m: float
    vertical_clearance_m: float


@dataclass(frozen=True, slots=True)
class StepTime:
    """How long the core took for a step, milliseconds."""

    p50_ms: float
    p99_ms: float
    most_ms: float


@dataclass(frozen=True, slots=True)
class GuardChanges:
    """How often and by how much the guard let through something else than was wanted."""

    steps: int
    share: float  # of the steps with a wanted velocity
    largest_mps: float
    closed_steps: int  # a velocity was wanted and none was let through


@dataclass(frozen=True, slots=True)
class Summary:
    """A run in numbers.  None stands for what never happened: no ship, no set, no arrival."""

    arrived: bool
    final_phase: str
    start: Instant
    run_s: float
    time_to_goal_s: float | None  # from the first step until the goal was reached
    under_way_s: float | None  # the part of it spent crossing, without the listening
    delta_m: float
    closest_hull: Approach | None
    closest_set: Approach | None
    closest_tube_m: float | None  # to the sets over the horizon, which the field repels from
    within_delta_s: float
    contacts_heard: int
    ships_in_the_sea: int
    oldest_used_s: float | None
    steps: int
    step_time: StepTime
    guard: GuardChanges
    reason_s: dict[str, float]  # how long each reason stood
    truth_until_s: float | None  # hulls are known up to here, where the sea is a log; None: to the end
    closest_hull_heard: bool  # the ship of `closest_hull` had reported
    last_reasons: tuple[str, ...]  # doubts and obstacles at the last step, without the mere notes

    @property
    def failures(self) -> tuple[str, ...]:
        """What the run is blamed for, a sentence each; none if it went well."""
        said = []
        near = self.closest_set
        if near is not None and near.distance_m < self.delta_m:
            when_s = elapsed_s(self.start, near.at)
            how_near = f"within {near.distance_m:.1f} m of" if near.distance_m > 0 else "into"
            said.append(
                f"came {how_near} a reachable set ({near.name or near.mmsi}, {when_s:.0f} s after the start; "
                f"delta is {self.delta_m:g} m, {self.within_delta_s:.0f} s were spent below it)"
            )
        if not self.arrived:
            why = f": {'; '.join(self.last_reasons)}" if self.last_reasons else ""
            said.append(f"did not arrive: after {self.run_s:.0f} s the phase was {self.final_phase}{why}")
        return tuple(said)

    def to_json(self) -> bytes:
        """The summary as indented JSON, for the run folder."""
        tables = msgspec.to_builtins(self) | {"failures": self.failures}
        return msgspec.json.format(msgspec.json.encode(tables), indent=2) + b"\n"

    def table(self) -> Table:
        """The summary for a terminal."""
        table = Table(show_header=False, box=None, pad_edge=False)
        table.add_column(style="dim", no_wrap=True)
        table.add_column()
        for name, value in self._rows():
            table.add_row(name, value)
        return table

    def _rows(self) -> list[tuple[str, str]]:
        time, guard = self.step_time, self.guard
        goal = "not reached" if self.time_to_goal_s is None else f"{self.time_to_goal_s:.0f} s"
        if self.under_way_s is not None:
            goal += f", {self.under_way_s:.0f} s of it under way"
        tube = (
            "" if self.closest_tube_m is None else f"; {self.closest_tube_m:.1f} m to a set over its horizon"
        )
        changes = f"{guard.steps} steps ({guard.share:.1%}), by up to {guard.largest_mps:.2f} m/s"
        return [
            ("closest to a real hull", self._closest_hull()),
            ("closest to a reachable set", self._approach(self.closest_set) + tube),
            ("time to goal", goal),
            ("contacts heard", f"{self.contacts_heard} of {self.ships_in_the_sea} ships in the sea"),
            (
                "oldest information used",
                "none" if self.oldest_used_s is None else f"{self.oldest_used_s:.0f} s",
            ),
            ("step time", f"p50 {time.p50_ms:.2f} ms, p99 {time.p99_ms:.2f} ms, most {time.most_ms:.1f} ms"),
            ("the guard changed", f"{changes}; closed in {guard.closed_steps}"),
        ]

    def _closest_hull(self) -> str:
        said = self._approach(self.closest_hull)
        if self.closest_hull is not None and not self.closest_hull_heard:
            said += "; it was never heard of"
        if self.truth_until_s is not None and self.truth_until_s < self.run_s:
            said += f" (known until {self.truth_until_s:.0f} s, the end of the log)"
        return said

    def _approach(self, approach: Approach | None) -> str:
        if approach is None:
            return "none was there"
        overlap = " (horizontal overlap)" if approach.distance_m < 0 else ""
        return (
            f"{approach.distance_m:.1f} m{overlap}, {approach.name or approach.mmsi}, "
            f"{elapsed_s(self.start, approach.at):.0f} s after the start, "
            f"vehicle {approach.vertical_clearance_m:.0f} m below the keel"
        )
